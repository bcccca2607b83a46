# SPDX-License-Identifier: BSD-3-Clause
"""Small valid files of every format, which are then damaged."""

from __future__ import annotations

import functools
import io
import json
import tempfile
from pathlib import Path

import numpy as np

from fluxproof.checkout import DRIVES
from scripts.fuzz.case import Case

NOMINAL = """[machine]
pole_pairs = 4
resistance_ohm = 1.53
inductance_d_h = 0.01607
inductance_q_h = 0.01581
magnet_flux_wb = 0.165
rated_current_a = 5.23
[inverter]
dc_bus_v = 563.0
pwm_frequency_hz = 10000.0
[control]
sample_time_s = 0.0001
"""
DRIVE = DRIVES / "servo_24v.toml"
PERIOD, BUS = 1e-4, 563.0
PHASES = np.exp(-2j * np.pi / 3 * np.arange(3))


def motor(n: int) -> dict[str, np.ndarray]:
    """Canonical columns (n,) of the nominal machine: steps of current at a rising speed."""
    k = np.arange(n)
    omega = 400.0 * (0.6 + 0.4 * k / n)
    theta = np.cumsum(np.append(0.0, omega[:-1])) * PERIOD
    i_dq = np.array([0.0, 2.0, -3.0, 4.5])[k * 4 // n] * (-0.3 + 1j)
    turn = np.exp(1j * theta)
    current, flux = i_dq * turn, (0.01607 * i_dq.real + 1j * 0.01581 * i_dq.imag + 0.165) * turn
    voltage = 1.53 * current + np.gradient(flux) / PERIOD
    duties = np.clip(0.5 + (voltage[:, None] * PHASES).real / BUS, 0.0, 1.0)
    noise = 0.004 * np.random.default_rng(1).normal(size=(n, 3))
    phases = (current[:, None] * PHASES).real + noise
    table = {
        "t": k * PERIOD,
        "theta_e": np.mod(theta, 2 * np.pi),
        "omega_e": omega,
        "u_dc": np.full(n, BUS) + noise[:, 0],
    }
    table |= {f"i_{x}": phases[:, p] for p, x in enumerate("abc")}
    return table | {f"d_{x}": np.roll(duties[:, p], -1) for p, x in enumerate("abc")}


def text(table: dict, separator: str = ",", decimal: str = ".", units: str = "", end: str = "\n") -> bytes:
    """A text table; units: a second line."""
    rows = np.column_stack(list(table.values()))
    lines = [separator.join(table), *([units] if units else [])]
    lines += [separator.join(f"{x:.6g}".replace(".", decimal) for x in row) for row in rows]
    return (end.join(lines) + end).encode()


@functools.cache
def recordings(n: int = 24) -> tuple[Case, ...]:
    """One recording in every format, n rows."""
    table = motor(n)
    with tempfile.TemporaryDirectory() as folder:
        found = [Case(".csv", text(table)), Case(".csv", text(table, ";", ",", end="\r\n"))]
        found += [Case(".txt", text(table, "\t", units="\t".join(["s"] + ["-"] * 9)))]
        found += [Case(".csv", text({"time": table["t"], **table}).replace(b"\n0,", b"\n2026-01-01T10:00:00.5,", 1))]
        for writer in (_parquet, _mat, _mat73, _hdf5, _numpy, _mdf):
            found += [Case(suffix, content) for suffix, content in writer(table, Path(folder))]
    return tuple(found)


def _parquet(table, folder):
    import pyarrow as pa
    import pyarrow.parquet as pq

    for compression in ("none", "snappy"):
        pq.write_table(pa.table(table), folder / "r.parquet", compression=compression)
        yield ".parquet", (folder / "r.parquet").read_bytes()


def _mat(table, folder):
    from scipy.io import savemat

    signals = np.array([(name, table[name]) for name in ("i_a", "i_b")], dtype=[("Name", object), ("Data", object)])
    for content, packed in (({"run": table}, False), ({"run": table}, True), ({"X": table["t"], "Y": signals}, False)):
        savemat(folder / "r.mat", content, do_compression=packed)
        yield ".mat", (folder / "r.mat").read_bytes()


def _mat73(table, folder):
    import h5py

    with h5py.File(folder / "r73.mat", "w", userblock_size=512) as file:
        group = file.create_group("run")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in table.items():
            group.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
    with open(folder / "r73.mat", "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    yield ".mat", (folder / "r73.mat").read_bytes()


def _hdf5(table, folder):
    import h5py

    for options in ({}, {"compression": "gzip"}):
        with h5py.File(folder / "r.h5", "w") as file:
            for name, values in table.items():
                file.create_dataset(f"run/{name}", data=values, **options).attrs["unit"] = "A"
        yield ".h5", (folder / "r.h5").read_bytes()


def _numpy(table, folder):
    import pandas as pd

    np.save(folder / "r.npy", pd.DataFrame(table).to_records(index=False))
    yield ".npy", (folder / "r.npy").read_bytes()
    for save in (np.savez, np.savez_compressed):
        stream = io.BytesIO()
        save(stream, **table)
        yield ".npz", stream.getvalue()


def _mdf(table, folder):
    from asammdf import MDF, Signal

    for version, suffix in (("4.10", ".mf4"), ("3.30", ".mdf")):
        with MDF(version=version) as mdf:
            mdf.append([Signal(table[n], table["t"], name=n, unit="A") for n in table if n != "t"])
            mdf.save(folder / f"r{suffix}", overwrite=True)
        yield suffix, (folder / f"r{suffix}").read_bytes()


@functools.cache
def telemetry() -> tuple[Case, ...]:
    """A dump, its capture and a register file of the paper's drive, 40 samples."""
    from fluxproof.cosim.scenarios import everything
    from fluxproof.diagnosis.replay import capture, telemetry
    from golden_model import drive, fluxproof
    from golden_model.registers import registers

    chosen = drive.load(DRIVES / "paper000.toml")
    register_set = registers(chosen)
    samples, observed, _ = capture.capture(chosen, register_set, everything(chosen))
    samples, observed = samples[:40], {name: values[:40] for name, values in observed.items()}
    with tempfile.TemporaryDirectory() as folder:
        dump = telemetry.write_dump(Path(folder, "r.dump"), chosen, register_set, samples, observed).read_bytes()
    named = {name: samples[:, k] for k, name in enumerate(fluxproof.Sample._fields)} | {"counter": np.arange(40)}
    words = packets(named | observed)
    integers = json.dumps(register_set.values._asdict(), default=int).encode()
    return Case(".dump", dump), Case(".bin", words), Case(".json", integers)


def packets(fields: dict[str, np.ndarray]) -> bytes:
    """The words of the core's stream as a DMA stores them."""
    from golden_model.io.telemetry_words import COUNT, HEADER_WORD, LAYOUT

    rows = np.zeros((len(fields["counter"]), COUNT), np.uint32)
    rows[:, 0] = HEADER_WORD
    for name, field in LAYOUT.items():
        if name not in fields:
            continue
        rows[:, field.word] |= ((fields[name].astype(np.int64) & ((1 << field.width) - 1)) << field.lsb).astype(
            np.uint32
        )
    return rows.astype("<u4").tobytes()


@functools.cache
def drives() -> tuple[bytes, ...]:
    """The drive files of the documents and the smallest one."""
    return (NOMINAL.encode(), *(path.read_bytes() for path in sorted(DRIVES.glob("*.toml"))))
