# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof diagnose``: why a recording differs from its simulation, as a command.

Progress goes to stderr, the answer to stdout, the files to --out.  The exit status is 0 whatever the verdict, and 2
with one line on stderr for unusable input (fluxproof/command.py).  Slow imports are made inside the functions, so that
``fluxproof --help`` stays quick.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import webbrowser
from pathlib import Path

from fluxproof.files import stem_of
from fluxproof.quote import printable, say

FOLDER = Path("build") / "diagnosis"
MOST_PROBLEMS = 5


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    formats = "CSV, Parquet, MATLAB, MDF4, HDF5, NumPy or a telemetry dump; several of the same drive"
    parser.add_argument("recordings", metavar="RECORDING", nargs="*", help=formats)
    parser.add_argument("--drive", metavar="drive.toml", help="the nominal drive in SI units")
    example = "make a recording of a simulated motor that differs from its drive file, and diagnose it"
    parser.add_argument("--example", action="store_true", help=example)
    parser.add_argument("--out", metavar="DIR", help=f"folder for the results (default: {FOLDER}/NAME OF RECORDING)")
    named = "a column of the file by its canonical name and unit, such as 'Dev1_ai0=u_ab' or 'n=omega_e [rpm]'"
    parser.add_argument("--column", metavar="NAME=CANONICAL", action="append", default=[], help=named)
    prior = "fleet.parquet of `fluxproof fleet` for the same drive file, used as prior"
    parser.add_argument("--prior", metavar="fleet.parquet", help=prior)
    parser.add_argument("--open", action="store_true", help="show the report in the browser")
    parser.add_argument("--quiet", action="store_true", help="no progress on stderr")
    parser.set_defaults(usage_error=parser.error)


def run(args: argparse.Namespace) -> int:
    """Diagnose, write the outputs, print the answer; returns 0."""
    check_inputs(args)
    from fluxproof.diagnosis.ingest.entries import entries_of

    named = entries_of(args.column)
    if not args.example:
        from fluxproof.diagnosis.loading.early import refuse_early

        refuse_early(args.recordings, args.drive, named)
    from fluxproof.diagnosis.ground.nominal import load_nominal
    from fluxproof.diagnosis.session import run as session

    out = Path(args.out) if args.out else FOLDER / "example" if args.example else default_folder(args.recordings)
    with Progress(quiet=args.quiet) as progress:
        recordings, drive = make_example(out, progress) if args.example else (args.recordings, args.drive)
        nominal = load_nominal(drive)
        nominal = dataclasses.replace(nominal, columns=nominal.columns | named)
        answer = session(recordings, nominal, out, progress, args.prior)
    lines = answer_lines(answer, nominal, out)
    if args.example:
        lines += example_lines(answer, recordings, drive)
    for line in lines:
        say(line)
    if args.open and not show(out / "report.html"):
        say(f"fluxproof: no browser can be opened; the report is {out / 'report.html'}", sys.stderr)
    return 0


def check_inputs(args: argparse.Namespace) -> None:
    """End with the usage unless there are a recording and a drive file, or --example in place of both."""
    if args.example and (args.recordings or args.drive):
        given = f"RECORDING {args.recordings[0]}" if args.recordings else f"--drive {args.drive}"
        args.usage_error(f"--example brings a recording and a drive file of its own: leave out {given}")
    needed = {"RECORDING": args.recordings, "--drive drive.toml": args.drive}
    missing = [name for name, value in needed.items() if not value]
    if missing and not args.example:
        needed = f"the following arguments are required: {', '.join(missing)}"
        args.usage_error(f"{needed} (or --example for a recording that is made here)")


def make_example(out: Path, progress) -> tuple[list[Path], Path]:
    """Write the example's recording and drive file to ``out``; ([recording], drive file)."""
    from fluxproof.diagnosis.example.recording import write

    progress("the golden core drives the motor of the example; the first run compiles it, some 50 s of processor time")
    example = write(out)
    return [example.recording], example.drive


def example_lines(answer, recordings: list[Path], drive: Path) -> list[str]:
    """What was hidden and what was found of it, and the ordinary command on the same files."""
    from fluxproof.diagnosis.example.truth import lines

    again = f"the same again: fluxproof diagnose {recordings[0]} --drive {drive}"
    return ["", *lines(answer.to_json()["effects"]), "", again]


def show(page: Path) -> bool:
    """Open a page in the browser; whether there is one."""
    return webbrowser.open(page.resolve().as_uri())


