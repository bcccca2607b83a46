# SPDX-License-Identifier: BSD-3-Clause
"""How credible an effect is: the probability that it is real, and no imitation by something unknown.

A fleet counts a set by it (fleet/rates.py), and so does a verdict on a misfit of which much is left (verdict.py).
Where much of the misfit is left, something unknown is at work, and a part of it may look like an effect: a residual of
the rms D, lying along the columns of an effect whose contribution has the rms A, would imitate it with the probability
exp(-(A / D)^2 / 8).  An effect twice as large as what is left may still be an imitation, and one five times as large is
not.  The rules below say how much of the residual counts in D, each with the case that needs it.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from fluxproof.diagnosis.ground import constants as k


def credibilities(fit) -> dict[str, float]:
    """{effect of a fit: probability in (0, 1] that it is real and not an artefact of the unexplained residual}."""
    powers, real = _powers(fit), 1.0 - k.IMITATED
    found = {name: _credibility(fit, name, powers) for name in fit.names}
    sure = {name for name, p in found.items() if p >= real}
    for name in set(found) - sure:
        found[name] = _credibility(fit, name, powers, sure)
    return found


def _credibility(fit, name, powers, sure: Collection[str] = frozenset()) -> float:
    """Probability that an effect is no imitation; sure: effects that are none, and may leave an error of their own.

    It is judged in each channel, means and contrasts apart, and that in which the effect is strongest decides.
    """
    p, power = fit.problem.p, powers[name]
    level2 = np.bincount(p.group, p.level**2, minlength=len(p.groups))
    level2 /= np.maximum(np.bincount(p.group, minlength=len(p.groups)), 1)
    unusual = _beyond_the_usual_error(fit)
    beside = _beside(unusual, [powers[n] for n in fit.names if n != name])
    left = _error_of_surer_effects(fit, name, unusual, powers, sure)
    best = (0.0, 1.0)
    for channel, contrast in sorted({(channel, contrast) for channel, _, contrast in p.groups}):
        mine = np.array([(c, x) == (channel, contrast) for c, _, x in p.groups])
        total = power[mine].sum()
        if total <= 0.0:
            continue
        own = mine & (power >= k.LIVES * total)
        away = beside[mine & ~own].sum()
        away += _changes_between_visits(left, own, contrast, p.groups)
        remains = left[own].sum() + _weight_elsewhere(channel) * away
        strength = total / level2[mine].mean()
        if strength > best[0]:
            best = (strength, 1.0 - np.exp(-total / (2.0 * k.IMITATION**2 * remains)) if remains > 0.0 else 1.0)
    return float(best[1])


def _beyond_the_usual_error(fit) -> np.ndarray:
    """(groups,) power of the residual that counts: what exceeds the error of the balance, which every recording has.

    Without it nothing would be credible in a long recording of a healthy drive's size; errors of curves count as they
    are, as a loss at currents within their ripple is wrong by any amount.
    """
    p, lam = fit.problem.p, fit.lam
    return np.where(lam > k.USUAL, lam**2 - 1.0, 0.0) * _power(p, p.level) + fit.mu**2 * _power(p, p.doubt)


def _error_of_surer_effects(fit, name, left, powers, sure) -> np.ndarray:
    """(groups,) what counts of a residual beside surer effects, whose error it may be, along their columns.

    If these hold the share r of what the effect explains, r + (1 - r) D^2 / (D^2 + E^2) counts, E their contribution:
    EMF harmonics beside a dead time (r below 0.07) were withheld for the error of its curve, while a resistance beside
    it (r = 0.999) may be that error.
    """
    if not sure:
        return left
    along = _along(fit, name, sure)
    return along * left + (1.0 - along) * _beside(left, [powers[n] for n in sure])


def _weight_elsewhere(channel) -> float:
    """Weight of the residual outside the effect's own orders: physics that is wrong there may be wrong here too.

    None in the torque: the quantisation of an angle fills its high orders, and is no physics of the shaft.
    """
    return 0.0 if channel == "torque" else k.ELSEWHERE


def _changes_between_visits(left, own, contrast, groups) -> float:
    """Power of what changes between visits to a point in the effect's own orders, and is not explained.

    A part of a drift that nobody knows is in the mean of its visits too, where it would be named as a constant error.
    """
    if contrast:
        return 0.0
    orders = {groups[n][:2] for n in np.flatnonzero(own)}
    changed = np.array([contrasts and (channel, order) in orders for channel, order, contrasts in groups], bool)
    return left[changed].sum()


def _powers(fit) -> dict[str, np.ndarray]:
    """{effect: (groups,) power of what it explains}, of both components of an order together.

    No more than the set explains there: what effects cancel of each other explains nothing.  Crosstalk of the sensors
    was told as a late voltage and an early angle of twice a period, of which one tenth did not cancel.
    """
    p, owners = fit.problem.p, np.array([fit.problem.keys[n][0] for n in fit.take])
    whole = _power(p, p.x[:, fit.take] @ fit.vector)
    mine = {n: _power(p, p.x[:, fit.take[owners == n]] @ fit.vector[owners == n]) for n in fit.names}
    return {n: np.minimum(power, whole) for n, power in mine.items()}


def _power(p, rows) -> np.ndarray:
    """(groups,) mean squares of rows, of both components of an order together."""
    functionals = np.array([2.0 if order == 0 else 4.0 for _, order, _ in p.groups])
    count = np.maximum(np.bincount(p.group, minlength=len(p.groups)), 1)
    return np.bincount(p.group, rows**2, minlength=len(p.groups)) / count * functionals


def _beside(left, others) -> np.ndarray:
    """(groups,) what counts of the power ``left`` where the powers ``others`` are explained."""
    return left * left / np.maximum(left + sum(others), 1e-300)


def _along(fit, name, others) -> float:
    """Share of what an effect explains, as power over that of the errors, that lies along the columns of ``others``."""
    owners = np.array([fit.problem.keys[n][0] for n in fit.take])
    weighted = fit.problem.p.x[:, fit.take] / np.sqrt(fit.variance)[:, None]
    mine, theirs = weighted[:, owners == name] @ fit.vector[owners == name], weighted[:, np.isin(owners, list(others))]
    left = mine - theirs @ np.linalg.lstsq(theirs, mine, rcond=None)[0]
    return 1.0 - float(left @ left) / max(float(mine @ mine), 1e-300)
