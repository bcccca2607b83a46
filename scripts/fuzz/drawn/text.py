# SPDX-License-Identifier: BSD-3-Clause
"""Hostile text: names, cells, tables, encodings."""

from __future__ import annotations

import re

from hypothesis import strategies as st

from scripts.fuzz.case import Case

CORNERS = (
    "0", "-0", "-1", "1", "2147483648", "9223372036854775808", "1e308", "-1e308", "1e309", "5e-324", "nan", "inf",
    "-inf", "1e-300", "1e300", "0x10", "1_000", "1,5", "1.234.567", "٣", "1" * 400, "", " ", "-", "NA", "true",
    "null", "2026-01-01T00:00:00", "24:61:61", "99999-99-99", "12:00:00.5", "1.1.2026 10:00:00", "9999-12-31 23:59:59",
)  # fmt: skip
STRANGE = (
    "\n", "\r\n", "\0", "\t", '"', '""', "'", "\\", "{", "}", "[", "]", "$x", "[exit]", ";", "*/", "--", "#",
    "%", "//", "\x1b[31m", "\u202e", "\u2028", "\ufeff", "\u0085", "é", "日本", "\U0001f600", "ß", "../",
    "/dev/zero", "file:///etc/passwd", "=1+1", "<script>", "{{7*7}}", "%s%n", "__import__('os').system('true')",
    "a" * 300,
)  # fmt: skip
ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "cp1252", "latin-1", "cp037", "utf-7")

words = st.one_of(st.sampled_from(STRANGE), st.sampled_from(CORNERS), st.text(max_size=12))
names = st.lists(words, min_size=1, max_size=3).map("".join)


@st.composite
def encoded(draw, text: str) -> bytes:
    """The text in an encoding, mostly UTF-8."""
    encoding = draw(st.sampled_from(("utf-8",) * 6 + ENCODINGS))
    return text.encode(encoding, "surrogatepass" if encoding.startswith("utf-") and encoding != "utf-7" else "replace")


@st.composite
def damaged_table(draw, corpus: tuple[Case, ...]) -> Case:
    """A text table in which cells, lines or separators are others."""
    suffix, content = draw(st.sampled_from(corpus))
    lines = content.decode().splitlines()
    separator = next(s for s in (";", "\t", ",") if s in lines[0])
    for _ in range(draw(st.integers(0, 6))):
        at = draw(st.integers(0, max(0, len(lines) - 1)))
        kind = draw(st.sampled_from(("cell", "column", "line", "again", "out", "separator", "widen")))
        if not lines:
            break
        cells = lines[at].split(separator)
        if kind == "cell":
            cells[draw(st.integers(0, len(cells) - 1))] = draw(words)
            lines[at] = separator.join(cells)
        elif kind == "column":
            column, word = draw(st.integers(0, 9)), draw(words)
            lines[1:] = [_with(line, separator, column, word) for line in lines[1:]]
        elif kind == "line":
            lines.insert(at, draw(names))
        elif kind == "again":
            lines.insert(at, lines[draw(st.integers(0, len(lines) - 1))])
        elif kind == "out":
            del lines[at]
        elif kind == "separator":
            lines[at] = lines[at].replace(separator, draw(words))
        else:
            lines[at] = separator.join(cells * draw(st.sampled_from((2, 10, 400))))
    end = draw(st.sampled_from(("\n", "\r\n", "\r", "\n\n", "")))
    return Case(suffix, draw(encoded(end.join(lines) + end)))


def _with(line: str, separator: str, column: int, word: str) -> str:
    cells = line.split(separator)
    cells[column % len(cells)] = word
    return separator.join(cells)


@st.composite
def damaged_text(draw, corpus: tuple[bytes, ...]) -> str:
    """A text in which words and numbers are replaced by others."""
    text = draw(st.sampled_from(corpus)).decode()
    for _ in range(draw(st.integers(0, 4))):
        places = [m.span() for m in re.finditer(r"[\w.+-]+|\S", text)] or [(0, 0)]
        start, stop = places[draw(st.integers(0, len(places) - 1))]
        text = text[:start] + draw(words) + text[stop:]
    return text
