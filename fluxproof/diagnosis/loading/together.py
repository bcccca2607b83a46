# SPDX-License-Identifier: BSD-3-Clause
"""Files with matrices over the same axes, such as one file for u_d and one for u_q, are one recording."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from fluxproof.diagnosis.ground.limits import head_of
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers import matrices


def together(items) -> list[list]:
    """The recordings of a command, each with the files of matrices that belong to it; others stand alone.

    Files that have a quantity in common are two recordings of one drive and stay apart.
    """
    groups: list[list] = []
    held: list[Any] = []  # of each group: (axes, names of the quantities), None if it holds no matrices
    for item in items:
        found = _matrices(item)
        fits = [k for k, of in enumerate(held) if found and of and of[0] == found[0] and not of[1] & found[1]]
        if found and fits:
            groups[fits[0]].append(item)
            held[fits[0]] = found[0], held[fits[0]][1] | found[1]
        else:
            groups.append([item])
            held.append(found)
    return groups


def _matrices(item):
    """(axes, quantities) of a file with matrices; None for any other, whose reader says what is wrong."""
    try:
        if not isinstance(item, (str, os.PathLike)) or not matrices.matches(head_of(item), Path(item)):
            return None
        return matrices.axes_and_quantities(item)
    except RecordingError:
        return None