def default_folder(recordings) -> Path:
    """build/diagnosis/ and the first recording's name without its suffix."""
    more = f"_and_{len(recordings) - 1}_more" if len(recordings) > 1 else ""
    return FOLDER / f"{stem_of(recordings[0])}{more}"


class Progress:
    """The current step on stderr: one line that is updated on a terminal, else one line per new step."""

    def __init__(self, quiet=False, stream=None):
        self.stream = stream or sys.stderr
        self.quiet, self.updating, self.seen = quiet, self.stream.isatty(), set()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.updating and not self.quiet:
            self.stream.write("\r\x1b[K")
            self.stream.flush()

    def __call__(self, text: str) -> None:
        if self.quiet or (not self.updating and text in self.seen):
            return
        self.seen.add(text)
        text = printable(text, self.stream.encoding)
        self.stream.write(f"\r\x1b[K{text[:100]} ..." if self.updating else f"{text}\n")
        self.stream.flush()


def answer_lines(answer, nominal, out: Path) -> list[str]:
    """Headline, advice, effects, ambiguities, next recordings, misfit, findings and the files, as lines of text."""
    from fluxproof.diagnosis.ground.quantities import measured
    from fluxproof.diagnosis.ground.result import FILES
    from fluxproof.diagnosis.words.doubts import IMPLAUSIBLE

    lines = [answer.sentence, *([answer.advice] if answer.advice else [])]
    if answer.effects:
        lines += ["", *effect_table(answer.effects)]
    lines += [f"not separable: {', '.join(group)}" for group in answer.ambiguity]
    if answer.next_recording:
        lines += ["", "record next, each until steady:", *map(_request(nominal), answer.next_recording)]
    if answer.unknown_term is not None:
        u = answer.unknown_term
        form = f"the residual looks as if {u.meaning}:" if u.meaning else "best single term:"
        factor = "" if u.meaning else " with c"
        lines.append(f"{form} {u.formula}{factor} = {measured(u.value, u.sigma, u.unit)}")
    lines += [f"doubtful: {note}" for note in answer.notes if IMPLAUSIBLE in note]
    fit = answer.fit
    if answer.verdict not in ("bad_recording", "digital_mismatch"):
        lines.append(
            f"misfit at held-out operating points: {fit.holdout_before:.3g} {fit.unit} before, "
            f"{fit.holdout_after:.3g} {fit.unit} after, noise floor {fit.noise_floor:.3g} {fit.unit}"
        )
    if answer.prior is not None:
        lines += ["", f"prior: {answer.prior.drives} drives in {answer.prior.path}"]
        lines += map(_among, answer.prior.parameters)
    if answer.digital.checked and answer.digital.first_difference is None:
        lines.append(f"controller: {answer.digital.samples} samples equal to the golden model in every bit")
    lines += _problem_lines(answer.problems)
    # All files of FILES are those of this run, those of an earlier one are removed with it.
    return [*lines, "", *(f"wrote {out / name}" for name in FILES if (out / name).exists())]


def effect_table(effects) -> list[str]:
    """The reported effects, one line per parameter, in aligned columns."""
    from fluxproof.diagnosis.report.words import explained, measured, percent

    rows = [("effect", "parameter", "value", "confidence", "explains")]
    for effect in effects:
        name, sure, share = effect.name, percent(effect.confidence), explained(effect, effects)
        for key, e in effect.parameters.items():
            rows.append((name, key, measured(e.value, e.sigma, e.unit), sure, share))
            name = sure = share = ""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def _among(p) -> str:
    """Where a parameter stands among the other drives."""
    from fluxproof.diagnosis.ground.quantities import measured, quantity

    others = f"the others {quantity(p.mean, p.unit)} ± {quantity(p.spread, p.unit, 2)}"
    shrunk = measured(p.shrunk, p.shrunk_sigma, p.unit)
    return f"  {p.parameter} {measured(p.value, p.sigma, p.unit)}, {others}; combined {shrunk}, {abs(p.z):.1f} σ away"


def _request(nominal):
    """A function that formats a Request as a line, with the shaft speed in rpm."""
    from fluxproof.diagnosis.words.advice import point_text

    return lambda request: f"  {point_text(request, nominal)}: {request.why}"


def _problem_lines(problems) -> list[str]:
    """The first findings of the checks, fatal ones first; the rest is in the report."""
    shown = sorted(problems, key=lambda p: not p.fatal)
    lines = [f"recording: {p.message}{f' ({p.action})' if p.action else ''}" for p in shown[:MOST_PROBLEMS]]
    left = len(shown) - MOST_PROBLEMS
    return lines + ([f"recording: and {left} more findings, see the report"] if left > 0 else [])
