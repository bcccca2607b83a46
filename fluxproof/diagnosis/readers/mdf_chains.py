# SPDX-License-Identifier: BSD-3-Clause
"""The lists of groups and channels of an MDF file, followed before asammdf does (not itself a reader).

A list that leads back into itself would keep asammdf busy without an end.
"""

from __future__ import annotations

import struct
from typing import BinaryIO

from fluxproof.diagnosis.ground.recording import RecordingError

HEADER = 64  # address of the first block
FIRST = {b"HD": b"DG", b"DG": b"CG", b"CG": b"CN"}  # kind of block: of the list inside it
MOST_BLOCKS = 1_000_000


def check_chains(path) -> None:
    """RecordingError if a list of data groups, channel groups or channels leads to a block that was met before."""
    with open(path, "rb") as file:
        head = file.read(HEADER)
        newer = head[8:9] >= b"4"
        order = "<" if newer or head[24:26] == b"\0\0" else ">"
        links = _links4 if newer else _links3
        seen, left = set(), [(HEADER, b"HD")]
        while left:
            address, kind = left.pop()
            if address in seen or len(seen) > MOST_BLOCKS:
                name = kind.decode()
                raise RecordingError(f"{path}: its list of {name} blocks leads back to the block at byte {address}")
            seen.add(address)
            following, inside = links(file, address, kind, order)
            if following:
                left.append((following, kind))
            if inside:
                left.append((inside, FIRST.get(kind, kind)))


def _links4(file: BinaryIO, address: int, kind: bytes, order: str) -> tuple[int, int]:
    """(next block of the list, first block of the list inside) of MDF 4; 0 for none."""
    file.seek(address)
    head = file.read(40)
    if len(head) < 40 or head[:4] != b"##" + kind:  # damaged: asammdf ends there
        return 0, 0
    first, second = struct.unpack_from("<QQ", head, 24)
    return (0, first) if kind == b"HD" else (first, second)


def _links3(file: BinaryIO, address: int, kind: bytes, order: str) -> tuple[int, int]:
    """The same of MDF 2 and 3, where a channel has no channels inside it."""
    file.seek(address)
    head = file.read(12)
    if len(head) < 12 or head[:2] != kind:
        return 0, 0
    first, second = struct.unpack_from(f"{order}II", head, 4)
    if kind == b"HD":
        return 0, first
    return first, 0 if kind == b"CN" else second
