# SPDX-License-Identifier: BSD-3-Clause
"""Reads a TOML file into the dataclasses that declare its sections; every error is a message of one line.

A message names the file, the section and the key, and what is allowed: the range, the type, or for an
unknown name the nearest known one.
"""

import codecs
import dataclasses
import difflib
import re
import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # pyright: ignore[reportMissingImports]  # installed with Python 3.10 alone

from golden_model.drive_keys import DriveError, key_of
from golden_model.regular_file import read_regular
from golden_model.toml_depth import check_keys

# Columns and constants of recordings, and physics beyond the core's model: all are read by diagnosis/.
IGNORED = ("columns", "constants", "plant")
MOST_BYTES = 1_000_000
LONGEST = 40  # characters of a value or a name in a message


def read_sections(path, schema):
    """{section: dataclass instance} from the file; ``schema`` is {section: dataclass}."""
    try:
        tables = _tables(Path(path))
        _refuse_unknown(tables, [*schema, *IGNORED], "section")
        return {name: _section(name, kind, tables.get(name)) for name, kind in schema.items()}
    except DriveError as error:
        raise DriveError(f"{path}{error}") from None


def read_tables(path):
    """The file as nested dictionaries; only the TOML syntax is checked."""
    try:
        return _tables(Path(path))
    except DriveError as error:
        raise DriveError(f"{path}{error}") from None


def _tables(path):
    """The file as nested dictionaries; an error message starts right after the file name."""
    text = _text(path)
    try:
        check_keys(text)
        return tomllib.loads(text)
    except RecursionError:
        raise DriveError(": not TOML: too many levels") from None
    except ValueError as error:
        reason = "a number of too many digits" if "integer string" in str(error) else str(error)
        raise DriveError(_syntax_message(reason, text)) from None


def read_text(path):
    """The file's text for those who edit it: without a byte-order mark, lines ending with a line feed."""
    try:
        return _text(Path(path)).replace("\r\n", "\n")
    except DriveError as error:
        raise DriveError(f"{path}{error}") from None


def _text(path):
    """The text without a byte-order mark, which editors of Windows write; an error as in ``_tables``."""
    try:
        data = read_regular(path, MOST_BYTES)
    except (OSError, ValueError) as error:
        raise DriveError(f": cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or b"\0" in data[:4]:
        raise DriveError(":1: not UTF-8 but UTF-16 text: TOML is UTF-8; save the file as UTF-8")
    try:
        return data.removeprefix(codecs.BOM_UTF8).decode("utf-8")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise DriveError(f":{line}: not UTF-8 text") from None


def _syntax_message(message, text):
    """':line: message of the TOML parser', which puts the line at its end."""
    at = re.search(r" \(at line (\d+), column (\d+)\)$", message)
    if at:
        return f":{at[1]}: not TOML: {message[: at.start()]} (column {at[2]})"
    return f":{max(1, len(text.splitlines()))}: not TOML: {message}"


def _nearest(name, known):
    return f"the nearest known one is {difflib.get_close_matches(name[:LONGEST], known, n=1, cutoff=0.0)[0]}"


def _refuse_unknown(table, known, what, where=""):
    for name in table:
        if name not in known:
            shown = name if name.isprintable() and len(name) <= LONGEST else _shown(name)
            raise DriveError(f": {where}unknown {what} {shown}; {_nearest(name, known)}")


def _section(name, kind, table):
    """One section as an instance of its dataclass."""
    fields = {f.name: f for f in dataclasses.fields(kind)}
    required = [f for f, x in fields.items() if x.default is dataclasses.MISSING]
    if table is None:
        if required:
            raise DriveError(f": section [{name}] is missing; it needs {', '.join(required)}")
        table = {}
    if not isinstance(table, dict):
        raise DriveError(f": {name} must be a section [{name}] with keys, not a {_type_name(table)}")
    _refuse_unknown(table, list(fields), "key", f"[{name}] ")
    for key in required:
        if key not in table:
            raise DriveError(f": [{name}] {key} is missing: {_expected(key_of(fields[key]))}")
    values = {key: _value(f"[{name}] {key}", key_of(fields[key]), value) for key, value in table.items()}
    return kind(**values)


def _value(where, key, value):
    """The value in its declared type, a list as a tuple."""
    if not key.count:
        return _single(where, key, value)
    if not isinstance(value, list) or len(value) != key.count:
        raise DriveError(f": {where} = {_shown(value)}: must be {_expected(key)}")
    return tuple(_single(where, key, item) for item in value)


def _single(where, key, value):
    if not _type_fits(key.kind, value):
        raise DriveError(f": {where} = {_shown(value)} is a {_type_name(value)}: must be {_expected(key)}")
    if key.kind == "bool":
        return value
    if not key.accepts(value) and key.kind == "word":
        raise DriveError(f": {where} = {_shown(value)}: allowed is {key.allowed}; {_nearest(value, key.words)}")
    if not key.accepts(value):
        raise DriveError(f": {where} = {_shown(value)} is out of range: allowed is {key.allowed}")
    return float(value) if key.kind == "float" else value


def _type_fits(kind, value):
    """TOML's true is not a number, and a whole number is a real one."""
    if kind == "bool" or isinstance(value, bool):
        return kind == "bool" and isinstance(value, bool)
    if kind == "word":
        return isinstance(value, str)
    if kind == "int":
        return isinstance(value, int)
    return isinstance(value, float) or (isinstance(value, int) and abs(value) < 10**300)


def _expected(key):
    """What the key takes, in words."""
    if key.kind == "bool":
        return "true or false"
    if key.kind == "word":
        return f"a string, {key.allowed}"
    one = f"{'whole number' if key.kind == 'int' else 'number'}, {key.allowed}"
    doc = f" ({key.doc})" if key.doc else ""
    return f"a list of {key.count}, each a {one}{doc}" if key.count else f"a {one}{doc}"


def _type_name(value):
    names = {bool: "boolean", str: "string", list: "list", dict: "table", float: "real number"}
    names[int] = "whole number"
    return names.get(type(value), type(value).__name__)


def _shown(value):
    """The value as text that fits a line."""
    if isinstance(value, int) and value.bit_length() > 1000:  # Python writes no number of more than 4300 digits
        return f"a whole number of {value.bit_length()} bits"
    try:
        text = repr(value) if not isinstance(value, bool) else str(value).lower()
    except (RecursionError, ValueError):  # such a number, or many levels, within a list or table
        return f"a {_type_name(value)}"
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
