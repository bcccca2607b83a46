# SPDX-License-Identifier: BSD-3-Clause
"""Parquet, NumPy and MATLAB files with odd types, names, lengths and declared sizes, written by their own libraries."""

from __future__ import annotations

import functools
import io
import struct
import warnings
import zipfile

import numpy as np
from hypothesis import strategies as st

from scripts.fuzz.case import Case
from scripts.fuzz.corpus import motor
from scripts.fuzz.drawn.text import names

USUAL = ("t", "i_a", "i_b", "i_c", "theta_e", "u_dc", "d_a", "d_b", "d_c")
PARTS = ("Name", "Data", "X", "signals", "label", "values", "unit")
columns = st.one_of(st.sampled_from(USUAL), names)


def hostile():
    return st.one_of(parquet(), parquet(), npy(), npz(), mat(), st.sampled_from((1, 10, 30)).map(packed))


@functools.cache
def packed(millions: int) -> Case:
    """A Parquet file of so many million equal rows, which pack to a few kilobytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table, stream = pa.table({name: np.ones(1_000_000) for name in ("t", "i_a")}), io.BytesIO()
    with pq.ParquetWriter(stream, table.schema) as writer:
        for _ in range(millions):
            writer.write_table(table)
    return Case(".parquet", stream.getvalue())


@st.composite
def parquet(draw) -> Case:
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = draw(st.sampled_from((24, 24, 24, 0, 1, 100_000)))
    kinds = {
        "double": lambda: pa.array(np.resize(motor(24)["i_a"], rows)),
        "half": lambda: pa.array(np.zeros(rows, np.float16)),
        "bool": lambda: pa.array(np.zeros(rows, bool)),
        "big": lambda: pa.array(np.full(rows, 2**64 - 1, np.uint64)),
        "null": lambda: pa.nulls(rows),
        "nulls": lambda: pa.nulls(rows, pa.float64()),
        "text": lambda: pa.array(["x"] * min(rows, 1000) + [""] * max(0, rows - 1000)),
        "stamp": lambda: pa.array(np.arange(rows), pa.int64()).cast(pa.timestamp("ns", tz)),
        "late": lambda: pa.array(np.full(rows, 2**62), pa.int64()).cast(pa.timestamp("s")),
        "duration": lambda: pa.array(np.arange(rows), pa.int64()).cast(pa.duration("us")),
        "decimal": lambda: pa.array(np.arange(rows), pa.int64()).cast(pa.decimal128(38, 10)),
        "list": lambda: pa.array([[1.0]] * min(rows, 24) + [None] * max(0, rows - 24)),
        "dictionary": lambda: pa.array(np.zeros(rows)).dictionary_encode(),
        "date": lambda: pa.array(np.zeros(rows, np.int32)).cast(pa.date32()),
    }
    tz = draw(st.sampled_from((None, "UTC", "Europe/Paris", "+05:30")))
    chosen = draw(st.lists(st.tuples(columns, st.sampled_from(sorted(kinds)), names), min_size=1, max_size=10))
    arrays = [kinds[kind]() for _, kind, _ in chosen]
    fields = [
        pa.field(name, array.type, metadata={"unit": unit.encode("utf-8", "replace")})
        for (name, _, unit), array in zip(chosen, arrays, strict=True)
    ]
    stream = io.BytesIO()
    try:
        pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), stream, compression="zstd")
    except (pa.ArrowException, ValueError):
        return Case(".parquet", b"PAR1PAR1")
    return Case(".parquet", stream.getvalue())


HEADERS = st.fixed_dictionaries(
    {
        "descr": st.sampled_from(
            ("<f8", "|O", "<f8, <i4", [("t", "<f8"), ("i_a", "<f8")], "|V8", "<U4", "<M8[ns]", "|S0", "x")
        ),
        "order": st.sampled_from((False, True, "no")),
        "shape": st.sampled_from(
            ((24,), (24, 3), (3, 24), (), (0,), (10**12,), (2**62, 4), (-1,), (24, -3), "24", (1.5,), (24, 0), (True,))
        ),
    }
)


@st.composite
def npy_bytes(draw) -> bytes:
    """An array file whose header was written by hand."""
    how = draw(HEADERS)
    written = repr({"descr": how["descr"], "fortran_order": how["order"], "shape": how["shape"]})
    odd = ("{}", "__import__('os').system('true')", "[" * 500, "{'descr': open('canary', 'w')}", "9**9**9", written * 3)
    header = draw(st.sampled_from((written,) * 8 + odd)).encode("latin-1")
    version = draw(st.sampled_from((b"\x01\x00", b"\x01\x00", b"\x02\x00", b"\x03\x00", b"\x09\x00")))
    length = struct.pack("<H" if version[0] == 1 else "<I", len(header) + draw(st.sampled_from((0, 0, 0, 1, 60_000))))
    pickled = b"\x80\x04cposix\nsystem\n\x8c\x04true\x85R."
    body = draw(st.sampled_from((bytes(24 * 24), pickled, b"")))
    return b"\x93NUMPY" + version + length + header + body


@st.composite
def npy(draw) -> Case:
    return Case(".npy", draw(npy_bytes()))


@st.composite
def npz(draw) -> Case:
    """An archive of arrays and of what is none, with names that leave the folder, twice the same, or packed zeros."""
    stream = io.BytesIO()
    method = draw(st.sampled_from((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)))
    with zipfile.ZipFile(stream, "w", method) as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a name twice is meant
        for name in draw(st.lists(columns, min_size=1, max_size=4)):
            data = draw(st.one_of(st.just(_valid(24)), npy_bytes(), st.just(_valid(500_000)), st.binary(max_size=40)))
            member = (name.encode("utf-8", "replace").decode().replace("\0", "") or "x") + draw(
                st.sampled_from((".npy", ".npy", ".npy", "", "/"))
            )
            archive.writestr(member, data)
    return Case(".npz", stream.getvalue())


@functools.cache
def _valid(n: int) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.zeros(n))
    return stream.getvalue()


values = st.recursive(
    st.one_of(
        names, st.floats(), st.integers(-(2**31), 2**31), st.just(np.zeros(24)), st.just(np.zeros((24, 3))),
        st.just(np.zeros((2, 3, 4))), st.just(np.zeros(0)), st.just(np.array(["a", 1, None], object)),
        st.just(1j * np.ones(24)),
        st.just(motor(24)["i_a"]), st.just(np.zeros(24, np.uint8)), st.just(np.zeros(24, bool)),
    ),
    lambda inner: st.dictionaries(st.sampled_from((*USUAL, *PARTS)), inner, max_size=5),
    max_leaves=12,
)  # fmt: skip


@st.composite
def mat(draw) -> Case:
    from scipy.io import savemat

    content = draw(
        st.dictionaries(st.sampled_from((*USUAL, "run", "X", "Y", "_x", "logsout")), values, min_size=1, max_size=8)
    )
    stream = io.BytesIO()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # names and values that the library leaves out
            savemat(stream, content, do_compression=draw(st.booleans()), long_field_names=True, oned_as="column")
    except (ValueError, TypeError, UnicodeError, OverflowError, RecursionError):
        return Case(".mat", b"MATLAB 5.0 MAT-file".ljust(128))
    return Case(".mat", stream.getvalue())
