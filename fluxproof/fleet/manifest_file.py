# SPDX-License-Identifier: BSD-3-Clause
"""The text of a manifest, CSV or Parquet: its columns and its lines; each mistake names line and column.

CSV is UTF-8, or UTF-16 with a byte-order mark, and separated by comma, semicolon or tab.
"""

from __future__ import annotations

import codecs
import csv
import io
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from fluxproof.diagnosis.ground.limits import limited
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.quote import shown
from golden_model.regular_file import open_regular

RECORDING = "recording"  # the column that makes a table a manifest
SUFFIXES = (".csv", ".txt")
SEPARATORS = ",;\t"
MARKS = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16", codecs.BOM_UTF8: "utf-8-sig"}
MOST_LINE = 1_000_000  # letters
MOST_COLUMNS = 1000
MOST_ROWS = 1_000_000
HEAD_BYTES = 4096
SIMPLE = (
    pa.types.is_string, pa.types.is_large_string, pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean,
    pa.types.is_timestamp, pa.types.is_date, pa.types.is_null, pa.types.is_decimal,
)  # fmt: skip


def is_manifest(path: Path) -> bool:
    """Whether the file has a column ``recording``; one that cannot be read is a recording, whose row says why."""
    try:
        if path.suffix.lower() == ".parquet":
            with open_regular(path) as file, pq.ParquetFile(file) as parquet:
                return RECORDING in parquet.schema_arrow.names
        if path.suffix.lower() not in SUFFIXES:
            return False
        with open_regular(path) as file:
            encoding, guessed = _encoding(file)
            text = io.TextIOWrapper(file, guessed or encoding, errors="replace", newline="")
            return RECORDING in _split(text.readline(MOST_LINE))[0]
    except (OSError, ValueError, pa.ArrowException, csv.Error):
        return False


def table(path: Path) -> list[tuple[int, dict[str, str]]]:
    """[(line, {column: text})]; of a Parquet file the line is the row, counted from 1; RecordingError for mistakes."""
    try:
        return _parquet(path) if path.suffix.lower() == ".parquet" else _text(path)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from None
    except MemoryError:
        raise RecordingError(f"{path}: too large for the memory limit") from None


def _encoding(file) -> tuple[str, str | None]:
    """(encoding by the byte-order mark, UTF-16 as the zero bytes suggest it); the file is at its start again."""
    head = file.read(HEAD_BYTES)
    file.seek(0)
    encoding = next((name for mark, name in MARKS.items() if head.startswith(mark)), "utf-8")
    zeros = [head[k::2].count(0) for k in (0, 1)]
    guessed = None
    if encoding == "utf-8" and max(zeros) > len(head) // 4:
        guessed = "utf-16-be" if zeros[0] > zeros[1] else "utf-16-le"
    return encoding, guessed


def _split(line: str) -> tuple[list[str], str]:
    """(names of a header, its separator): the one that yields the column ``recording``, else the comma."""
    for separator in SEPARATORS:
        names = [name.strip() for name in next(csv.reader([line], delimiter=separator), [])]
        if RECORDING in names:
            return names, separator
    return [name.strip() for name in next(csv.reader([line]), [])], SEPARATORS[0]


def _text(path: Path) -> list[tuple[int, dict[str, str]]]:
    with open_regular(path) as file:
        encoding, guessed = _encoding(file)
        if guessed:
            expected = "expected UTF-8, or UTF-16 with a mark"
            raise RecordingError(f"{path}: {guessed.upper()} without a byte-order mark; {expected}")
        # Bytes that are not UTF-8 stay in the text, so that the message can name their line and column.
        errors = "surrogateescape" if encoding.startswith("utf-8") else "strict"
        text = _lines(path, io.TextIOWrapper(file, encoding, errors=errors, newline=""))
        names, separator = _split(next(text, ""))
        _check_names(path, names)
        reader, rows = csv.reader(text, delimiter=separator), []
        try:
            for cells in reader:
                if not any(cell.strip() for cell in cells):
                    continue
                rows.append((1 + reader.line_num, _cells(f"{path}:{1 + reader.line_num}", names, cells)))
        except csv.Error as error:
            raise RecordingError(f"{path}:{1 + reader.line_num}: not a table in CSV: {error}") from None
        return rows


