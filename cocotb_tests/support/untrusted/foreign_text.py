# SPDX-License-Identifier: BSD-3-Clause
"""Text that another language could take for its own: strings for property tests, names of files, parsers."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

# What ends, opens, joins or replaces something in one of the languages, alone and in the company that does it.
PIECES = (
    "\n", "\r", "\t", "\v", "\f", "\x00", "\x1b[2J", "\x7f", "\x85", "\x9b", "\xa0", "\xad", "\u2028", "\u202e",
    "\ufeff", "\ud83d", "\udcff", "\uffff", "\U0001f600", "é", "ﬁ", "ﾂ", "/", "*", "*/", "/*", "//", "\\", "\\\n",
    "\\u0041", "\\x41", "?", "??/", "??/\n", "{", "}", "[", "]", "[exit]", "$", "$argv0", '"', "'", '"""', "'''", ";",
    "#", "-", "--", "<", ">", "&", "&lt;", "</title>", "<script>", "-->", "]]>", "{{ x }}", "{% x %}", "=", ".", ",",
    " ", "pragma translate_off", "a", "1",
)  # fmt: skip
# Names of a drive file: what a stranger would write to have it run, and what breaks by chance.
NAMES = (
    "a\nexec touch ran\n#.toml", "a\rputs ran\r.toml", "a\vend package drive_pkg;\v.toml", "a\x85b.toml", "a??",
    "a} [exec touch ran] {.toml", '"; exec touch ran; ".toml', "$argv0 ${x.toml", "a\\", "a\\\n.toml", "*.toml",
    "<script>x<script>&amp;.toml", "$\\frac{a}$ é ж \U0001f600.toml", os.fsdecode(b"a\xff\xfe.toml"),
    "a\x1b[2J\u202e.toml", "pragma translate_off",
)  # fmt: skip
UNICODE_ESCAPE = re.compile(r"\\x([0-9a-f]{2})|\\u([0-9a-f]{4})|\\U([0-9a-f]{8})")


def unescaped(text: str) -> str:
    r"""The text whose unsafe characters were written as \xNN, \uNNNN and \UNNNNNNNN."""
    return UNICODE_ESCAPE.sub(lambda found: chr(int(found[1] or found[2] or found[3], 16)), text)


def tool(name: str) -> str:
    """The path of a program; skips where it is missing."""
    return shutil.which(name) or pytest.skip(f"there is no {name} here")


def tcl_calls(script: str, folder: Path) -> list[str]:
    """The arguments of every call of ``keep`` in a script of Tcl, in order."""
    keep = 'proc keep {word} {set codes {}\nforeach c [split $word {}] {lappend codes [scan $c %c]}\nputs "=$codes"}\n'
    path = folder / "script.tcl"
    path.write_bytes((keep + script).encode("ascii"))
    done = subprocess.run([tool("tclsh"), path], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stderr
    return ["".join(chr(int(code)) for code in line[1:].split()) for line in done.stdout.splitlines()]


def c_tokens(text: str, folder: Path) -> list[str]:
    """What a C compiler sees of a text: its lines without comments; a warning about a comment is an error."""
    path = folder / "text.c"
    path.write_bytes(text.encode("ascii"))
    command = [tool("cc"), "-E", "-P", "-undef", "-trigraphs", "-Wall", "-Werror", path]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def vhdl_analysed(text: str, folder: Path) -> None:
    """GHDL accepts a file, by the standard with and without comments of the form /* */."""
    path = folder / "text.vhd"
    path.write_bytes(text.encode("ascii"))
    for standard in ("93", "08"):
        command = [tool("ghdl"), "-a", f"--std={standard}", f"--workdir={folder}", path]
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
        assert done.returncode == 0, done.stderr


class Page(HTMLParser):
    """tags: all start tags with the names of their attributes; values: of attributes; text: of the whole page."""

    def __init__(self, html: str):
        super().__init__(convert_charrefs=True)
        self.tags, self.values, self.text = [], [], ""
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, [name for name, _ in attrs]))
        self.values += [value for _, value in attrs]

    def handle_data(self, data):
        self.text += data
