# SPDX-License-Identifier: BSD-3-Clause
"""A reader takes no more time and memory than the size of the file allows, and its refusal names the reason."""

from __future__ import annotations

import contextlib
import os
import signal
import struct
import time
from pathlib import Path

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_equations import as_text, made, nominal_of, write
from cocotb_tests.support.untrusted import hostile_files as hostile
from cocotb_tests.support.untrusted.hostile_files import refused
from fluxproof.diagnosis.ground import limits
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.readers import read_table


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def quick(path, *parts, seconds=2.0):
    start = time.process_time()
    refused(path, *parts)
    assert time.process_time() - start < seconds


def test_deep_groups_and_rings_of_hdf5(tmp_path):
    def deep(file):
        for _ in range(300):
            file = file.create_group("g")

    quick(hostile.hdf5(tmp_path / "deep.h5", deep), "32 groups inside each other")

    def ring(file):
        a, b = file.create_group("a"), file.create_group("b")
        a["b"], b["a"], a["up"] = b, a, file["/"]
        file["i_a"] = made(800)["i_a"]

    assert len(read_table(hostile.hdf5(tmp_path / "ring.h5", ring)).columns) == 10


def test_what_hdf5_declares_and_does_not_store(tmp_path):
    build = lambda n: lambda f: f.create_dataset("i_a", (n,), "f8", chunks=(800,))  # noqa: E731
    quick(hostile.hdf5(tmp_path / "huge.h5", build(10**13)), "i_a", "numbers are to be read from")
    path = hostile.hdf5(tmp_path / "empty.h5", build(800))
    refused(path, "i_a", "declares 1 chunks and stores 0")
    assert len(read_table(path, lambda names: ["i_b"]).columns["i_b"]) == 800
    plain = hostile.hdf5(tmp_path / "plain.h5", lambda f: f.create_dataset("i_a", (800,), "f8"))
    refused(plain, "i_a", "declares 6400 bytes and stores 0")


@pytest.mark.parametrize("make, suffix", [(hostile.constant_npz, ".npz"), (hostile.constant_parquet, ".parquet")])
def test_much_from_few_bytes(tmp_path, make, suffix):
    path = make(tmp_path / f"r{suffix}", made(4), 1_000_000)
    quick(path, "10000000 numbers are to be read from", "can have 4000000")
    assert len(read_table(path, lambda names: ["t", "i_a"]).columns["t"]) == 1_000_000


def test_mat_that_unpacks_to_much(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "r.mat", {"x": np.zeros(6_000_000)}, do_compression=True)
    quick(tmp_path / "r.mat", "unpacks from")
    build = lambda f: f.create_dataset("x", (1, 6_000_000), "f8", chunks=(1, 10_000), compression="gzip")  # noqa: E731
    quick(hostile.mat73(tmp_path / "r73.mat", build), "numbers are to be read from")


def test_mdf_that_declares_much(tmp_path):
    path = hostile.mdf(tmp_path / "r.mf4", None)
    content = bytearray(path.read_bytes())
    at = content.index((800).to_bytes(8, "little"), content.index(b"##CG"))
    content[at : at + 8] = (10**12).to_bytes(8, "little")
    path.write_bytes(content)
    quick(path, "1000000000000 samples")


@pytest.mark.parametrize(("kind", "shape"), [("|S0", "(-1,)"), ("|S0", "(3, 2)"), ("<f8", "(-1, 2)"), ("|V0", "(-5,)")])
def test_sizes_by_which_numpy_would_divide_by_zero(tmp_path, kind, shape):
    """A find of `make fuzz`: the process ended with SIGFPE."""
    header = f"{{'descr': '{kind}', 'fortran_order': True, 'shape': {shape}}}".ljust(117) + "\n"
    path = tmp_path / "r.npy"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode())
    quick(path, "the array declares")


@pytest.mark.parametrize("version", ["3.30", "4.10"])
def test_a_ring_of_channel_groups_in_an_mdf_file(tmp_path, version):
    """The next group of the only group is itself: asammdf would count groups for ever."""
    path = hostile.mdf(tmp_path / f"r.{'mf4' if version >= '4' else 'mdf'}", None, version=version)
    data = bytearray(Path(path).read_bytes())
    if version >= "4":
        group = data.index(b"##CG")
        data[group + 24 : group + 32] = group.to_bytes(8, "little")
    else:
        group = struct.unpack_from("<I", data, struct.unpack_from("<I", data, 68)[0] + 8)[0]
        data[group + 4 : group + 8] = group.to_bytes(4, "little")
    path = tmp_path / Path(path).name
    path.write_bytes(data)
    quick(path, "leads back to the block at byte")


