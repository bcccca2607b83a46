# SPDX-License-Identifier: BSD-3-Clause
"""Which meanings of a data sheet's statements are consistent, and what contradicts the others.

Every combination of meanings is tried.  Two statements about one quantity agree if their values differ by no more than
the sum of their tolerances.  All combinations that agree and give the same machine are one answer; several machines are
an ambiguity, which is returned as such and never decided by habit.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

from fluxproof.constants.statements import ROOT2, ROOT3, Meaning, Statement
from golden_model.drive_keys import DriveError

MOST_COMBINATIONS = 20_000
# Checks that join several quantities add their tolerances: R is known to 10 % and less well when warm.
CHECK = 0.18
SAME = 0.07  # two machines that differ by less are one
NEAR = 0.06  # a ratio this close to a convention's factor, as a logarithm, is explained by it

# Ratios between two conventions, largest confusion first.
FACTORS = (
    (ROOT2, "one was an rms value and the other a peak value"),
    (ROOT3, "one was a line-to-line value and the other a phase value"),
    (ROOT3 / ROOT2, "one was a line-to-line rms value and the other the peak value of a phase"),
    (2 / ROOT3, "one was for block commutation (DC ampere) and the other for sinusoidal currents"),
    (ROOT3 * ROOT2, "one was the peak value of a line-to-line voltage and the other the rms value of a phase"),
    (2.0, "one was a line-to-line value and the other a phase value, or one counted poles for pole pairs"),
    (3.0, "one was a value of one winding in delta"),
    (2 * math.pi, "one was per Hz and the other per rad/s"),
    (1.5, "one lacked the factor 3/2 of three phases"),
)  # fmt: skip


@dataclass(frozen=True)
class Machine:
    """Values in SI units, star equivalent, peak values; None where nothing states them; ``meanings`` of each line."""

    pole_pairs: int
    psi: float
    r: float | None
    l_d: float | None
    l_q: float | None
    j: float | None
    i: float | None
    omega: float | None
    meanings: tuple[tuple[Statement, Meaning], ...] = field(compare=False, default=())


@dataclass(frozen=True)
class Contradiction:
    """Two statements, or one against the rest, that no usual meaning reconciles."""

    statement: Statement
    against: tuple[Statement, ...]
    ratio: float  # of the closest pair of values, above one
    reason: str  # "": no usual convention has this factor


@dataclass(frozen=True)
class Answer:
    """Machines that fit all statements (several: an ambiguity), or none and what contradicts what."""

    machines: tuple[Machine, ...]
    contradictions: tuple[Contradiction, ...] = ()


def solve(statements: list[Statement]) -> Answer:
    """The machines that the statements allow.  DriveError if they do not determine one at all."""
    _refuse_twice(statements)
    _require(statements)
    machines = _machines(statements)
    if machines:
        return Answer(tuple(machines))
    return Answer((), tuple(_contradictions(statements)))


ONCE = {
    "p": "the number of pole pairs",
    "r": "the resistance",
    "j": "the inertia",
    "omega": "the rated speed",
    "u": "the voltage",
}


def _refuse_twice(statements: list[Statement]) -> None:
    for target, what in ONCE.items():
        same = [s for s in statements if s.target == target]
        if len(same) > 1:
            raise DriveError(f"{what} is stated twice: {same[0].text!r} and {same[1].text!r}")


def _require(statements: list[Statement]) -> None:
    has = {s.target for s in statements}
    if "p" not in has:
        raise DriveError("the pole pairs are missing: add pole_pairs=5, or poles=10")
    if not has & {"p_psi", "psi"} and not {"omega_0", "u"} <= has:
        raise DriveError(
            "nothing states the magnet flux: add one of kt=2.98 Nm/Arms, ke=180 Vrms/krpm line, kv=300 rpm/V, "
            "flux=5.8 mWb, or n0=4380 rpm with u=24 V"
        )
    if "tau_m" in has and "j" not in has:
        raise DriveError("the mechanical time constant needs the inertia: add j=85 gcm2")


def _machines(statements: list[Statement]) -> list[Machine]:
    """All machines of combinations that agree, one for each that differs by more than SAME."""
    count = math.prod(len(s.meanings) for s in statements)
    if count > MOST_COMBINATIONS:
        raise DriveError(f"{count} combinations of meanings: say line or phase, rms or peak at some statements")
    found: list[Machine] = []
    for chosen in itertools.product(*(s.meanings for s in statements)):
        machine = _machine(list(zip(statements, chosen, strict=True)))
        if machine and not any(_same(machine, other) for other in found):
            found.append(machine)
    return found


def _machine(pairs: list[tuple[Statement, Meaning]]) -> Machine | None:
    """The machine of one combination of meanings; None if they contradict each other."""
    stated = {s.target: m.value for s, m in pairs}
    p = stated["p"]
    fluxes = flux_values(pairs)
    if any(abs(math.log(a / b)) > ta + tb for (a, ta), (b, tb) in itertools.combinations(fluxes, 2)):
        return None
    weights = [1 / t**2 for _, t in fluxes]
    psi = math.exp(sum(w * math.log(v) for (v, _), w in zip(fluxes, weights, strict=True)) / sum(weights))
    l_d, l_q = stated.get("l_d", stated.get("l")), stated.get("l_q", stated.get("l"))
    r, j = stated.get("r"), stated.get("j")
    for name, expected in checks(p, psi, r, l_d, j).items():
        if any(s.target == name and abs(math.log(m.value / expected)) > CHECK for s, m in pairs):
            return None
    return Machine(round(p), psi, r, l_d, l_q, j, stated.get("i"), stated.get("omega"), tuple(pairs))


def flux_values(pairs: list[tuple[Statement, Meaning]]) -> list[tuple[float, float]]:
    """(flux linkage in Wb, tolerance) of each statement about it."""
    p = next(m.value for s, m in pairs if s.target == "p")
    values = [(m.value / p, s.tolerance) for s, m in pairs if s.target == "p_psi"]
    values += [(m.value, s.tolerance) for s, m in pairs if s.target == "psi"]
    bus = next((m.value for s, m in pairs if s.target == "u"), None)
    if bus:
        values += [(bus / (ROOT3 * p * m.value), s.tolerance) for s, m in pairs if s.target == "omega_0"]
    return values


def checks(p: float, psi: float, r: float | None, inductance: float | None, j: float | None) -> dict[str, float]:
    """What the machine implies of quantities that a data sheet states beside R, L and psi."""
    implied = {}
    if r:
        implied["km2"] = 1.5 * (p * psi) ** 2 / r
        if j:
            implied["tau_m"] = j / implied["km2"]
        if inductance:
            implied["tau_e"] = inductance / r
    return implied


def _same(a: Machine, b: Machine) -> bool:
    def close(x, y):
        return x == y or (x is not None and y is not None and abs(math.log(x / y)) <= SAME)

    return all(close(getattr(a, n), getattr(b, n)) for n in ("pole_pairs", "psi", "r", "l_d", "l_q", "i"))


def _contradictions(statements: list[Statement]) -> list[Contradiction]:
    """Each statement without which the others agree; every pair of them if there is none."""
    optional = [s for s in statements if s.target in ("p_psi", "psi", "omega_0", "km2", "tau_m", "tau_e", "r")]
    culprits = []
    for one in optional:
        rest = [s for s in statements if s is not one]
        has = {s.target for s in rest}
        if (has & {"p_psi", "psi"} or {"omega_0", "u"} <= has) and (machines := _machines(rest)):
            culprits.append(_against(one, rest, machines))
    return culprits


def _against(one: Statement, rest: list[Statement], machines: list[Machine]) -> Contradiction:
    """How far a statement is from the machines of the rest, and which convention would explain it."""
    ratio = min((_ratio(one, meaning, machine) for machine in machines for meaning in one.meanings), key=_distance)
    ratio = max(ratio, 1 / ratio)
    shaft = "one was per rad/s of the shaft and the other electrical"
    known = (*FACTORS, (float(machines[0].pole_pairs), shaft))
    factor, reason = min(known, key=lambda entry: _distance(ratio / entry[0]))
    if _distance(ratio / factor) > NEAR:
        reason = ""
    kind = ("p_psi", "psi", "omega_0") if one.target in ("p_psi", "psi", "omega_0") else ("km2", "tau_m", "tau_e", "r")
    against = tuple(s for s in rest if s.target in kind) or tuple(s for s in rest if s.target in ("p_psi", "psi"))
    return Contradiction(one, against, ratio, reason)


def _distance(ratio: float) -> float:
    return abs(math.log(ratio))


def _ratio(one: Statement, meaning: Meaning, machine: Machine) -> float:
    """The value of a statement relative to what the machine implies."""
    p, psi = machine.pole_pairs, machine.psi
    if one.target == "p_psi":
        return meaning.value / (p * psi)
    if one.target == "psi":
        return meaning.value / psi
    if one.target == "omega_0":
        bus = next(m.value for s, m in machine.meanings if s.target == "u")
        return bus / (ROOT3 * p * meaning.value) / psi
    if one.target == "r":
        return meaning.value / _implied_resistance(machine)
    return meaning.value / checks(p, psi, machine.r, machine.l_d, machine.j).get(one.target, meaning.value)


def _implied_resistance(machine: Machine) -> float:
    """The resistance that the first check of a machine without one implies."""
    per_ohm = 1.5 * (machine.pole_pairs * machine.psi) ** 2
    for statement, meaning in machine.meanings:
        if statement.target == "km2":
            return per_ohm / meaning.value
        if statement.target == "tau_m" and machine.j:
            return meaning.value * per_ohm / machine.j
        if statement.target == "tau_e" and machine.l_d:
            return machine.l_d / meaning.value
    raise DriveError("a resistance contradicts nothing")