def _lines(path: Path, file):
    """The lines of a text; RecordingError for one that is too long or contains zero bytes, or for too many."""
    number = 0
    try:
        while line := file.readline(MOST_LINE + 1):
            number += 1
            if len(line) > MOST_LINE or number > MOST_ROWS:
                what = (
                    f"lines; at most {MOST_ROWS}" if number > MOST_ROWS else f"letters in a line; at most {MOST_LINE}"
                )
                raise RecordingError(f"{path}:{number}: more {what} are read")
            if "\0" in line:
                raise RecordingError(f"{path}:{number}: letter {line.index(chr(0)) + 1} is a zero byte; expected text")
            yield line
    except UnicodeDecodeError:
        raise RecordingError(f"{path}:{number + 1}: not UTF-16 text, as the byte-order mark says") from None


def _check_names(path: Path, names: list[str]) -> None:
    if len(names) > MOST_COLUMNS:
        raise RecordingError(f"{path}:1: {len(names)} columns; at most {MOST_COLUMNS} are read")
    for n, name in enumerate(names):
        if name in names[:n]:
            raise RecordingError(f"{path}:1: column {shown(name)!r} twice")
        _check_text(f"{path}:1: column {n + 1}", name)


def _cells(at: str, names: list[str], cells: list[str]) -> dict[str, str]:
    if len(cells) != len(names):
        raise RecordingError(f"{at}: {len(cells)} columns; {len(names)} columns expected, as in line 1")
    found = {name: cell.strip() for name, cell in zip(names, cells, strict=True)}
    for name, cell in found.items():
        _check_text(f"{at}: column {shown(name)!r}", cell)
    return found


def _check_text(at: str, text: str) -> None:
    """RecordingError for a byte that is not UTF-8."""
    odd = next((letter for letter in text if "\ud800" <= letter <= "\udfff"), None)
    if odd is not None:
        raise RecordingError(f"{at}: byte 0x{ord(odd) & 0xFF:02x} is not UTF-8; save the manifest as UTF-8")


def _parquet(path: Path) -> list[tuple[int, dict[str, str]]]:
    try:
        with open_regular(path) as file, limited(path), pq.ParquetFile(file) as parquet:
            schema = parquet.schema_arrow
            _check_names(path, schema.names)
            if (rows := parquet.metadata.num_rows) > MOST_ROWS:
                raise RecordingError(f"{path}: {rows} rows; at most {MOST_ROWS} are read")
            for field in schema:
                kind = field.type.value_type if pa.types.is_dictionary(field.type) else field.type
                if not any(of(kind) for of in SIMPLE):
                    expected = "expected text, numbers or times"
                    raise RecordingError(f"{path}: column {shown(field.name)!r} is {shown(field.type)}; {expected}")
            columns = {}
            for name in schema.names:
                try:
                    columns[name] = [_plain(value) for value in parquet.read([name]).column(0).to_pylist()]
                except UnicodeDecodeError:
                    raise RecordingError(f"{path}: column {shown(name)!r}: its text is not UTF-8") from None
    except RecordingError:
        raise
    except (pa.ArrowException, OSError, ArithmeticError, ValueError) as error:
        raise RecordingError(f"{path}: not a readable Parquet file: {shown(error, 160)}") from None
    return [(n + 1, {name: texts[n] for name, texts in columns.items()}) for n in range(rows)]


def _plain(value) -> str:
    """A cell as text; no value and no number are empty."""
    return "" if value is None or value != value else str(value).strip()
