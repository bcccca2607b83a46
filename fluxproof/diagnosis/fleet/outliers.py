# SPDX-License-Identifier: BSD-3-Clause
"""Drives that differ from the rest of their fleet, and why.

Two questions are asked of every drive.  Is a parameter outside of what the other drives predict (population.py)?  Of
all these tests the Benjamini-Hochberg procedure keeps the share of false ones below FLEET_FALSE.  Does it have an
effect that few drives have?  The fleet's posterior (rates.py) says so with the probability of being wrong, and effects
are told as long as the mean of these probabilities is below FLEET_FALSE.  Where an effect and its companions leave more
than half of what there is beside the spread of manufacture, something unknown is at work, which they may imitate: they
are not told.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from fluxproof.diagnosis.fleet.hypotheses import BASE
from fluxproof.diagnosis.fleet.rates import Weighed
from fluxproof.diagnosis.ground import constants as k


@dataclass(frozen=True)
class Finding:
    """Why a drive differs.  parameter: '' if the effect as such is what differs; doubt: probability of being false.

    mean, spread: of the other drives; z: distance in predictive standard deviations; nan where there is no parameter.
    """

    serial: str
    effect: str
    parameter: str
    value: float
    sigma: float
    unit: str
    mean: float
    spread: float
    z: float
    doubt: float


def outliers(populations, present: dict[str, dict[str, float]], values, rates) -> dict[str, list[Finding]]:
    """{serial: findings, the surest first}, the drives with the least doubt first.

    present: {serial: {extra: probability}}; values: {(effect, parameter): {serial: (value, sigma, unit)}}.
    """
    found = [*_sizes(populations, rates), *_presences(present, values, rates)]
    out: dict[str, list[Finding]] = {}
    for finding in sorted(found, key=lambda f: (f.doubt, -abs(np.nan_to_num(f.z)), f.serial, f.effect, f.parameter)):
        out.setdefault(finding.serial, []).append(finding)
    return out


def explains(weighed: Weighed | None) -> bool:
    """Whether the most probable set of a recording explains most of what there is beside the spread of manufacture."""
    return weighed is not None and (weighed.best["left_share"] or 0.0) <= 1.0 - k.HALF


def common(effect, rates) -> bool:
    """Whether an effect belongs to every drive of the design."""
    return effect in BASE or rates.get(effect, 0.0) >= k.COMMON


def _sizes(populations, rates) -> list[Finding]:
    tests = [
        (pop, n) for pop in populations if common(pop.effect, rates) and len(pop.x) >= k.OUTLIER_DRIVES
        for n in range(len(pop.x))
    ]  # fmt: skip
    if not tests:
        return []
    adjusted = stats.false_discovery_control([pop.p[n] for pop, n in tests])
    return [
        Finding(pop.serials[n], pop.effect, pop.parameter, float(pop.x[n]), float(pop.s[n]), pop.unit, pop.mean,
                pop.spread, float(pop.z[n]), float(q))
        for (pop, n), q in zip(tests, adjusted, strict=True) if q <= k.FLEET_FALSE
    ]  # fmt: skip


def _presences(present, values, rates) -> list[Finding]:
    if len(present) < k.OUTLIER_DRIVES:
        return []
    doubts = sorted(
        (1.0 - p, serial, effect)
        for serial, mine in present.items() for effect, p in mine.items() if p > 0.5 and not common(effect, rates)
    )  # fmt: skip
    mean = np.cumsum([d for d, _, _ in doubts]) / np.arange(1, len(doubts) + 1)
    out = []
    for doubt, serial, effect in doubts[: int(np.searchsorted(mean, k.FLEET_FALSE, side="right"))]:
        key = next((key for key in values if key[0] == effect and serial in values[key]), None)
        value, sigma, unit = values[key][serial] if key else (float("nan"), float("nan"), "")
        parameter = key[1] if key else ""
        nan = float("nan")
        out.append(Finding(serial, effect, parameter, value, sigma, unit, nan, nan, nan, float(max(doubt, 0.0))))
    return out
