# SPDX-License-Identifier: BSD-3-Clause
"""``fluxproof constants NAME=VALUE...``: data-sheet numbers into [machine], and what of them does not fit together."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from fluxproof.constants.agree import Answer, Machine, checks, solve
from fluxproof.constants.statements import ROOT2, ROOT3, RPM, Statement, read
from fluxproof.files import write_text
from fluxproof.quote import put
from fluxproof.stage import alone

CHECKS_R = {"km2", "tau_m", "tau_e"}  # what states R beside r, see ``checks``
CONTRADICTS = 1  # exit status, also of an ambiguity: no [machine] is written
EXAMPLE = """\
one argument for each number, with its unit, and how it is meant where the data sheet states it:
  fluxproof constants poles=10 "kt=2.98 Nm/Arms" "ke=180 Vrms/krpm line" "r=0.76 ohm line" "l=12 mH line"
  fluxproof constants pole_pairs=7 "kv=270 rpm/V" "r=39 mohm phase" "l=15.7 uH phase"
names and units:
  pole_pairs, poles
  kt  Nm/A, Nm/Arms, Nm/Apk, mNm/A, oz-in/A, lb-in/A; dc (block commutation)      kv  rpm/V
  ke  V/krpm, V/rpm, mV/rpm, Vs/rad; Vrms, Vpk; line, phase      flux  Wb, mWb, V/Hz
  r  ohm, mohm; line, phase, winding      l, ld, lq  H, mH, uH; line, phase, winding
  j  kgm2, kgcm2, gcm2, oz-in-s2, lb-in-s2    i  A; rms, peak, dc    n  rpm (rated)    n0  rpm and u  V (no load)
