# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof registers``: each register in SI units, as integer, and the SI value of the integer.

With ``--format c`` or ``json`` the same integers as a list of (address, value) for a driver to load.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from fluxproof.diagnosis.whole_drive import flux_of, load_drive
from fluxproof.files import refuse_overwriting, write_json
from fluxproof.quote import c_comment, put, say
from fluxproof.stage import alone
from golden_model import torque_table
from golden_model.board_registers import board_generics, board_set, has_board, pin_generics
from golden_model.drive import Drive
from golden_model.drive_checks import doubts
from golden_model.drive_keys import DriveError
from golden_model.generated.register_names import ADDRESSES
from golden_model.registers import RegisterSet, Row
from golden_model.units import SIGNALS, si_per_lsb

HEAD = ("register", "address", "SI value", "unit", "integer", "represented", "error", "legal range")
LEFT = (0, 3)  # columns of words; numbers are right-aligned


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    parser.add_argument("drive", metavar="drive.toml", help="the drive in SI units, see docs/drives/")
    parser.add_argument(
        "--format",
        choices=("table", "c", "json"),
        default="table",
        help="table (default); c: a header with an array to load; json: a list of name, address, value",
    )
    parser.add_argument(
        "--flux-map",
        metavar="FILE",
        help="flux_map.csv of the machine: the torque table of [core] references = true is made of it",
    )
    parser.add_argument("--json", metavar="FILE", help="write the same to FILE, machine-readable")


def run(args: argparse.Namespace) -> int:
    """Print the table and write the JSON file if one is asked for."""
    drive = load_drive(args.drive)
    try:
        result = board_set(drive, flux_of(args.flux_map, drive))
    except DriveError as error:
        raise DriveError(f"{args.drive}: {error}") from None
    for doubt in doubts(drive):
        say(f"fluxproof: {args.drive}: warning: {doubt}", sys.stderr)
    if args.json:
        refuse_overwriting([args.json], [args.drive, *([args.flux_map] if args.flux_map else [])])
        with alone(Path(args.json)) as file:
            write_json(file, as_json(drive, result))
    if args.format == "c":
        put("\n".join(c_lines(args.drive, drive, result)))
    elif args.format == "json":
        put(json.dumps(load_list(result), indent=2))
    else:
        put("\n".join(bases_lines(drive, result) + [""] + table(result.rows)))
    return 0


def load_list(result: RegisterSet) -> list[dict]:
    """The writes of a driver: byte address and integer of each register."""
    words = torque_table.table_words(result.table) if result.config.references else []
    table = [{"name": "table_word", "address": ADDRESSES["table_word"], "value": word} for word in words]
    return table + [{"name": r.name, "address": ADDRESSES[r.name], "value": r.integer} for r in result.rows]


def c_lines(name: str, drive: Drive, result: RegisterSet) -> list[str]:
    """A C header: the bases, the generics the core must be built with, the values to load."""
    torque = si_per_lsb("torque", drive) / SIGNALS["torque"].fmt.lsb
    bases = {**vars(drive.bases), "flux_wb": drive.bases.flux_wb, "torque_nm": torque}
    bases["sample_time_s"] = drive.sample_time_s
    generics = {**result.config._asdict(), "clock_hz": round(drive.core.clock_hz)}
    generics |= board_generics(drive) if has_board(drive) else {}
    rows = []
    for r in result.rows:
        unit = "" if r.unit == "1" else f" {r.unit}"
        rows.append(f"    {{0x{ADDRESSES[r.name]:03X}, {r.integer}}}, /* {r.name}: {r.represented:.7g}{unit} */")
    return [
        c_comment(f"{Path(name).name} by `fluxproof registers --format c`: write each value to its offset."),
        "#ifndef FLUXPROOF_SETTINGS_H",
        "#define FLUXPROOF_SETTINGS_H",
        "#include <stdint.h>",
        "",
        "/* SI values of 1.0 per unit; peak values, electrical speed. */",
        *(f"#define FLUXPROOF_BASE_{key.upper()} {value!r}" for key, value in bases.items()),
        "/* Electrical turns in a turn of the shaft; the register pole_pairs has those in a turn of the code. */",
        f"#define FLUXPROOF_POLE_PAIRS {drive.machine.pole_pairs}",
        "/* Generics that the core must have been built with. */",
        *(f"#define FLUXPROOF_{key.upper()} {value}" for key, value in generics.items()),
        "",
        "struct fluxproof_setting {",
        "    uint16_t offset;",
        "    int32_t value;",
        "};",
        "",
        "static const struct fluxproof_setting fluxproof_settings[] = {",
        *rows,
        "};",
        *(torque_table_lines(result) if result.config.references else []),
        "#endif",
    ]


def torque_table_lines(result: RegisterSet) -> list[str]:
    """The torque table as the values that the register table_word gets one after the other, before use_table."""
    words = [f"0x{word:08X}" for word in torque_table.table_words(result.table)]
    lines = ["    " + ", ".join(words[k : k + 8]) + "," for k in range(0, len(words), 8)]
    return [
        "",
        "/* Write each to table_word, with the gates off. */",
        "#define FLUXPROOF_TORQUE_TABLE 1",
        "static const uint32_t fluxproof_torque_table[] = {",
        *lines,
        "};",
    ]


def bases_lines(drive: Drive, result: RegisterSet) -> list[str]:
    """The SI values of 1.0 per unit, and the generics."""
    bases, config = drive.bases, result.config._asdict() | pin_generics(drive)
    config |= board_generics(drive) if has_board(drive) else {}
    return [
        f"bases     {bases.current_a:g} A, {bases.voltage_v:g} V, {bases.omega_me_rad_s:g} rad/s electrical,"
        f" {bases.flux_wb:.6g} Wb; all peak; T_s = {drive.sample_time_s:g} s",
        "generics  " + ", ".join(f"{name.upper()} = {value}" for name, value in config.items()),
    ]


def table(rows: tuple[Row, ...]) -> list[str]:
    """The registers as aligned columns under a heading."""
    cells = [HEAD] + [_cells(row) for row in rows]
    widths = [max(len(line[k]) for line in cells) for k in range(len(HEAD))]
    lines = ["  ".join(_padded(k, cell, widths[k]) for k, cell in enumerate(line)).rstrip() for line in cells]
    return [lines[0], "-" * max(map(len, lines)), *lines[1:]]


def _padded(column: int, cell: str, width: int) -> str:
    return cell.ljust(width) if column in LEFT else cell.rjust(width)


def _cells(row: Row) -> tuple[str, ...]:
    """One register in words; the error is relative, or absolute with its unit if the value is zero."""
    error = f"{row.relative:+.1e}" if row.relative is not None else f"{row.error:+g} abs"
    legal = f"{row.low}..{row.high}"
    address = f"0x{ADDRESSES[row.name]:03X}"
    return row.name, address, f"{row.si:.7g}", row.unit, str(row.integer), f"{row.represented:.7g}", error, legal


def as_json(drive: Drive, result: RegisterSet) -> dict:
    """The table as JSON data; SI units throughout."""
    bases = {**vars(drive.bases), "flux_wb": drive.bases.flux_wb, "sample_time_s": drive.sample_time_s}
    rows = {
        row.name: {
            "address": ADDRESSES[row.name],
            **{k: v for k, v in row._asdict().items() if k != "name"},
        }
        for row in result.rows
    }
    return {"bases": bases, "generics": result.config._asdict(), "registers": rows}
