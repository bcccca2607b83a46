# SPDX-License-Identifier: BSD-3-Clause
"""Which meanings of a data sheet's numbers agree: one flux linkage for all of them, or the contradiction by name."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

from fluxproof.constants.meanings import NUMBERS, Meaning
from golden_model.drive_keys import DriveError

AGREES = 0.03  # largest deviation from the mean: rounding, and magnets of another temperature
SAME = 0.01  # two readings of all numbers with one psi are one answer
FACTORS = {
    "sqrt(2): peak for rms": math.sqrt(2.0),
    "sqrt(3): between lines for a phase": math.sqrt(3.0),
    "2: between two terminals for a phase, or poles for pole pairs": 2.0,
    "1.5: torque of three phases for one of a bus": 1.5,
    "2 pi: per radian for per turn": 2.0 * math.pi,
    "sqrt(3/2): rms between lines for peak of a phase": math.sqrt(1.5),
}


@dataclass(frozen=True)
class Number:
    """A number of the data sheet; ``meanings`` that are possible."""

    kind: str
    value: float
    meanings: tuple[Meaning, ...]

    def shown(self, meaning: Meaning | None = None) -> str:
        """In words."""
        said = f"{self.kind} = {self.value:g} {NUMBERS[self.kind][0]}"
        return said if meaning is None else f"{said}, {meaning.says}"


@dataclass(frozen=True)
class Answer:
    """psi [Wb], the meaning of each number, the largest deviation from their mean."""

    psi: float
    meanings: tuple[Meaning, ...]
    deviation: float


def number(kind: str, value: float, stated: str | None) -> Number:
    """With the meaning that is stated, or all usual ones."""
    meanings = NUMBERS[kind][1]
    if stated is not None:
        meanings = tuple(m for m in meanings if m.name == stated)
        if not meanings:
            names = ", ".join(m.name for m in NUMBERS[kind][1])
            raise DriveError(f"--{kind.replace('_', '-')}: '{stated}' is no meaning of it: allowed is {names}")
    return Number(kind, value, meanings)


def answers(numbers: list[Number], pole_pairs: int) -> list[Answer]:
    """All readings in which the numbers agree, the best first; those with one psi once."""
    found = []
    for chosen in product(*(n.meanings for n in numbers)):
        values = [m.psi(n.value, pole_pairs) for n, m in zip(numbers, chosen, strict=True)]
        mean = math.exp(sum(map(math.log, values)) / len(values))
        deviation = max(abs(v / mean - 1.0) for v in values)
        if deviation <= AGREES:
            found.append(Answer(mean, chosen, deviation))
    found.sort(key=lambda a: a.deviation)
    kept: list[Answer] = []
    for answer in found:
        if all(abs(answer.psi / other.psi - 1.0) > SAME for other in kept):
            kept.append(answer)
    return kept


def contradiction(numbers: list[Number], pole_pairs: int) -> str:
    """Two numbers that fit in no reading, and the factor that is between their usual ones."""
    psis = [(n.meanings[0].psi(n.value, pole_pairs), n) for n in numbers]
    low, high = min(psis, key=lambda pair: pair[0]), max(psis, key=lambda pair: pair[0])
    ratio = high[0] / low[0]
    near = min(FACTORS, key=lambda name: abs(math.log(ratio / FACTORS[name])))
    pairs = [k for k in range(2, 22) if abs(ratio / k - 1.0) < AGREES]
    guess = ""
    if abs(ratio / FACTORS[near] - 1.0) < AGREES:
        guess = f", which is {near}"
    elif pairs:
        guess = f", as for {pairs[0]} times as many pole pairs, or poles for pairs"
    return (
        f"the numbers contradict each other: {low[1].shown(low[1].meanings[0])} gives psi = {low[0]:.4g} Wb, "
        f"{high[1].shown(high[1].meanings[0])} gives {high[0]:.4g} Wb, {ratio:.3g} times as much{guess}"
    )