checks: km  Nm/sqrtW    gradient  rpm/mNm    tau_m, tau_e  s, ms
Every number that is added is a check of the others."""


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.epilog = EXAMPLE
    parser.add_argument("statements", metavar="NAME=VALUE", nargs="+", help="a number of the data sheet, see below")
    parser.add_argument(
        "--connection", choices=("star", "delta"), default="star", help="of values of one winding (default star)"
    )
    parser.add_argument("--out", metavar="FILE", help="write [machine] to FILE")


def run(args: argparse.Namespace) -> int:
    """Print the machine, or the contradiction; 0 if there is exactly one machine."""
    statements = [read(text, args.connection) for text in args.statements]
    answer = solve(statements)
    if len(answer.machines) != 1:
        put("\n".join(_undecided(answer, statements)))
        return CONTRADICTS
    lines = machine_lines(answer.machines[0])
    if args.out:
        with alone(Path(args.out)) as file:
            write_text(file, "\n".join(lines) + "\n")
    put(
        "\n".join(
            [*lines, "", *read_as(answer.machines[0]), *implied_lines(answer.machines[0]), *doubts(answer.machines[0])]
        )
    )
    return 0


def machine_lines(machine: Machine) -> list[str]:
    """[machine] of a drive file; what the data sheet does not state is a comment with what is needed."""
    rows = [
        ("pole_pairs", machine.pole_pairs, ""),
        ("resistance_ohm", machine.r, "of a phase: not stated; add it, for example r=0.76 ohm line"),
        ("inductance_d_h", machine.l_d, "of a phase: not stated; add it, for example l=12 mH line, or ld and lq"),
        ("inductance_q_h", machine.l_q, "of a phase: not stated; add it, for example l=12 mH line, or ld and lq"),
        ("magnet_flux_wb", machine.psi, ""),
        ("rated_current_a", machine.i, "peak: not stated; add it, for example i=14.9 Arms"),
        ("rated_speed_rad_s", machine.omega, "of the shaft: not stated; add it, for example n=2350 rpm"),
        ("inertia_kgm2", machine.j, "of rotor and load: not stated; add it, for example j=85 gcm2"),
    ]
    stated = [f"{key} = {value:.6g}" if value is not None else f"# {key}: {need}" for key, value, need in rows]
    return ["[machine]", *stated]


def read_as(machine: Machine) -> list[str]:
    """How each statement with several usual meanings was read."""
    return [
        f"read {statement.text!r} as {meaning.words}"
        for statement, meaning in machine.meanings
        if meaning.words and len(statement.meanings) > 1
    ]


def implied_lines(machine: Machine) -> list[str]:
    """The same machine in the words of other data sheets, to compare with them."""
    p_psi = machine.pole_pairs * machine.psi
    lines = [
        f"torque constant {1.5 * p_psi:.4g} Nm/A peak, {1.5 * ROOT2 * p_psi:.4g} Nm/A rms, "
        f"{ROOT3 * p_psi:.4g} Nm/A of DC in block commutation",
        f"EMF between two lines {ROOT3 * p_psi * 1e3 * RPM:.4g} V peak, "
        f"{ROOT3 / ROOT2 * p_psi * 1e3 * RPM:.4g} V rms per 1,000 rpm; Kv {1 / (ROOT3 * p_psi * RPM):.4g} rpm/V",
    ]
    implied = checks(machine.pole_pairs, machine.psi, machine.r, machine.l_d, machine.j)
    if "km2" in implied:
        lines.append(f"motor constant {math.sqrt(implied['km2']):.4g} Nm/sqrt(W)")
    if "tau_m" in implied:
        lines[-1] += f", mechanical time constant {implied['tau_m'] * 1e3:.4g} ms"
    if "tau_e" in implied:
        lines[-1] += f", electrical time constant {implied['tau_e'] * 1e3:.4g} ms"
    return lines


def doubts(machine: Machine) -> list[str]:
    """What contradicts nothing and yet may be wrong: a resistance that no other number checks, or that takes most."""
    lines, targets = [], {statement.target for statement, _ in machine.meanings}
    if machine.r and not targets & CHECKS_R:
        lines.append("no number here checks the resistance: add km or gradient, tau_e with l, or tau_m with j")
    if machine.r and machine.i and machine.omega:
        drop, emf = machine.r * machine.i, machine.pole_pairs * machine.psi * machine.omega
        if drop > emf:
            lines.append(
                f"doubt: at rated current and speed the resistance takes {drop:.3g} V and the EMF is {emf:.3g} V "
                "(of a phase, peak): more heat than shaft power; check r, i and n"
            )
    return lines


def _undecided(answer: Answer, statements: list[Statement]) -> list[str]:
    if not answer.machines:
        return [*_contradiction(answer, statements), "no [machine] is given: check these numbers, or leave one out"]
    lines = [f"{len(answer.machines)} machines fit these numbers; no [machine] is given:"]
    for machine in answer.machines:
        values = {
            "magnet_flux_wb": machine.psi, "resistance_ohm": machine.r, "inductance_d_h": machine.l_d,
            "inductance_q_h": machine.l_q, "rated_current_a": machine.i,
        }  # fmt: skip
        lines.append("  " + ", ".join(f"{key} = {value:.4g}" for key, value in values.items() if value is not None))
        lines += [f"    {line}" for line in read_as(machine)]
    open_ones = [s for s in statements if len({_meaning(m, s) for m in answer.machines}) > 1]
    lines.append("say how it is meant: " + "; ".join(f"{s.text!r} {_choices(s)}" for s in open_ones))
    return lines


def _meaning(machine: Machine, statement: Statement) -> str:
    return next(meaning.words for one, meaning in machine.meanings if one is statement)


def _choices(statement: Statement) -> str:
    return "or ".join(f"{meaning.words} " for meaning in statement.meanings).strip()


def _contradiction(answer: Answer, statements: list[Statement]) -> list[str]:
    if not answer.contradictions:
        return ["these numbers contradict each other, and no single one is the cause"]
    lines = []
    for one in answer.contradictions:
        against = ", ".join(repr(s.text) for s in one.against)
        why = f"as if {one.reason}" if one.reason else "no usual convention has this factor"
        lines.append(f"{one.statement.text!r} is {one.ratio:.4g} times off against {against}: {why}")
    if len(answer.contradictions) == 2 and len({c.reason for c in answer.contradictions}) == 1:
        lines = lines[:1]  # the same sentence from the other side
    return lines
