# SPDX-License-Identifier: BSD-3-Clause
"""The subcommand ``fluxproof constants``: [machine] of a drive file from the numbers of a data sheet.

Exit status: 0 written, 1 where the numbers contradict each other or leave it open which meaning is right, 2 bad input.
"""

from __future__ import annotations

import argparse
import math
import sys

from fluxproof.constants.decide import Answer, Number, answers, contradiction, number
from fluxproof.constants.meanings import NUMBERS, RPM
from fluxproof.quote import say
from golden_model.drive_keys import DriveError

HELP = {
    "ke": "voltage constant [V/krpm]",
    "ke_rad": "voltage constant [V s/rad of the shaft]",
    "kt": "torque constant [Nm/A]",
    "kv": "speed constant [rpm/V]",
    "v_per_hz": "rated flux [V/Hz], as TI's user.h has it",
}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the subcommand."""
    pairs = parser.add_mutually_exclusive_group(required=True)
    pairs.add_argument("--pole-pairs", type=int, metavar="N")
    pairs.add_argument("--poles", type=int, metavar="N", help="twice as many, as data sheets of small motors have it")
    for kind, text in HELP.items():
        option, names = kind.replace("_", "-"), ", ".join(m.name for m in NUMBERS[kind][1])
        parser.add_argument(f"--{option}", nargs="+", metavar=("VALUE", "MEANING"), help=f"{text}; meaning: {names}")
    parser.add_argument("--no-load", nargs=2, type=float, metavar=("RPM", "BUS_V"), help="no-load speed on a bus")
    parser.add_argument("--r-terminals", type=float, metavar="OHM", help="between two terminals, star or delta")
    parser.add_argument("--r-winding", type=float, metavar="OHM", help="of one winding: a phase of a star, see --delta")
    parser.add_argument("--l-terminals", nargs="+", type=float, metavar="H", help="the same; two: least and most")
    parser.add_argument("--l-winding", type=float, metavar="H")
    parser.add_argument("--delta", action="store_true", help="--r-winding and --l-winding are of a delta")
    parser.add_argument("--current", nargs=2, metavar=("A", "rms|peak"), help="rated current of a line")
    parser.add_argument("--speed", type=float, metavar="RPM", help="rated speed")
    parser.add_argument("--inertia", type=float, metavar="KGM2", help="of the rotor")


def run(args: argparse.Namespace) -> int:
    """Say what was found, then [machine]."""
    pairs = _pole_pairs(args)
    numbers = _numbers(args)
    found = answers(numbers, pairs)
    if not found:
        say(f"fluxproof: {contradiction(numbers, pairs)}", sys.stderr)
        return 1
    if len(found) > 1:
        say(f"fluxproof: {_open(numbers, found)}", sys.stderr)
        return 1
    for line in _machine(args, pairs, numbers, found[0]):
        say(line)
    return 0


def _pole_pairs(args: argparse.Namespace) -> int:
    if args.poles is not None and args.poles % 2:
        raise DriveError(f"--poles {args.poles}: allowed is an even number")
    pairs = args.pole_pairs if args.poles is None else args.poles // 2
    if not 1 <= pairs <= 63:
        raise DriveError(f"{pairs} pole pairs: allowed is 1 to 63")
    return pairs


def _positive(option: str, text: str | float) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (value > 0.0 and math.isfinite(value)):
        raise DriveError(f"--{option} {text}: allowed is a number above 0")
    return value


def _numbers(args: argparse.Namespace) -> list[Number]:
    """What tells psi."""
    numbers = []
    for kind in NUMBERS:
        given, option = getattr(args, kind), kind.replace("_", "-")
        if given is None:
            continue
        if len(given) > 2:
            raise DriveError(f"--{option}: allowed is a value and its meaning")
        numbers.append(number(kind, _positive(option, given[0]), given[1] if len(given) > 1 else None))
    if args.no_load is not None:
        rpm, bus = (_positive("no-load", value) for value in args.no_load)
        numbers.append(number("kv", rpm / bus, "line-peak"))
    if not numbers:
        raise DriveError("none of --ke, --ke-rad, --kt, --kv, --v-per-hz, --no-load is given: one of them tells psi")
    return numbers


def _open(numbers: list[Number], found: list[Answer]) -> str:
    """Several readings: which, and what would decide."""
    told = "; or ".join(
        f"psi = {a.psi:.4g} Wb ({', '.join(n.shown(m) for n, m in zip(numbers, a.meanings, strict=True))})"
        for a in found
    )
    more = "state the meaning of one number" if len(numbers) > 1 else "state its meaning or give a second number"
    return f"open: {told}: {more}"


def _of_winding(args: argparse.Namespace, terminals: float | None, winding: float | None, option: str) -> float | None:
    """R or L of a phase in star."""
    if terminals is not None and winding is not None:
        raise DriveError(f"--{option}-terminals and --{option}-winding are both given: allowed is one of them")
    if terminals is not None:
        return _positive(f"{option}-terminals", terminals) / 2.0
    if winding is None:
        return None
    return _positive(f"{option}-winding", winding) / (3.0 if args.delta else 1.0)


def _machine(args: argparse.Namespace, pairs: int, numbers: list[Number], answer: Answer) -> list[str]:
    """[machine] as lines of TOML, with the reading in comments; what is missing is a comment too."""
    read = [n.shown(m) for n, m in zip(numbers, answer.meanings, strict=True)]
    lines = [f"# {text}" for text in read]
    if len(numbers) > 1:
        lines.append(f"# they agree within {100.0 * answer.deviation:.1f} %")
    kt = 1.5 * pairs * answer.psi
    lines.append(
        f"# cross-check: {kt:.4g} Nm per peak ampere, {kt * math.sqrt(2.0):.4g} per rms ampere; "
        f"{pairs * answer.psi * math.sqrt(1.5) * 1000.0 * RPM:.4g} V/krpm rms between lines; "
        f"Kv {1.0 / (pairs * answer.psi * math.sqrt(3.0) * RPM):.4g} rpm/V"
    )
    terminals = args.l_terminals or []
    if len(terminals) > 2:
        raise DriveError("--l-terminals: allowed is one value, or the least and the most")
    ohm = _of_winding(args, args.r_terminals, args.r_winding, "r")
    l_d = _of_winding(args, min(terminals, default=None), args.l_winding, "l")
    l_q = _of_winding(args, max(terminals, default=None), args.l_winding, "l")
    current = None
    if args.current is not None:
        if args.current[1] not in ("rms", "peak"):
            raise DriveError(f"--current {' '.join(args.current)}: allowed is a number, then rms or peak")
        current = _positive("current", args.current[0]) * (math.sqrt(2.0) if args.current[1] == "rms" else 1.0)
    speed = None if args.speed is None else _positive("speed", args.speed) * RPM
    values = {
        "pole_pairs": pairs,
        "resistance_ohm": ohm,
        "inductance_d_h": l_d,
        "inductance_q_h": l_q,
        "magnet_flux_wb": answer.psi,
        "rated_current_a": current,
        "rated_speed_rad_s": speed,
        "inertia_kgm2": None if args.inertia is None else _positive("inertia", args.inertia),
    }
    lines.append("[machine]")
    for key, value in values.items():
        lines.append(f"# {key} is missing" if value is None else f"{key} = {value:.6g}")
    return lines
