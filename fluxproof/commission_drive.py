# SPDX-License-Identifier: BSD-3-Clause
"""The subcommand ``fluxproof commission drive.toml [--bus sim|/dev/uioN] [--out DIR] [--watch]``: drive.toml and
commission.json.

Exit status: 0 accepted, 1 refused, 130 stopped by a signal, with the reason in one line on stderr, 2 bad input.  The
gates are off at the end, Ctrl-C and SIGTERM included.
"""

from __future__ import annotations

import argparse
import shutil
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from fluxproof.diagnosis.whole_drive import load_drive
from fluxproof.files import refuse_overwriting, stem_of, write_json, write_text
from fluxproof.quote import say
from fluxproof.stage import SIGNALS, check, together
from golden_model.drive import load
from golden_model.drive_file import read_tables, read_text
from golden_model.drive_keys import DriveError

DATA, DRIVE, EARLIER = "commission.json", "drive.toml", "drive_earlier.toml"
STOPPED = 130


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    parser.add_argument("drive", metavar="drive.toml", help="the drive with start values, see docs/commissioning.md")
    parser.add_argument(
        "--bus",
        default="sim",
        metavar="sim|/dev/uioN",
        help="the board's registers; default sim: the golden core on the drive of the file",
    )
    parser.add_argument(
        "--hold",
        type=float,
        metavar="AMPERES",
        help="only let this direct current flow through phase a, to compare it with an ammeter",
    )
    parser.add_argument("--out", metavar="DIR", help="folder of the results; default build/commission/NAME")
    parser.add_argument("--watch", action="store_true", help="a page that shows each step as it runs; ends at Ctrl-C")
    parser.add_argument("--port", type=int, default=5007, help="of that page (default 5007; 0: any)")


def run(args: argparse.Namespace) -> int:
    """Measure, write both files, say each step."""
    drive = load_drive(args.drive)
    if drive.machine.magnet_flux_wb <= 0.0:
        raise DriveError(f"{args.drive}: [machine] magnet_flux_wb = 0: commissioning is for machines with magnets")
    if args.hold is not None and not 0.0 < args.hold <= drive.current_limit_a:
        raise DriveError(
            f"--hold {args.hold:g}: allowed is above 0 up to the current limit, {drive.current_limit_a:g} A"
        )
    given = read_tables(args.drive).get("sensors", {})
    reverse = given.get("position_reverse")
    folder = Path(args.out) if args.out else Path("build") / "commission" / stem_of(args.drive)
    refuse_overwriting([folder / name for name in (DATA, DRIVE, EARLIER)], [args.drive])
    check(folder, (DATA, DRIVE, EARLIER))
    _say("loading")
    if not args.watch:
        return commission_file(open_bus(args.bus, drive), args.drive, drive, reverse, folder, args.hold)
    from fluxproof.watch.commissioning import Page, Watched

    page = Page(drive, args.port)
    say(f"watching {args.drive}: {page.url}")
    bus = Watched(open_bus(args.bus, drive), page)
    status = commission_file(bus, args.drive, drive, reverse, folder, args.hold, page.tell)
    if status != STOPPED:
        left_out = f"; {page.left_out} snapshots are missing in its curves" if page.left_out else ""
        say(f"the page stays until Ctrl-C{left_out}")
        page.wait()
    return status


def open_bus(name: str, drive):
    """A bus by its name; DriveError where the device cannot be used."""
    if name == "sim":
        from fluxproof.commission.simulated import SimulatedBus, board_of  # takes seconds

        return SimulatedBus(drive, board_of(drive))
    from fluxproof.commission.bus import UioBus

    return UioBus(name)


def commission_file(
    bus,
    path: str,
    drive,
    reverse: bool | None,
    folder: Path,
    hold_a: float | None = None,
    tell: Callable[[str, object], None] | None = None,
) -> int:
    """The whole of it on an open bus; the exit status.

    ``tell``: told what runs "now", each "step", and the "end"; with it the step responses are measured, too.
    """
    from fluxproof.commission import document
    from fluxproof.commission.session import Refusal
    from fluxproof.commission.steps import commission

    steps, began, respond = [], bus.now(), tell is not None
    tell = tell or (lambda kind, what: None)
    text = read_text(path)
    drive = replace(drive, sensors=replace(drive.sensors, position_reverse=False, theta_offset_rad=0.0))

    def progress(said: str) -> None:
        tell("now", said)
        _say(said)

    def done(step) -> None:
        steps.append(step)
        tell("step", step)
        _clear()
        say(f"{step.name}: {step.said}")

    def ended(status: str, reason: str, found=None) -> None:
        _clear()
        tell("end", f"{status}: {reason}" if reason else status)
        if hold_a is not None:  # nothing was measured, so an earlier result stays
            return
        with together(folder, (DATA, DRIVE)) as stage:
            write_json(stage / DATA, document.data(Path(path).name, status, reason, steps, bus.now() - began))
            if found is not None:
                load(write_text(stage / DRIVE, document.document(text, found, steps)))  # it can be read
            elif (folder / DRIVE).exists():  # measured values are not lost, but do not stand beside a refusal
                shutil.copyfile(folder / DRIVE, stage / EARLIER)

    before = _stop_once()
    try:
        found, _ = commission(bus, drive, reverse, progress, done, hold_a, respond)
    except Refusal as refusal:
        ended("refused", str(refusal))
        say(f"fluxproof: {path}: refused: {refusal}", sys.stderr)
        return 1
    except KeyboardInterrupt:
        bus.write("enable", 0)  # once more: the signal may have come while `commission` did it
        ended("stopped", "stopped by the user")
        say(f"fluxproof: {path}: stopped, gates off", sys.stderr)
        return STOPPED
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)
    if hold_a is not None:
        return 0
    warned = [step.said for step in steps if step.notes.get("warned")]
    ended("accepted", "; ".join(warned), found)
    say(f"accepted: {folder / DRIVE}, {folder / DATA} ({bus.now() - began:.1f} s of the drive)")
    return 0


def _stop_once() -> dict:
    """Ctrl-C, SIGTERM and SIGHUP raise KeyboardInterrupt, the first one only: nothing interrupts what follows.

    Returns the handlers so far; what was ignored, such as SIGHUP by nohup, stays so.
    """
    before = {number: handler for number in SIGNALS if (handler := signal.getsignal(number)) is not signal.SIG_IGN}

    def stop(_number, _frame) -> None:
        for number in before:
            signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    for number in before:
        signal.signal(number, stop)
    return before


def _say(text: str) -> None:
    if sys.stderr.isatty():
        print(f"\rcommission: {text}\x1b[K", end="", file=sys.stderr, flush=True)


def _clear() -> None:
    if sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)
