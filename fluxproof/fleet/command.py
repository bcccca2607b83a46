# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof fleet``: many recordings, as a command.

Progress goes to stderr, what is worth a look to stdout, the files to --out.  The exit status is 0 whatever was found,
and 2 with one line on stderr for unusable input.  Slow imports are made inside the functions, so that
``fluxproof --help`` stays quick, and dask is needed for this command alone.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from fluxproof.quote import say

FOLDER = Path("build") / "fleet"
MOST_LINES = 20
TIMEOUT_S = 600.0


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    kinds = "a recording, a folder, a pattern such as 'runs/*.csv', an address such as s3://…, a manifest"
    parser.add_argument("recordings", metavar="RECORDINGS", nargs="+", help=kinds)
    parser.add_argument("--drive", metavar="drive.toml", help="the nominal drive where a manifest names none")
    parser.add_argument("--out", metavar="DIR", default=str(FOLDER), help=f"folder for the results (default: {FOLDER})")
    parser.add_argument("--workers", type=int, help="processes on this machine (default: one for each core)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="a running dask scheduler, such as tcp://host:8786")
    late = f"the most that one recording may take (default: {TIMEOUT_S:g})"
    parser.add_argument("--timeout", metavar="SECONDS", type=float, default=TIMEOUT_S, help=late)
    allow = "a protocol that addresses in a manifest may have, such as s3; may be repeated"
    parser.add_argument("--allow", metavar="PROTOCOL", action="append", default=[], help=allow)
    limit = "limit of a drift, in SI units or such as 95%% of the first value; may be repeated"
    parser.add_argument("--limit", metavar="PARAMETER=VALUE", action="append", default=[], help=limit)
    parser.add_argument("--report", metavar="NAME", action="append", default=[], help="also write its report")
    parser.add_argument("--serve", action="store_true", help="show it in the browser; a click makes a report")
    parser.add_argument("--quiet", action="store_true", help="no progress on stderr")


def run(args: argparse.Namespace) -> int:
    """Diagnose what is not done, write the outputs, print what is worth a look; returns 0, or 130 after Ctrl-C."""
    from fluxproof.diagnosis.ground.recording import RecordingError

    try:
        from fluxproof.fleet.engine import Engine, EngineError
        from fluxproof.fleet.session import run as session
    except ModuleNotFoundError as error:
        if error.name not in ("dask", "distributed", "fsspec"):
            raise
        raise RecordingError(f"{error.name} is not installed: pip install 'fluxproof[fleet]'") from None
    from fluxproof.files import refuse_overwriting
    from fluxproof.fleet.manifest import entries
    from fluxproof.fleet.page import PAGE
    from fluxproof.fleet.reports import make, serve
    from fluxproof.fleet.table import FLEET

    if args.workers is not None and args.workers < 1:
        raise RecordingError(f"--workers {args.workers}: expected 1 or more")
    if not 0 < args.timeout < math.inf:
        raise RecordingError(f"--timeout {args.timeout:g}: expected seconds, more than 0")
    limits, listed, out = _limits(args.limit), entries(args.recordings, args.drive, args.allow), Path(args.out)
    refuse_overwriting([out / FLEET, out / PAGE], args.recordings)  # a manifest; recordings and drives: the session

    def engine():
        return Engine(args.workers, args.scheduler, args.timeout)

    try:
        outcome = session(listed, out, engine, limits, args.quiet, _told(args.quiet), args.timeout)
        for name in args.report:
            say(f"wrote {make(listed, name, out)}")
    except EngineError as error:
        raise RecordingError(str(error)) from None
    except KeyboardInterrupt:
        print("fluxproof: stopped; the same command resumes from here", file=sys.stderr)
        return 130
    for line in lines(outcome):
        say(line)
    if args.serve:
        serve(listed, out)
    return 0


def _told(quiet):
    def told(engine):
        if not quiet:
            print(f"dask dashboard: {engine.dashboard}", file=sys.stderr)

    return told


def _limits(texts) -> dict[str, str]:
    """{parameter: value} of the options; RecordingError says what was expected."""
    from fluxproof.diagnosis.fleet.drift import limit_of
    from fluxproof.diagnosis.ground.recording import RecordingError

    out = {}
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            limit_of(value, 1.0)
        except ValueError:
            equals = ""
        if not equals or not name:
            expected = "expected PARAMETER=VALUE, such as magnet_flux_wb=0.095 or magnet_flux_wb=95%"
            raise RecordingError(f"--limit {text}: {expected}")
        out[name.strip()] = value
    return out


def lines(outcome) -> list[str]:
    """What is worth a look, as lines of text."""
    from fluxproof.fleet.page import cause, drift_view, headline

    found = outcome.findings
    out = [headline(found), f"diagnosed {outcome.diagnosed}, reused {outcome.kept} from earlier runs"]
    for design in found.designs:
        out += [
            f"{serial}: {c['title']}: {c['why']}" for serial, fs in design.outliers.items() for c in map(cause, fs)
        ][:MOST_LINES]
        for d in map(drift_view, design.drifts[:MOST_LINES]):
            out.append(f"{d['serial']}: {d['parameter']} {d['relative']} per year, limit reached: {d['reaches']}")
        out += [f"{len(g.serials)} drives share a residual: {_lines(g)}" for g in design.groups]
    out += [f"{row['recording']}: {row['reason']}" for row in found.failed[:MOST_LINES]]
    return [*out, "", f"wrote {outcome.page}", f"wrote {outcome.fleet}"]


def _lines(group) -> str:
    from fluxproof.fleet.pictures import place_text

    return ", ".join(place_text(line) for line in group.lines[:4])
