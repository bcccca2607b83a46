# SPDX-License-Identifier: BSD-3-Clause
"""Text with matrices over two axes, such as voltages over speed and current, as a row for each of their points.

    u_q [V]
    omega_e [rad/s] \\ i_q [A] ;  -20 ;   0 ;  20
    100                       ; -1.2 ; 3.1 ; 7.3
    200                       ;  1.9 ; 6.0 ;

A line names the quantity; the corner names the axis that goes down and the one that goes across.  The matrices of a
file have the same axes.  A point with an empty cell is left out.  What is a matrix only in part is refused with its
line: a guess which axis is which would be wrong half of the time.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers import text
from fluxproof.diagnosis.readers.sniff import COMMENT, MISSING, NUMBER, SEPARATORS, SNIFF_BYTES, encoding_of, split
from fluxproof.diagnosis.readers.table import Table, chosen, repeated, shown
from fluxproof.quote import escaped

FORMAT = "text with matrices"
SUFFIXES = text.SUFFIXES
LIBRARIES = ()
LEAST_ACROSS = 2
LEAST_PLAIN = 3  # across, without a backslash in the corner: "x,1,2" names the channels of a scope
LONGEST_PLAIN = 256  # lines without a backslash: a longer one is a log under a title
CORNER = "'DOWN \\ ACROSS' was expected, such as 'omega_e [rad/s] \\ i_q [A]'"


@dataclass(frozen=True)
class _Matrix:
    """line: 1-based, of its first axis; name: "" where no line above tells; values: (down, across), NaN if empty."""

    line: int
    name: str
    corner: str
    across: np.ndarray
    down: np.ndarray
    values: np.ndarray


def matches(head: bytes, path) -> bool:
    """Text of at most SNIFF_BYTES with the first line of a matrix."""
    if not text.matches(head, path) or Path(path).stat().st_size > SNIFF_BYTES:
        return False
    lines, _ = _lines(path)
    return _layout(lines) is not None


def axes_and_quantities(path) -> tuple[tuple, frozenset[str]]:
    """What two files of one grid have in common, and what each adds to it."""
    matrices, _ = _all(path)
    first = matrices[0]
    return (first.corner, tuple(first.down), tuple(first.across)), frozenset(m.name for m in matrices)


def names_of(path) -> list[str]:
    """Axes and quantities; RecordingError where a matrix is half understood."""
    return _names(_all(path)[0])


def read(path, select=None, *beside) -> Table:
    """A row for each point of the axes at which every matrix has a value; beside: files with the same axes."""
    matrices, notes = _all(path)
    for other in beside:
        more, said = _all(other)
        matrices, notes = [*matrices, *more], [*notes, *said, f"its matrices continue in {escaped(other)}"]
    names, shape = _names(matrices), matrices[0].values.shape
    wanted = chosen(dict.fromkeys(names, ""), select, path, repeated(names), f":{matrices[0].line}")
    axes = [np.broadcast_to(matrices[0].down[:, None], shape), np.broadcast_to(matrices[0].across, shape)]
    columns = {name: np.ravel(a) for name, a in zip(names, [*axes, *(m.values for m in matrices)], strict=True)}
    columns = {name: columns[name] for name in wanted}
    whole = np.all([np.isfinite(a) for a in columns.values()], axis=0)
    if not whole.any():
        raise RecordingError(f"{path}: no point of the axes has a value in every matrix")
    if not whole.all():
        notes.append(f"{np.count_nonzero(~whole)} of {whole.size} points have an empty cell and are left out")
    lines = matrices[0].line + 1 + np.repeat(np.arange(shape[0]), shape[1])
    return Table({name: a[whole] for name, a in columns.items()}, lines=lines[whole], notes=notes)


def _names(matrices) -> list[str]:
    """The axis that goes down, the one that goes across, the quantities."""
    return [*map(str.strip, matrices[0].corner.split("\\")), *(m.name for m in matrices)]


def _all(path) -> tuple[list[_Matrix], list[str]]:
    """(the matrices of a file, notes); RecordingError names the line of what is no complete matrix."""
    lines, whole = _lines(path)
    layout = _layout(lines)
    assert layout is not None  # as matches() found it
    matrices = list(_matrices(path, lines, *layout))
    first = matrices[0]
    for m in matrices:
        where = f"{path}:{m.line}: a matrix"
        if [bool(part.strip()) for part in m.corner.split("\\")] != [True, True]:
            raise RecordingError(f"{where} whose corner {shown(m.corner)!r} does not name both axes; {CORNER}")
        if not m.name:
            raise RecordingError(f"{where} without a line above that names its quantity, such as 'u_q [V]'")
        same = m.values.shape == first.values.shape and np.allclose(m.across, first.across)
        if not same or not np.allclose(m.down, first.down) or m.corner != first.corner:
            raise RecordingError(
                f"{where} of {shown(m.name)!r} over other axes than {shown(first.name)!r} in line {first.line}; "
                f"the same axes were expected: write a file for each pair of axes"
            )
    if whole:
        return matrices, []
    matrices[-1].values[-1] = np.nan
    return matrices, ["the file does not end with a line end; the last row may be truncated and is ignored"]


def _lines(path) -> tuple[list[str], bool]:
    """(lines of a text file, whether it ends with a line end)."""
    raw = Path(path).read_bytes()
    content = raw.decode(encoding_of(raw[:SNIFF_BYTES]), "replace").lstrip("\ufeff")
    return content.splitlines(), content.endswith(("\n", "\r"))


def _layout(lines) -> tuple[str, str] | None:
    """(separator, decimal mark) with which most cells of matrices are numbers; None if there is no matrix."""
    starts = [k for k, line in enumerate(lines) if re.match(r"[^\d.+-]", line.lstrip() or "0")]
    best, most = None, 0
    for separator in SEPARATORS[:-1]:  # a space separates the words of the corner
        for decimal in ".,":
            if separator != decimal and any(_starts(lines, k, separator, decimal) for k in starts):
                cells = [f for line in lines for f in split(line, separator)]
                count = sum(bool(NUMBER[decimal].fullmatch(f)) for f in cells)
                best, most = ((separator, decimal), count) if count > most else (best, most)
    return best


def _starts(lines, k: int, separator, decimal) -> bool:
    """Whether the first axis of a matrix stands in line k: a word and numbers, and below it a row of numbers.

    Without a backslash in the corner the line above must be a title, and what follows short.
    """
    if k + 1 >= len(lines):
        return False
    corner, *across = _cells(lines[k], separator)
    number = NUMBER[decimal]
    if number.fullmatch(corner) or len(across) < LEAST_ACROSS or not all(map(number.fullmatch, across)):
        return False
    first, *below = split(lines[k + 1], separator) or [""]
    good = sum(f.lower() in MISSING or bool(number.fullmatch(f)) for f in below)
    if not number.fullmatch(first) or 2 * good <= len(below):  # a word in a cell is told with its line
        return False
    if "\\" in corner:
        return True
    below = lines[k : k + LONGEST_PLAIN + 1]
    short = len(below) <= LONGEST_PLAIN or not all(map(str.strip, below))
    return short and len(across) >= LEAST_PLAIN and bool(_title(lines, k, separator))


def _title(lines, k: int, separator) -> str:
    """The single words in the last line above line k that is not empty; "" if there is none."""
    above = next((line for line in reversed(lines[:k]) if "".join(split(line, separator))), "")
    if above.lstrip().startswith(COMMENT):
        above = above.lstrip().lstrip("#%/")
    name, *others = _cells(above, separator)
    return name if not others and not any(n.fullmatch(name) for n in NUMBER.values()) else ""


def _cells(line: str, separator) -> list[str]:
    """The fields of a line without the empty ones at its end; at least one."""
    fields = split(line, separator) or [""]
    while len(fields) > 1 and not fields[-1]:
        fields.pop()
    return fields


def _matrices(path, lines, separator, decimal):
    """Every matrix of the file; RecordingError for a row of another width, a word in a cell, numbers outside."""
    k = 0
    while k < len(lines):
        fields = split(lines[k], separator)
        if not _starts(lines, k, separator, decimal):
            if fields and NUMBER[decimal].fullmatch(fields[0]):
                raise RecordingError(
                    f"{path}:{k + 1}: a row of numbers outside a matrix; a line of its axis was expected"
                )
            k += 1
            continue
        corner, *across = _cells(lines[k], separator)
        first, rows = k, []
        while (k := k + 1) < len(lines) and NUMBER[decimal].fullmatch((split(lines[k], separator) or [""])[0]):
            rows.append(_row(path, k + 1, split(lines[k], separator), len(across) + 1, decimal))
        table = np.array(rows)
        axis = np.array([_number(f, decimal) for f in across])
        yield _Matrix(first + 1, _title(lines, first, separator), corner, axis, table[:, 0], table[:, 1:])


def _row(path, line: int, fields, width: int, decimal) -> list[float]:
    """The numbers of one row, NaN where a cell is empty."""
    if any(fields[width:]) or len(fields) > width + 1:
        raise RecordingError(f"{path}:{line}: {len(fields)} fields; {width} expected as in the axis above")
    fields = (fields + [""] * width)[:width]
    for k, found in enumerate(fields):
        if found.lower() not in MISSING and not NUMBER[decimal].fullmatch(found):
            raise RecordingError(f"{path}:{line}: field {k + 1}: {shown(found, 30)!r} is not a number")
    return [_number(f, decimal) for f in fields]


def _number(found: str, decimal) -> float:
    """A cell's number; NaN if it is empty."""
    if found.lower() in MISSING:
        return np.nan
    return float(found.replace(decimal, ".").lower().replace("d", "e"))
