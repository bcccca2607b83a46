# SPDX-License-Identifier: BSD-3-Clause
"""The command ``fluxproof`` with the subcommands listed in COMMANDS, e.g. ``fluxproof registers drive.toml``.

Exit status: 0 done, 2 bad input (one line on stderr says which and why), 1 if a command found a fault.
A subcommand is a module with two functions: ``arguments(parser)`` declares its options, ``run(args)`` returns
the exit status; an entry in COMMANDS registers it.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from typing import NamedTuple, NoReturn

from fluxproof import dump_capture, print_registers
from fluxproof.commission import command as commission
from fluxproof.diagnosis import command as diagnose
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.fleet import command as fleet
from fluxproof.project import command as project
from fluxproof.quote import printable, say
from fluxproof.simulate import command as simulate
from golden_model.drive_keys import DriveError


class Command(NamedTuple):
    """One subcommand: a line of help, its options, its function."""

    help: str
    arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


COMMANDS = {
    "commission": Command(
        "measure what a drive file cannot know, over the registers of a board",
        commission.arguments,
        commission.run_command,
    ),
    "diagnose": Command("why a recording differs from its simulation", diagnose.arguments, diagnose.run),
    "dump": Command(
        "convert a captured telemetry stream to the input of diagnose", dump_capture.arguments, dump_capture.run
    ),
    "fleet": Command(
        "many recordings: which drives differ, what drifts, what is worth a look", fleet.arguments, fleet.run
    ),
    "project": Command("the files of a Vivado project for a drive", project.arguments, project.run),
    "registers": Command("the registers for a drive", print_registers.arguments, print_registers.run),
    "simulate": Command(
        "a drive in closed loop with the golden core: does it work", simulate.arguments, simulate.run_command
    ),
}


class Parser(argparse.ArgumentParser):
    """Repeats a mistaken argument without the control characters that it may hold."""

    def error(self, message: str) -> NoReturn:
        super().error(printable(message, sys.stderr.encoding))


def parser() -> argparse.ArgumentParser:
    """The command line with every subcommand."""
    top = Parser(prog="fluxproof", description="Tools around the Fluxproof drive core.")
    commands = top.add_subparsers(metavar="command", required=True)
    for name, command in COMMANDS.items():
        sub = commands.add_parser(name, help=command.help, description=command.help)
        command.arguments(sub)
        sub.set_defaults(run=command.run)
    return top


def main(argv: list[str] | None = None) -> int:
    """Run a subcommand; bad input and unreadable files give one line and status 2, never a traceback."""
    args = parser().parse_args(argv)
    try:
        status = args.run(args)
        sys.stdout.flush()
        return status
    except (DriveError, RecordingError) as error:
        say(f"fluxproof: {error}", sys.stderr)
    except BrokenPipeError:  # the reader, a pager or head, has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        name = f"{error.filename}: " if error.filename else ""
        say(f"fluxproof: {name}{error.strerror or error}", sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