def test_constant_columns_beside_real_ones_load(tmp_path):
    """Sixteen constants beside two currents of few bits; a table of constants only."""
    rng = np.random.default_rng(1)
    rows = 300_000
    table = {f"c{k}": np.full(rows, float(k)) for k in range(16)}
    table |= {name: rng.integers(0, 16, rows) / 8.0 for name in ("i_a", "i_b")}
    assert len(read_table(write(tmp_path / "r.parquet", table)).columns["i_a"]) == rows
    table = {f"c{k}": np.zeros(60_000) for k in range(40)}
    assert len(read_table(write(tmp_path / "r.h5", table)).columns["c0"]) == 60_000


def test_the_limits_grow_with_the_file():
    assert limits.most_cells(0) == limits.most_cells(100_000) == 4_000_000
    assert limits.most_cells(10_000_000) == limits.MAX_CELLS
    assert limits.most_seconds(2_000_000) == 21.0
    assert limits.most_bytes(10**6) - limits.most_bytes(0) == 24 * 28_000_000 + 4 * 10**6


def test_reading_ends_when_its_time_is_over(tmp_path, monkeypatch):
    path = write(tmp_path / "r.csv", made(600))
    monkeypatch.setattr(limits, "most_seconds", lambda size: 0.1)

    def never(names):
        while True:
            with contextlib.suppress(Exception):  # what a library does
                time.sleep(10)

    before = signal.signal(signal.SIGALRM, own := lambda *_: None)
    signal.setitimer(signal.ITIMER_REAL, 50.0)
    try:
        with pytest.raises(RecordingError, match=r"r\.csv: reading took longer than 0 s, the limit of its size"):
            read_table(path, never)
        assert signal.getsignal(signal.SIGALRM) is own  # and an alarm of somebody else goes on
        assert 45.0 < signal.getitimer(signal.ITIMER_REAL)[0] < 50.0
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


# --- messages that name the reason ---


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_utf16_without_a_mark_is_read(tmp_path, nominal, encoding):
    path = tmp_path / "r.csv"
    path.write_bytes(as_text(made(600), ",", ".").encode(encoding))
    np.testing.assert_array_equal(load_recording(path, nominal)["d_c"], made(600)["d_c"])


def test_too_many_columns_are_counted(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("\n".join([",".join(["1"] * 100_000)] * 3) + "\n")
    refused(path, ":1: 100000 columns; at most 20000 are read")
    path.write_text(",".join(f"c{k}" for k in range(100_000)) + "\n")
    refused(path, "columns in it; at most 20000 columns are read")


def twice(folder, suffix, name):
    """A recording in which ``name`` heads two columns."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table, path = made(600), folder / f"r{suffix}"
    if suffix == ".csv":
        lines = as_text(table, ",", ".").splitlines()
        path.write_text(f"{lines[0]},{name}\n" + "".join(f"{line},1\n" for line in lines[1:]))
    elif suffix == ".parquet":
        pq.write_table(pa.table([*table.values(), table["t"]], names=[*table, name]), path)
    else:
        import zipfile

        write(path, table)
        with pytest.warns(UserWarning), zipfile.ZipFile(path, "a") as archive:
            archive.writestr(f"{name}.npy", archive.read("t.npy"))
    return path


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".npz"])
def test_a_column_twice_is_named_if_it_is_needed(tmp_path, suffix):
    path = twice(tmp_path, suffix, "i_b")
    refused(path, "duplicate column i_b", ":1" if suffix == ".csv" else "")
    assert set(read_table(path, lambda names: ["t", "i_a"]).columns) == {"t", "i_a"}

    def lacking(names):
        raise RecordingError(f"{path}: no column i_z")

    with pytest.raises(RecordingError, match="no column i_z; the file has column i_b twice"):
        read_table(path, lacking)


def test_a_name_that_is_not_utf8(tmp_path, nominal):
    for content in (b"", b"prose\n", b"\x89PNG\r\n", as_text(made(20), ",", ".").replace("i_c", "i_b").encode()):
        path = tmp_path / os.fsdecode(b"r\xff\n.csv")
        path.write_bytes(content)
        with pytest.raises(RecordingError) as error:
            load_recording(path, nominal)
        message = str(error.value)
        assert message.isprintable() and message.encode() and message.count("udcff") == 1
    with pytest.raises(RecordingError, match="udcff"):
        read_table(tmp_path / os.fsdecode(b"none\xff.csv"))
