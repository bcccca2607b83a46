# SPDX-License-Identifier: BSD-3-Clause
"""Recordings for the tests, computed, and written in every format.

``made`` takes the duties from the discrete flux balance of the nominal machine, so that angle, currents and duties
belong together as in a real recording; effects that a diagnosis is to find can be added.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from cocotb_tests.support.drives import BUS, L_D, L_Q, PAPER, PLAIN, PSI, R
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import COLUMNS

DRIVE = f"\n{PLAIN}[control]\nsample_time_s = 0.0001\n"
T = 1e-4
U_DC = BUS
TURNS = np.exp(-2j * np.pi / 3 * np.arange(3))
FAST = ("t", "i_a", "i_b", "i_c", "theta_e", "omega_e", "u_dc", "d_a", "d_b", "d_c")


def nominal_of(folder, columns: str = ""):
    path = folder / "drive.toml"
    path.write_text(DRIVE + ("[columns]\n" + columns if columns else ""))
    return load_nominal(path)


def made(n=4000, speed=400.0, noise=0.004, offset=0.0, gain=(1.0, 1.0, 1.0), encoder=0.0, u_dc_gain=1.0, seed=1):
    """Canonical columns {name: (n,)} of the nominal machine at a rising speed with steps of current.

    offset [A] and gain: of the current sensors; encoder [rad]; u_dc_gain: of the bus sensor.
    """
    rng = np.random.default_rng(seed)
    k = np.arange(n)
    omega = speed * (0.6 + 0.4 * k / n)
    theta = np.cumsum(np.append(0.0, omega[:-1])) * T
    stages = np.array([0.0, 2.0, -3.0, 4.5])
    i_q = np.convolve(np.pad(stages[k * 4 // n], 25, mode="edge"), np.ones(51) / 51, mode="valid")
    i_dq = -0.3 * i_q + 1j * i_q
    turn = np.exp(1j * theta)
    i_s, psi = i_dq * turn, (L_D * i_dq.real + 1j * L_Q * i_dq.imag + PSI) * turn
    u = R * 0.5 * (i_s[1:] + i_s[:-1]) + np.diff(psi) / T
    u = np.append(u, u[-1])
    legs = (u[:, None] * TURNS).real / U_DC
    legs = 0.5 + legs - 0.5 * (legs.max(axis=1, keepdims=True) + legs.min(axis=1, keepdims=True))
    duties = np.roll(legs, -1, axis=0)  # row k's duty rules the interval from k+1 on
    phases = (i_s[:, None] * TURNS).real * np.asarray(gain) + np.array([offset, 0.0, 0.0])
    phases += noise * rng.normal(size=phases.shape)
    code = 25.0 / 4096
    phases = np.round(phases / code) * code
    table = {"t": k * T, "theta_e": np.mod(theta + encoder, 2 * np.pi), "omega_e": omega}
    table |= {name: phases[:, x] for x, name in enumerate(("i_a", "i_b", "i_c"))}
    table |= {name: duties[:, x] for x, name in enumerate(("d_a", "d_b", "d_c"))}
    table["u_dc"] = U_DC * u_dc_gain + 0.1 * rng.normal(size=n)
    return {name: table[name] for name in FAST}


def dq_made(n=2000, step=0.01, seed=2):
    """A slow log of dq values at steady operating points, canonical columns."""
    rng = np.random.default_rng(seed)
    omega = np.repeat(np.linspace(100.0, 500.0, 20), n // 20)
    i_q = np.tile(np.repeat([0.5, 2.0, -2.0, 4.0], n // 80), 20)
    i_d = -0.2 * np.abs(i_q)
    table = {"t": np.arange(n) * step, "i_d": i_d, "i_q": i_q, "omega_e": omega}
    table["u_d_ref"] = R * i_d - omega * L_Q * i_q
    table["u_q_ref"] = R * i_q + omega * (L_D * i_d + PSI)
    table["u_dc"] = np.full(n, U_DC)
    return {name: v + (0.0 if name in ("t", "u_dc") else 0.01 * rng.normal(size=n)) for name, v in table.items()}


def write(path, table, units=None, **options):
    """The columns in the format of the suffix; returns the path."""
    units = units or {}
    suffix = path.suffix
    frame = pd.DataFrame(table)
    if suffix in (".csv", ".txt"):
        frame.to_csv(path, index=False, **options)
    elif suffix == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        fields = [pa.field(n, pa.float64(), metadata={"unit": units[n]} if n in units else None) for n in table]
        pq.write_table(pa.table([pa.array(v) for v in table.values()], schema=pa.schema(fields)), path)
    elif suffix == ".npz":
        np.savez_compressed(path, **table)
    elif suffix == ".npy":
        np.save(path, frame.to_records(index=False))
    elif suffix == ".h5":
        import h5py

        with h5py.File(path, "w") as file:
            for name, values in table.items():
                file.create_dataset(f"run/{name}", data=values, compression="gzip").attrs["unit"] = units.get(name, "")
    elif suffix == ".mat":
        from scipy.io import savemat

        savemat(path, {"run": table}, do_compression=True)
    elif suffix == ".mf4":
        from asammdf import MDF, Signal

        with MDF() as mdf:
            rest = [n for n in table if n != "t"]
            mdf.append([Signal(table[n], table["t"], name=n, unit=units.get(n, "")) for n in rest])
            mdf.save(path, overwrite=True)
    else:
        raise ValueError(suffix)
    return path


def write_mat73(path, table):
    """A version 7.3 file as MATLAB writes a structure: HDF5 behind a block of 512 bytes."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("run")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in table.items():
            group.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


def as_text(table, separator, decimal, header=True, units=False, before="", end="\n"):
    """The columns as text of any layout."""
    lines = [separator.join(table)] if header else []
    if units:
        lines.append(separator.join(COLUMNS[name] if COLUMNS[name] != "1" else "-" for name in table))
    rows = np.column_stack(list(table.values()))
    lines += [separator.join(repr(float(x)).replace(".", decimal) for x in row) for row in rows]
    return before + "\n".join(lines) + end


def codes(recording):
    return [p.code for p in recording.problems]


def dump(path):
    """A telemetry dump of the golden model's core; returns (path, drive.toml that belongs to it)."""
    from fluxproof.cosim.scenarios import everything
    from fluxproof.diagnosis.replay import telemetry
    from fluxproof.diagnosis.replay.capture import capture
    from golden_model import drive, fluxproof
    from golden_model.registers import registers

    paper = drive.load(PAPER)
    register_set = registers(paper)
    samples, observed, _ = capture(paper, register_set, everything(paper))
    seen = {name: observed[name] for name in fluxproof.Observed._fields}
    return telemetry.write_dump(path, paper, register_set, samples, seen), PAPER
