# SPDX-License-Identifier: BSD-3-Clause
"""Refuses a TOML text whose keys have too many parts: the parser's time grows with the square of their number."""

import re

MOST_PARTS = 32
# Strings and comments; one without its end reaches to the end of the line or text, so that nothing is read twice.
QUOTED = re.compile(
    r'"""(?:[^\\]|\\.)*?(?:"""|\\?\Z)'
    r"|'''.*?(?:'''|\Z)"
    r'|"(?:[^"\\\n]|\\[^\n])*(?:["\n]|\\?(?=\n|\Z))'
    r"|'[^'\n]*(?:['\n]|\Z)"
    r"|#[^\n]*",
    re.DOTALL,
)
LONG_KEY = re.compile(rf"(?:\.[ \t]*[\w-]+[ \t]*){{{MOST_PARTS}}}")


def check_keys(text: str) -> None:
    """ValueError, with the place as tomllib gives it, where a dotted key has more than MOST_PARTS parts."""
    bare = QUOTED.sub(_bare, text)
    found = LONG_KEY.search(bare)
    if found:
        line = bare.count("\n", 0, found.start()) + 1
        column = found.start() - bare.rfind("\n", 0, found.start())
        raise ValueError(f"A key has more than {MOST_PARTS} parts (at line {line}, column {column})")


def _bare(found: re.Match) -> str:
    """A letter instead of a string, nothing instead of a comment; lines keep their numbers."""
    return ("" if found[0][0] == "#" else "s") + "\n" * found[0].count("\n")
