# SPDX-License-Identifier: BSD-3-Clause
"""How frequent each effect is in a fleet, and the posterior of every recording with these rates.

Recording n has the evidence z_n(S) for each set S of extras.  Effect e is present in the share pi_e of the fleet:

    P_n(S) ~ z_n(S) prod_{e in S} pi_e / (1 - pi_e),    pi_e = (a + sum_n P_n(e)) / (a + b + N)

which expectation maximisation solves.  a / (a + b) is the prior rate of an effect; an effect seen nowhere else needs
stronger evidence than one that every third drive has; recordings are then judged with the rates of the fleet.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.ground import constants as k

STEPS, STANDS = 200, 1e-6


@dataclass(frozen=True)
class Weighed:
    """A recording in the light of its fleet: {extra: probability}, [(probability, set)] the most probable first."""

    present: dict[str, float]
    sets: list[tuple[float, dict]]

    @property
    def best(self) -> dict:
        return self.sets[0][1]


def prior_rate(count: float = 0.0, total: float = 0.0) -> float:
    """The rate of an effect of which ``count`` of ``total`` recordings have it."""
    return (k.RATE_WORTH * k.PRESENT + count) / (k.RATE_WORTH + total)


def weigh(rows: list[dict]) -> tuple[dict[str, float], list[Weighed | None]]:
    """({extra: rate}, for each row what the fleet makes of it; None where a row has no sets).

    A set that is not credible beside what it leaves counts in present by its credibility alone.
    """
    known = [row for row in rows if row["hypotheses"]]
    names = sorted({e for row in known for h in row["hypotheses"] for e in h["extras"]})
    rates = dict.fromkeys(names, prior_rate())
    for _ in range(STEPS):
        sums = defaultdict(float)
        for row in known:
            for effect, p in weighed(row, rates).present.items():
                sums[effect] += p
        new = {name: prior_rate(sums[name], len(known)) for name in names}
        moved = max((abs(new[n] - rates[n]) for n in names), default=0.0)
        rates = new
        if moved < STANDS:
            break
    return rates, [weighed(row, rates) if row["hypotheses"] else None for row in rows]


def weighed(row: dict, rates: dict[str, float]) -> Weighed:
    """A recording's sets at given rates."""
    sets = row["hypotheses"]
    value = np.array([h["evidence"] + sum(log_odds(rates[e]) for e in h["extras"]) for h in sets])
    p = np.exp(value - value.max())
    p /= p.sum()
    present: dict[str, float] = defaultdict(float)
    for share, h in zip(p, sets, strict=True):
        for effect, credible in zip(h["extras"], h["credible"], strict=True):
            present[effect] += float(share) * (credible if credible is not None else 0.0)
    order = np.argsort(-p, kind="stable")
    return Weighed(dict(present), [(float(p[n]), sets[n]) for n in order])


def log_odds(rate: float) -> float:
    return float(np.log(rate / (1.0 - rate)))
