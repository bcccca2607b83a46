# SPDX-License-Identifier: BSD-3-Clause
"""Damage to valid files: bytes changed, left out, repeated; corner values in place of numbers; two files joined."""

from __future__ import annotations

import io
import struct
import zipfile

from hypothesis import strategies as st

from scripts.fuzz.case import Case

NUMBERS = [
    struct.pack(order + code, value)
    for order in "<>"
    for code, values in {
        "H": (0xFFFF, 0x8000),
        "I": (0xFFFFFFFF, 0x80000000, 0x7FFFFFFF, 0x10000, 0),
        "Q": (2**64 - 1, 2**63, 2**63 - 1, 2**40, 2**32, 0, 1),
        "d": (float("nan"), float("inf"), -1e308, 1e308, 5e-324),
    }.items()
    for value in values
]


@st.composite
def edits(draw, length: int):
    """One change: (bytes to keep before, bytes to leave out, bytes to put there or None to repeat 64)."""
    at = draw(st.integers(0, max(0, length - 1)))
    kind = draw(st.sampled_from(("number", "bytes", "cut", "repeat", "end")))
    if kind == "number":
        value = draw(st.sampled_from(NUMBERS))
        return at, len(value), value
    if kind == "bytes":
        value = draw(st.binary(min_size=1, max_size=8))
        return at, draw(st.sampled_from((len(value), 0))), value
    size = draw(st.integers(1, 64))
    return at, {"cut": size, "repeat": 0, "end": length}[kind], None if kind == "repeat" else b""


def apply(content: bytes, edit) -> bytes:
    at, out, put = edit
    put = content[at : at + 64] if put is None else put
    return content[:at] + put + content[at + out :]


@st.composite
def damaged(draw, corpus: tuple[Case, ...]) -> Case:
    """A file of the corpus with up to five changes, rarely with the end of another one."""
    suffix, content = draw(st.sampled_from(corpus))
    if suffix == ".npz" and draw(st.booleans()):
        return Case(suffix, draw(_inside_archive(content)))
    for _ in range(draw(st.integers(0, 5))):
        content = apply(content, draw(edits(len(content))))
    if draw(st.integers(0, 19)) == 19:
        other = draw(st.sampled_from(corpus)).content
        content = content[: draw(st.integers(0, len(content)))] + other[draw(st.integers(0, len(other))) :]
    return Case(suffix, content)


@st.composite
def _inside_archive(draw, content: bytes) -> bytes:
    """A zip file whose first member is damaged, with the right checksum."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    first = next(iter(members))
    for _ in range(draw(st.integers(1, 4))):
        members[first] = apply(members[first], draw(edits(len(members[first]))))
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", draw(st.sampled_from((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)))) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return stream.getvalue()
