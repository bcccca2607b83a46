# SPDX-License-Identifier: BSD-3-Clause
r"""Text from a user or a file, written into another language: one function for each language and position.

Each makes text that the language reads back as the same string, or raises DriveError with the character that it cannot
hold.  In a comment, a page and a label the same means that a reader sees the same: a character that could end the
comment, or that nobody sees, is written as \xNN, \uNNNN or \UNNNNNNNN.
"""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING, TextIO

from golden_model.drive_keys import DriveError

if TYPE_CHECKING:
    import jinja2

# Control characters except tab and newline, line separators, marks that turn the direction of writing, surrogates.
UNSEEN = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
# What could end a comment, join it to the next line or open another.  Letters beyond ASCII are among them, as a tool
# with another encoding may take a byte of one for a backslash, or join one with the line end (Tcl in Vivado).
UNSAFE = re.compile(r"[^ -~]|[\\{}]|(?<=\*)/|(?<=/)\*|\?(?=\?)")
# The first word of a comment that synthesis and simulation of VHDL obey.
DIRECTIVE = re.compile(r"(?:psl|pragma|rtl_synthesis|synopsys|synthesis|translate|vhdl_comp|xilinx)", re.IGNORECASE)
MOST_SHOWN = 60


def visible(text: object) -> str:
    """The text on paper: what nobody sees, or what turns the text around it, as an escape."""
    return UNSEEN.sub(_escape, str(text))


def escaped(text: object) -> str:
    """The text with what a terminal or UTF-8 cannot show as escapes: line ends, controls, lone surrogates."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text))


def shown(text: object, most: int = MOST_SHOWN) -> str:
    """A name from a file as short printable text, safe for a terminal."""
    text = escaped(text)
    return text if len(text) <= most else f"{text[: most - 3]}..."


def printable(text: str, encoding: str | None) -> str:
    """One line of a terminal: control characters from a file become spaces, letters outside the encoding escapes."""
    one = "".join(c if c.isprintable() else " " for c in text)
    return one.encode(encoding or "utf-8", "backslashreplace").decode(encoding or "utf-8")


def say(text: str, stream: TextIO | None = None) -> None:
    """Print one line at once, on stdout or on ``stream``."""
    out = sys.stdout if stream is None else stream
    put(printable(text, out.encoding), out)


def put(text: str, stream: TextIO | None = None) -> None:
    """Print text of several lines as it is; OSError names the stream."""
    out = stream or sys.stdout
    try:
        print(text, file=out, flush=True)
    except OSError as error:
        error.filename = "standard error" if out is sys.stderr else "standard output"
        raise


def tcl_word(text: str) -> str:
    """One word of a Tcl command, also inside braces and in every encoding of a script.

    DriveError for a character beyond U+FFFF, which Vivado's Tcl 8.5 cannot hold, and for a surrogate.
    """
    for c in text:
        if c > "\uffff" or "\ud800" <= c <= "\udfff":
            raise DriveError(f"{shown(text)}: the character U+{ord(c):04X} cannot be written into a script of Tcl")
    return '"' + re.sub(r'[^ -~]|[\\$"\[\]{}]', lambda c: _tcl_escape(c[0]), text) + '"'


def tcl_comment(text: str) -> str:
    """A comment of Tcl or XDC, a line without its end."""
    return f"# {_comment(text)}".rstrip()


def vhdl_comment(text: str) -> str:
    """A comment of VHDL, a line without its end; no order to a tool, whatever its first word."""
    inside = _comment(text).strip()
    return f"-- {_escape(inside[0]) + inside[1:] if DIRECTIVE.match(inside) else inside}".rstrip()


def c_comment(*lines: str) -> str:
    """A comment of C or of a device tree, of one or more lines."""
    if len(lines) == 1:
        return f"/* {_comment(lines[0])} */"
    inside = "\n".join(f" * {_comment(line)}".rstrip() for line in lines)
    return f"/*{inside[2:]}\n */"


def toml_key(text: str) -> str:
    """A key as it is to be given to tomlkit, which quotes it; DriveError for a surrogate, which TOML cannot hold."""
    found = re.search("[\ud800-\udfff]", text)
    if found:
        raise DriveError(f"{shown(text)}: the character U+{ord(found[0]):04X} cannot be written into a TOML file")
    return text


def toml_comment(text: str) -> str:
    """The text of a comment of TOML, for tomlkit: one line."""
    return visible(text).replace("\n", r"\x0a")


def mathtext(text: str) -> str:
    """A label of matplotlib, in which a dollar is a dollar and opens no formula."""
    return text.replace("$", r"\$")


def pages(*folders) -> jinja2.Environment:
    """The templates of the folders as HTML: every value is escaped, what nobody sees is shown."""
    import jinja2

    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.FileSystemLoader(folder) for folder in folders]),
        autoescape=True,
        finalize=lambda value: visible(value) if type(value) is str else value,
        trim_blocks=True,
        undefined=jinja2.StrictUndefined,
    )


def _comment(text: str) -> str:
    return UNSAFE.sub(_escape, text)


def _escape(found: re.Match | str) -> str:
    n = ord(found if isinstance(found, str) else found[0])
    return f"\\x{n:02x}" if n < 0x100 else f"\\u{n:04x}" if n < 0x10000 else f"\\U{n:08x}"


def _tcl_escape(c: str) -> str:
    r"""\uNNNN has four digits in every version of Tcl, \xNN as many as follow."""
    return f"\\{c}" if " " < c <= "~" else f"\\u{ord(c):04x}"
