# SPDX-License-Identifier: BSD-3-Clause
"""The command ``fluxproof`` with the subcommands listed in COMMANDS, e.g. ``fluxproof registers drive.toml``.

Exit status: 0 done, 1 if a command found a fault, 2 bad input, a full disk or a defect of the tool (one line on stderr
says which and why), 130 after Ctrl-C.
A subcommand is a module with two functions: ``arguments(parser)`` declares its options, ``run(args)`` returns
the exit status; an entry in COMMANDS registers it.  Only the module of the chosen subcommand is imported.
"""

from __future__ import annotations

import argparse
import sys
from importlib import import_module
from typing import NamedTuple, NoReturn

from fluxproof.guard import guarded
from fluxproof.quote import printable


class Command(NamedTuple):
    """One subcommand: its module, a line of help."""

    module: str
    help: str


COMMANDS = {
    "commission": Command(
        "fluxproof.commission_drive", "measure what a drive file cannot know, over the registers of a board"
    ),
    "constants": Command(
        "fluxproof.constants.command", "numbers of a data sheet into [machine], checked against each other"
    ),
    "diagnose": Command("fluxproof.diagnosis.command", "why a recording differs from its simulation"),
    "dump": Command("fluxproof.dump_capture", "convert a captured telemetry stream to the input of diagnose"),
    "fleet": Command(
        "fluxproof.fleet.command", "many recordings: which drives differ, what drifts, what is worth a look"
    ),
    "project": Command("fluxproof.project.command", "the files of a Vivado project for a drive"),
    "registers": Command("fluxproof.print_registers", "the registers for a drive"),
    "simulate": Command("fluxproof.simulate.command", "a drive in closed loop with the golden core: does it work"),
    "watch": Command("fluxproof.watch.command", "a running drive on a page, and why it differs, while it runs"),
}


class Parser(argparse.ArgumentParser):
    """Repeats a mistaken argument without the control characters that it may hold."""

    def error(self, message: str) -> NoReturn:
        super().error(printable(message, sys.stderr.encoding))


def parser(chosen: str | None = None) -> argparse.ArgumentParser:
    """The command line with every subcommand, and the options of the chosen one."""
    top = Parser(prog="fluxproof", description="Tools around the Fluxproof drive core.")
    commands = top.add_subparsers(metavar="command", required=True)
    for name, command in COMMANDS.items():
        sub = commands.add_parser(name, help=command.help, description=command.help)
        if name == chosen:
            module = import_module(command.module)
            module.arguments(sub)
            sub.set_defaults(run=module.run)
    return top


def dispatch(argv: list[str]) -> int:
    """Run a subcommand; its exit status.  The first argument is the subcommand, as there are no other options."""
    args = parser(argv[0] if argv else None).parse_args(argv)
    return args.run(args)


def main(argv: list[str] | None = None) -> int:
    """``dispatch`` inside another program: bad input and any error give one line and a status, never a traceback."""
    return guarded(lambda: dispatch(sys.argv[1:] if argv is None else argv))


if __name__ == "__main__":
    sys.exit(guarded(lambda: dispatch(sys.argv[1:]), process=True))
