# SPDX-License-Identifier: BSD-3-Clause
"""MDF files with conversions of every type whose texts, numbers and tables are hostile, and with odd samples."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from scripts.fuzz.case import Case
from scripts.fuzz.corpus import motor
from scripts.fuzz.drawn.damage import apply, edits
from scripts.fuzz.drawn.text import names

CODE = (
    "X+1", "2*X", "X", "1/X", "X**9**9**9", "(X", "", "sin(X)", "X if X else 1", "9**9**9**9",
    "__import__('os').system('touch canary')", "().__class__.__base__.__subclasses__()", "open('canary','w')",
    "X+(lambda: __import__('os').system('touch canary'))()", "exec('import os')", "os.system('touch canary')",
    "where(X > 0, X, __import__('os').getpid())", "X.__class__", "X[0].__init__", "eval('1')", "X" * 5000,
    "(" * 300 + "X" + ")" * 300,
)  # fmt: skip
numbers = st.one_of(st.floats(), st.sampled_from((0.0, 1.0, -1.0, 1e308, 5e-324)))
formulas = st.one_of(st.sampled_from(CODE), names)
conversions = st.one_of(
    st.none(),
    st.fixed_dictionaries({"a": numbers, "b": numbers}),
    st.fixed_dictionaries({f"P{k}": numbers for k in range(1, 7)}),
    st.fixed_dictionaries({"formula": formulas}),
    st.fixed_dictionaries(
        {"raw_0": numbers, "phys_0": numbers, "raw_1": numbers, "phys_1": numbers, "default": numbers}
    ),
    st.fixed_dictionaries(
        {"raw_0": numbers, "phys_0": numbers, "raw_1": numbers, "phys_1": numbers, "interpolation": st.booleans()}
    ),
    st.fixed_dictionaries({"lower_0": numbers, "upper_0": numbers, "phys_0": numbers, "default": numbers}),
    st.fixed_dictionaries({"val_0": numbers, "text_0": formulas, "val_1": numbers, "text_1": names}),
    st.fixed_dictionaries({"lower_0": numbers, "upper_0": numbers, "text_0": formulas}),
    st.fixed_dictionaries({"input_0": names, "output_0": names, "default": names}),
)
DTYPES = ("f8", "f4", "i2", "u1", "u8", "S4", "i4")


@st.composite
def hostile(draw) -> Case:
    """A measurement with one or two groups, perhaps with bytes changed after it was written."""
    version = draw(st.sampled_from(("4.10", "4.10", "3.30", "4.00")))
    groups = draw(st.lists(st.lists(channel, min_size=1, max_size=4), min_size=1, max_size=2))
    content = written(version, groups)
    for _ in range(draw(st.integers(0, 2))):
        content = apply(content, draw(edits(len(content))))
    return Case(".mf4" if version >= "4" else ".mdf", content)


channel = st.fixed_dictionaries(
    {
        "name": st.one_of(st.sampled_from(("i_a", "i_b", "i_c", "theta_e", "d_a", "time")), names),
        "dtype": st.sampled_from(DTYPES),
        "rows": st.sampled_from((24, 24, 0, 1, 7)),
        "unit": st.one_of(st.just("A"), names),
        "comment": st.one_of(
            st.just(""), names, st.just("<!DOCTYPE a [<!ENTITY b SYSTEM 'file:///etc/passwd'>]><a>&b;</a>")
        ),
        "conversion": conversions,
    }
)


def written(version: str, groups) -> bytes:
    """The bytes of a file of these groups; a channel that the library refuses to write is left out."""
    from asammdf import MDF, Signal

    times = motor(24)["t"]
    with tempfile.TemporaryDirectory() as folder, MDF(version=version) as mdf:
        for channels in groups:
            for one in channels:
                try:
                    stamps = times[: one["rows"]]
                    values = np.arange(len(stamps)).astype(one["dtype"])
                    conversion = one["conversion"] and dict(one["conversion"])
                    more = {"unit": one["unit"], "comment": one["comment"], "conversion": conversion}
                    mdf.append([Signal(values, stamps, name=one["name"], **more)])
                except Exception:  # a library that does not write it makes no case
                    continue
        path = Path(folder, "r.mf4" if version >= "4" else "r.mdf")
        try:
            mdf.save(path, overwrite=True)
        except Exception:
            return io.BytesIO(b"MDF     4.10    ").getvalue()
        return path.read_bytes()
