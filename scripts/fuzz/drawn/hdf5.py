# SPDX-License-Identifier: BSD-3-Clause
"""HDF5 files that h5py writes without a complaint: odd types and shapes, declared sizes, links, attributes, nesting."""

from __future__ import annotations

import io

import numpy as np
from hypothesis import strategies as st

from scripts.fuzz.case import Case
from scripts.fuzz.corpus import motor
from scripts.fuzz.drawn.text import names

USUAL = ("t", "i_a", "i_b", "i_c", "theta_e", "u_dc", "d_a", "d_b", "d_c", "time")
DTYPES = ("f8", "f4", "f2", "i1", "u8", "i8", "?", "c16", "S5", "V3", ">f8", "O", "f8,i4", "(3,)f8", "(2,2)i4")
SHAPES = ((24,), (24, 1), (1, 24), (24, 3), (3, 24), (0,), (), (24, 65), (2, 3, 4), (1,), (10_000,))
HUGE = ((10**13,), (10**9, 10**9), (2**62,), (10**7, 3), (3 * 10**7,))
KINDS = (
    "plain",
    "plain",
    "plain",
    "odd",
    "huge",
    "filled",
    "external",
    "soft",
    "outside",
    "deep",
    "wide",
    "virtual",
    "cycle",
)


@st.composite
def hostile(draw) -> Case:
    """A file of some columns and some strange entries, perhaps as a version 7.3 MATLAB file."""
    entries = draw(st.lists(st.tuples(st.sampled_from(KINDS), places, details), min_size=1, max_size=6))
    matlab = draw(st.booleans())
    latest = draw(st.booleans())
    content = written(entries, "latest" if latest else "earliest", 512 if matlab else 0)
    if matlab:
        content = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM" + content[128:]
    return Case(".mat" if matlab else ".h5", content)


places = st.one_of(st.sampled_from(USUAL), names.map(lambda s: s.replace("\0", "") or "x"))
attributes = st.one_of(names, st.integers(-(2**63), 2**63 - 1), st.floats(), st.binary(max_size=9), st.just(None))
details = st.fixed_dictionaries(
    {
        "dtype": st.sampled_from(DTYPES),
        "shape": st.sampled_from(SHAPES),
        "huge": st.sampled_from(HUGE),
        "count": st.sampled_from((1, 3, 40, 400)),
        "key": st.sampled_from(
            ("unit", "MATLAB_class", "MATLAB_empty", "MATLAB_int_decode", "MATLAB_fields", "H5PATH")
        ),
        "value": attributes,
        "group": st.sampled_from(("", "run/", "a/b/", "#refs#/")),
    }
)


def written(entries, libver: str, userblock: int) -> bytes:
    """The bytes of a file of these entries; what the library itself refuses to write is left out."""
    import h5py

    stream, columns = io.BytesIO(), motor(24)
    with h5py.File(stream, "w", libver=libver, userblock_size=userblock) as file:
        for kind, name, how in entries:
            try:
                _add(file, kind, how["group"] + name, how, columns.get(name, columns["t"]), h5py)
            except (ValueError, TypeError, OSError, RuntimeError, KeyError, OverflowError, AttributeError):
                continue
    return stream.getvalue()


def _add(file, kind, name, how, values, h5py) -> None:
    shape, huge, count = how["shape"], how["huge"], how["count"]
    if kind == "plain":
        _attributed(file.create_dataset(name, data=values), how)
    elif kind == "odd":
        dtype = h5py.string_dtype() if how["dtype"] == "O" else np.dtype(how["dtype"])
        _attributed(file.create_dataset(name, shape, dtype), how)
    elif kind == "huge":  # no cell is stored
        chunks = tuple(min(s, 1 << (20 // len(huge))) for s in huge)
        _attributed(file.create_dataset(name, huge, "f8", chunks=chunks, compression="gzip", fillvalue=1.5), how)
    elif kind == "filled":  # one chunk of zeros that packs to a thousandth
        data = np.zeros(500_000)
        _attributed(file.create_dataset(name, data=data, chunks=data.shape, compression="gzip"), how)
    elif kind == "external":
        file.create_dataset(name, (64,), "f8", external=[("canary.bin", 0, 512)])
    elif kind == "virtual":
        layout = h5py.VirtualLayout((64,), "f8")
        layout[:] = h5py.VirtualSource("canary.h5", "canary", (64,))
        file.create_virtual_dataset(name, layout)
    elif kind == "soft":
        file[name] = h5py.SoftLink("/" + name if count == 1 else "/i_a")
    elif kind == "outside":
        file[name] = h5py.ExternalLink("canary.h5", "canary")
    elif kind == "cycle":
        file.require_group("loop")["again"] = file["/"]
    elif kind == "deep":
        group = file.require_group(name)
        for _ in range(count):
            group = group.create_group("g")
        group["t"] = values
    else:
        group = file.require_group(name)
        for k in range(count):
            group.create_dataset(f"c{k}", data=values)


def _attributed(item, how) -> None:
    if how["value"] is not None:
        item.attrs[how["key"]] = how["value"]
