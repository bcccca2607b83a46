# SPDX-License-Identifier: BSD-3-Clause
"""The subcommand ``fluxproof project drive.toml --part PART --out DIR``."""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

from fluxproof.checkout import ROOT
from fluxproof.diagnosis.whole_drive import load_drive
from fluxproof.files import refuse_overwriting, write_text
from fluxproof.project import hil, need, parts, render
from fluxproof.quote import say, shown
from fluxproof.stage import together
from golden_model.board_registers import board_set, has_board
from golden_model.drive_keys import DriveError

NUMBER = re.compile("0[xX][0-9a-fA-F]{1,16}|[1-9][0-9]{0,15}")


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    parser.add_argument("drive", metavar="drive.toml", help="the drive in SI units, see docs/drives/")
    parser.add_argument("--part", required=True, help="the FPGA by its full name, e.g. xc7z020clg484-1")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the files")
    parser.add_argument("--base", metavar="ADDRESS", help="address of the registers; default that of the family")
    parser.add_argument("--hil", action="store_true", help="with a motor in the FPGA, that of the drive file: no pins")
    parser.add_argument("--core", metavar="DIR", help="checkout of Fluxproof; can be given to the script as well")


def run(args: argparse.Namespace) -> int:
    """Write the files; an error in the drive or an argument writes nothing."""
    drive, motor = load_drive(args.drive), {}
    try:
        if args.hil:
            drive, motor = hil.drive_of(drive), {hil.NAME: hil.header(args.drive, drive)}
        register_set = board_set(drive)
    except DriveError as error:
        raise DriveError(f"{args.drive}: {error}") from None
    part = parts.checked(args.part)
    processor = parts.processor_of(part)
    clock = drive.core.clock_hz
    if processor is not None and clock > processor.most_hz:
        most = f"up to {processor.most_hz:g} Hz, the fabric clock of a {processor.name}"
        raise DriveError(f"{args.drive}: [core] clock_hz = {clock:g} is out of range: allowed is {most}")
    if abs(clock / round(clock) - 1.0) > 1e-12:
        raise DriveError(f"{args.drive}: [core] clock_hz = {clock!r}: allowed is a whole number of Hz")
    base = address(args.base) if args.base else processor.base if processor else 0
    project = render.Project(args.drive, drive, register_set, part, base, core_folder(args.core), args.hil)
    found = render.files(project, processor) | motor
    folder = Path(args.out)
    refuse_overwriting([folder / name for name in found], [args.drive])
    with together(folder, (*render.NAMES, hil.NAME)) as stage:
        for name, text in found.items():
            write_text(stage / name, text)
    for name in found:
        say(str(folder / name))
    fits, words = need.judged(drive, part, args.hil)
    say(words if fits else f"fluxproof: {args.drive}: {words}", sys.stdout if fits else sys.stderr)
    if processor is None:
        say(f"no device tree: {part} has no processor; the script builds the core alone")
    elif has_board(drive) and not args.hil:
        say("the script builds fluxproof_board alone: its pins are those of your board")
    elif processor is not parts.ZYNQ:
        say(f"the script builds the core alone: the block design around it is for {parts.ZYNQ.name}")
    return 0


def address(text: str) -> int:
    """A multiple of the window, of 32 bits; DriveError otherwise."""
    value = int(text, 0) if NUMBER.fullmatch(text) else -1
    if not 0 < value < 1 << 32 or value % render.WINDOW:
        allowed = f"a multiple of 0x{render.WINDOW:x} of 32 bits, like 0x43C00000"
        raise DriveError(f"--base '{shown(text)}': allowed is {allowed}")
    return value


def core_folder(given: str | None) -> str:
    """The folder in the script: the one given, this checkout, or none for an installed package."""
    if given:
        try:
            return Path(given).resolve().as_posix()
        except (OSError, RuntimeError, ValueError) as error:  # a ring of links, a zero byte
            raise DriveError(f"--core '{shown(given)}': no name of a folder: {error}") from None
    return ROOT.as_posix() if (ROOT / "scripts" / "vivado").is_dir() else ""
