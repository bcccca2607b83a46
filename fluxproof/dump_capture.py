# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof dump``: converts the telemetry words stored by a DMA to a dump for ``fluxproof diagnose``.

The registers are those of drive.toml, or of a JSON file if the core ran with others: ``{"kp_d": 1234, ...}`` with
integers, or the output of ``fluxproof registers --json``.  Registers that the file omits are those of drive.toml.
"""

from __future__ import annotations

import argparse
import difflib
import json
from pathlib import Path

from fluxproof.commission.bus import BusError, UioBus
from fluxproof.commission.ring import read_ring
from fluxproof.diagnosis.whole_drive import flux_of, load_drive
from fluxproof.files import refuse_overwriting
from fluxproof.quote import put, say
from fluxproof.stage import alone
from golden_model import fluxproof
from golden_model.board_registers import board_set
from golden_model.drive_keys import DriveError
from golden_model.registers import RegisterSet
from golden_model.regular_file import read_regular

MOST_BYTES = 1_000_000  # of a file of registers

REPLAY = {
    "reset": "begins with the first sample after a reset: the golden model can replay all of it",
    "off": "begins with the gates off: the golden model can replay it if the drive had not run since its reset",
    "running": "begins while the drive runs: without the core's state only blocks without memory can be checked; "
    "start the capture before the drive first runs",
}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    parser.add_argument("capture", metavar="capture.bin", help="32-bit words, little-endian, as stored by a DMA")
    parser.add_argument(
        "--drive", metavar="drive.toml", required=True, help="the drive that the core was configured for"
    )
    parser.add_argument(
        "--registers", metavar="FILE", help="JSON: integers of the registers that differ from drive.toml"
    )
    parser.add_argument(
        "--piece", type=int, metavar="N", help="which piece of a capture with a reset inside, from 1 on"
    )
    parser.add_argument(
        "--ring", action="store_true", help="capture.bin is /dev/uioN: read the rows that the core's ring kept"
    )
    parser.add_argument(
        "--flux-map", metavar="FILE", help="the map that the torque table was made of, as for `fluxproof registers`"
    )
    parser.add_argument(
        "--changes",
        metavar="FILE",
        help="JSON: [[number of a sample, {register: integer}], ...] that the host wrote while the drive ran, [] for "
        "none: position and voltage mode are replayed with it",
    )
    parser.add_argument("-o", "--out", metavar="FILE", help="the dump (default: the capture's name with .fluxdump)")


def run(args: argparse.Namespace) -> int:
    """Write the dump and print its contents; returns 0."""
    from fluxproof.diagnosis.replay.telemetry_stream import parse, read_capture, write_piece  # takes a second to import

    if args.ring and not args.out:
        raise DriveError("--ring: the dump needs a name: -o run.fluxdump")
    out = Path(args.out) if args.out else Path(args.capture).with_suffix(".fluxdump")
    refuse_overwriting([out], [args.capture, args.drive, args.registers, args.flux_map, args.changes])
    drive = load_drive(args.drive)
    try:
        register_set = board_set(drive, flux_of(args.flux_map, drive))
    except DriveError as error:
        raise DriveError(f"{args.drive}: {error}") from None
    if args.registers:
        register_set = with_registers(register_set, Path(args.registers))
    changes = changes_of(Path(args.changes)) if args.changes else None
    capture = parse(ring_of(args.capture), args.capture) if args.ring else read_capture(args.capture)
    number = chosen(capture.pieces, args.piece, args.capture)
    with alone(out) as file:
        write_piece(file, capture.pieces[number], drive, register_set, changes)
    put("\n".join(summary(capture, number)))
    say(f"wrote {out}")
    return 0


def ring_of(path: str) -> bytes:
    """The rows in the ring of the core behind /dev/uioN."""
    try:
        return read_ring(UioBus(path))
    except BusError as error:
        raise DriveError(f"{path}: {error}") from None


def chosen(pieces, wanted: int | None, name) -> int:
    """Index of the requested piece, by default the longest."""
    if wanted is None:
        return max(range(len(pieces)), key=lambda k: len(pieces[k]))
    if not 1 <= wanted <= len(pieces):
        raise DriveError(f"--piece {wanted}: {name} has pieces 1 to {len(pieces)}")
    return wanted - 1


def summary(capture, number: int) -> list[str]:
    """Lines on the contents of the dump and what is missing."""
    piece = capture.pieces[number]
    lines = []
    if len(capture.pieces) > 1:
        lines.append(f"the samples' numbers go back in {len(capture.pieces) - 1} places (a reset?); pieces:")
        for k, other in enumerate(capture.pieces):
            mark = "  <- this one" if k == number else ""
            lines.append(f"  {k + 1}: from byte {other.byte}, {_numbers(other)}{mark}")
    lines.append(f"{len(piece)} samples, {_numbers(piece)}, {piece.lost} lost between them")
    lines.append(REPLAY["reset" if piece.counter[0] == 0 else "running" if piece.fields["run"][0] else "off"])
    lines += [f"{count} bytes at byte {at} belong to no whole packet" for at, count in capture.left]
    return lines


def _numbers(piece) -> str:
    return f"numbers {piece.counter[0] % 2**32} to {piece.counter[-1] % 2**32}"


def with_registers(base: RegisterSet, path: Path) -> RegisterSet:
    """``base`` with the integers of a JSON file; DriveError names an unknown register or an invalid value."""
    from fluxproof.diagnosis.replay.telemetry import CONFIG

    data = _json_of(path)
    if not isinstance(data, dict):
        raise DriveError(f"{path}: expected an object of registers, found {type(data).__name__}")
    whole = isinstance(data.get("registers"), dict)
    values = {name: _integer(value) for name, value in (data["registers"] if whole else data).items()}
    generics = data.get("generics", {}) if whole else {}
    if not isinstance(generics, dict):
        raise DriveError(f"{path}: generics: expected an object, found {type(generics).__name__}")
    ranges = {name: (port.low, port.high) for name, port in fluxproof.REGISTERS.items()}
    _check(path, "register", values, ranges)
    _check(path, "generic", generics, CONFIG)
    return base._replace(values=base.values._replace(**values), config=base.config._replace(**generics))


def changes_of(path: Path) -> dict[int, dict[str, int]]:
    """{number of a sample: {register: integer}} of a JSON file; DriveError where it is none."""
    data, ranges = _json_of(path), {name: (port.low, port.high) for name, port in fluxproof.REGISTERS.items()}
    found: dict[int, dict[str, int]] = {}
    for k, change in enumerate(data if isinstance(data, list) else [data]):
        if not isinstance(change, list) or [type(part) for part in change] != [int, dict] or change[0] < 0:
            raise DriveError(f"{path}: change {k + 1}: expected [number of a sample, {{register: integer}}]")
        _check(path, "register", change[1], ranges)
        found[change[0]] = found.get(change[0], {}) | change[1]
    return found


def _json_of(path: Path):
    """The contents of a JSON file."""
    try:
        return json.loads(read_regular(path, MOST_BYTES).decode("utf-8"))
    except OSError as error:
        raise DriveError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise DriveError(f"{path}: not JSON: {error}") from None


def _integer(value):
    """A register's integer, bare or in the table that ``fluxproof registers --json`` writes."""
    return value.get("integer") if isinstance(value, dict) else value


def _nearest(name: str, known) -> str:
    """The known names that are most alike, in words."""
    alike = difflib.get_close_matches(name, known, 3, 0.5)
    return f"; the nearest are {', '.join(alike)}" if alike else "; known are those of `fluxproof registers --json`"


def _check(path, kind, values, ranges) -> None:
    for name, value in values.items():
        if name not in ranges:
            raise DriveError(f"{path}: {kind} {name[:40]!r} is unknown{_nearest(name, ranges)}")
        low, high = ranges[name]
        if type(value) is not int or not low <= value <= high:
            shown = json.dumps(value)[:40]
            raise DriveError(f"{path}: {kind} {name} = {shown}: expected an integer from {low} to {high}")
