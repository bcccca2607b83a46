# SPDX-License-Identifier: BSD-3-Clause
"""The layout of a text table: separator, decimal mark, header, units, first line of numbers.

Every pair of separator and decimal mark is tested on the first lines; the one that gives the most numbers in lines
with the same number of fields is used; dates and clock times count as numbers.  "1,5;2,5" can only be two numbers with
a decimal comma, "1,5,2,5" only four, and with quotes, "1,5","2,5", two; the locale is not considered.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass

from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.readers.clock import MOMENT

SNIFF_BYTES = 1 << 18
SNIFF_LINES = 500
MOST_FIELDS = 20_000
COMMENT = ("#", "%", "//")
SEPARATORS = (";", "\t", ",", "|", " ")
MISSING = {"", "nan", "-nan", "inf", "-inf", "+inf", "na", "n/a", "null", "none", "-"}
NUMBER = {
    ".": re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eEdD][+-]?\d+)?", re.ASCII),
    ",": re.compile(r"[+-]?(\d+(,\d*)?|,\d+)([eE][+-]?\d+)?", re.ASCII),
}
UNIT_LINE = re.compile(
    r"[\[(]?\s*((s|ms|[uµ]s|A|mA|V|mV|rad|deg|°|rpm|1/min|min-1|rad/s|°C|degC|C|Nm|N[m·.]|%|1|-"
    r"|(?i:seconds?|volts?|amp(ere)?s?))\s*)?[\])]?"
)
LONGEST_UNIT = 8


@dataclass(frozen=True)
class Layout:
    """first: 0-based number of the first line with numbers; names, units: one entry per field."""

    encoding: str
    separator: str
    decimal: str
    first: int
    names: list[str]
    units: list[str]


def encoding_of(head: bytes) -> str:
    """UTF-16 and UTF-8 by their byte-order marks or their zero bytes, else UTF-8 if it decodes, else Windows-1252."""
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):  # first: without "utf-16" the mark is a part of the first name
        return "utf-16"
    if half := half_zero(head):
        return half
    if head.startswith(b"\xef\xbb\xbf"):
        return "utf-8-sig"
    try:
        head.decode("utf-8")
    except UnicodeDecodeError as error:
        if error.start < len(head) - 4:  # a character that is cut at the end of the head is no error
            return "cp1252"
    return "utf-8"


def half_zero(head: bytes) -> str:
    """ "utf-16-le" or "utf-16-be" if nearly every second byte is zero and no other, as in a table without a mark."""
    low, high = head[:-1:2], head[1::2]
    for half, other, name in ((high, low, "utf-16-le"), (low, high, "utf-16-be")):
        if len(half) > 2 and half.count(0) >= 0.9 * len(half) and not other.count(0):
            return name
    return ""


def sniff(path) -> Layout:
    """The layout of the file; RecordingError when no line of numbers is found."""
    with open(path, "rb") as file:
        head = file.read(SNIFF_BYTES)
    encoding = encoding_of(head)
    lines = head.decode(encoding, "replace").splitlines()
    if len(head) == SNIFF_BYTES:
        lines.pop()  # cut by the limit
        if not lines:
            found = _fields_in(head, encoding)
            raise RecordingError(f"{path}:1: no line end in the first {SNIFF_BYTES} bytes; {found}")
    lines = lines[:SNIFF_LINES]
    _reject_wide(path, lines)
    candidates = (_candidate(lines, separator, decimal) for separator in SEPARATORS for decimal in ".,")
    score, separator, decimal, first, width = max(candidates, key=lambda c: c[0])
    if score <= 0:
        json = "; JSON is not read: write a column for each signal" if head.lstrip()[:1] in (b"{", b"[") else ""
        raise RecordingError(f"{path}: no row of numbers in the first {len(lines)} lines; a table was expected{json}")
    names, units = _header(lines[:first], separator, width)
    above = _without_rest(split(lines[first - 1], separator), width) if first else []
    if names[0] == "1" and len(above) > 2 and all(above) and separator != " ":
        raise RecordingError(f"{path}:{first}: a header of {len(above)} names above rows of {width} fields")
    return Layout(encoding, separator, decimal, first, _with_time(names, split(lines[first], separator)), units)


def _with_time(names, values) -> list[str]:
    """The names, with "t" for a column of dates without one beside named ones, as of an index that was exported."""
    unnamed = [k for k, name in enumerate(names) if name == str(k + 1) and MOMENT.fullmatch(values[k])]
    header = any(name != str(k + 1) for k, name in enumerate(names))
    if header and len(unnamed) == 1 and not {"t", "time", "timestamp"} & {n.lower() for n in names}:
        names[unnamed[0]] = "t"
    return names


def _fields_in(head: bytes, encoding: str) -> str:
    """How many columns a first line without an end has at least."""
    text = head.decode(encoding, "replace")
    most = max(text.count(separator) for separator in SEPARATORS)
    if not most:
        return "rows of numbers expected"
    return f"more than {most} columns in it; at most {MOST_FIELDS} columns are read"


def _reject_wide(path, lines) -> None:
    """RecordingError if a line has more fields than the limit."""
    for k, line in enumerate(lines):
        fields = 1 + max(line.count(separator) for separator in SEPARATORS)
        if fields > MOST_FIELDS:
            raise RecordingError(f"{path}:{k + 1}: {fields} columns; at most {MOST_FIELDS} are read")


def _candidate(lines, separator, decimal):
    """(score, separator, decimal, first line, fields) under one assumption; a word costs two numbers."""
    scores, first = Counter(), {}
    for k, line in enumerate(lines):
        if (separator == decimal and '"' not in line) or not line.strip() or line.lstrip().startswith(COMMENT):
            continue
        fields = split(line, separator)
        numbers = sum(bool(NUMBER[decimal].fullmatch(f) or MOMENT.fullmatch(f)) for f in fields)
        words = len(fields) - numbers - sum(f.lower() in MISSING for f in fields)
        if numbers > words:
            scores[len(fields)] += numbers - 2 * words
            first.setdefault(len(fields), k)
        elif not numbers and words == len(fields) > 1 and first.get(words) == k - 1:
            del first[words]  # "x-axis,1,2" above a line of units names channels
    width, score = scores.most_common(1)[0] if scores else (0, 0)
    return score, separator, decimal, first.get(width, 0), width


def split(line: str, separator: str) -> list[str]:
    """The fields of one line."""
    if separator == " ":
        return line.split()
    return [f.strip() for f in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def _header(lines, separator, width):
    """(names, units) from the lines above the numbers; "1", "2", ... without a header."""
    rows = []
    for line in reversed(lines):
        fields = split(line.strip().lstrip("#%/").strip() if line.lstrip().startswith(COMMENT) else line, separator)
        fields = _without_rest(fields, width)
        if len(fields) == width - 1 and separator != " ":
            fields.append("")  # rows that end in a separator
        if len(fields) == width and any(fields):
            rows.append(fields)
        if len(rows) == 2:
            break
    names, units = [str(k + 1) for k in range(width)], [""] * width
    if len(rows) == 2 and _are_units(*rows):
        units, names = [f.strip("[]() ") for f in rows[0]], rows[1]
    elif rows:
        names = rows[0]
    return [name or str(k + 1) for k, name in enumerate(names)], units


def _without_rest(fields, width) -> list[str]:
    """The fields of a header without what no row has: an empty last one, or LabVIEW's comment."""
    return fields[:width] if all(f.lower() in ("", "comment") for f in fields[width:]) else fields


def _are_units(fields, above) -> bool:
    """Whether a line under a header is one of units: all are usual ones, or some repeat under names that do not."""
    stated = [f for f in fields if f]
    repeat = len(set(stated)) < len(stated) and len(set(above)) == len(above) and all(above)
    return all(UNIT_LINE.fullmatch(f) for f in fields) or (repeat and all(len(f) <= LONGEST_UNIT for f in fields))
