"""The residual of the best model: misfit before and after, and what is significant in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.balance import misfit
from fluxproof.diagnosis.cells import voltage_level
from fluxproof.diagnosis.effect import rated_torque
from fluxproof.diagnosis.result import Fit
from fluxproof.diagnosis.scan import Stray, row_residual, stray_order, stray_swing, stray_torque

GROUP_ROWS, GROUP_CHI2 = 12, 3.0
CURVE_LEFT = 0.06  # of the misfit's rms: residual attributed to curve shapes
CLAMPED_LEFT = 0.15  # the same with an inverter loss, which depends on the ripple near zero current
GROUP_SHARE = 0.4  # of a group's misfit: largest accepted residual of one channel and order


@dataclass
class Remains:
    """Residual (r,) of the best model with its cells, and its evaluation.

    reduced: chi^2 per degree of freedom on fitted rows.  group: channel and order with a large residual, or ''.
    stray: a misfit outside the cells' orders, or None.
    """

    cells: object
    residual: np.ndarray
    fit: Fit
    reduced: float
    group: str
    stray: Stray | None


def remains(search, found, held) -> Remains:
    """Residual of the best model of a search on its corrected data; held: (b,) blocks that were not fitted."""
    best = found.best
    fitter = search.fitter(best.view, [search.effects[n] for n in sorted(best.model.names)])
    cells, residual = fitter.cells, fitter.solve(best.model).residual
    use = cells.ok & found.train
    reduced = float(np.sum((residual[use] / found.sigma[use]) ** 2)) / max(use.sum() - best.count, 1)
    rows = row_residual(best.view, best, search.effects, misfit(best.view))
    fit = _fit(search, found, cells, residual, held)
    # A curve that explains most of a large misfit may leave a small residual anywhere.
    share = CLAMPED_LEFT if "dead_time" in best.model.names else CURVE_LEFT
    floor = share * fit.train_before if best.model.names else 0.0
    told = np.flatnonzero(search.doubt(best) <= CURVE_LEFT * fit.train_before)
    stray = _stray(best, best.view.take(told), rows[told], floor) or stray_torque(
        best.view, search.projector, cells, residual, found.sigma
    )
    least = _least(search.view)
    least["u"] = max(least["u"], floor)
    group = _standing_out(search, found, cells, residual, use, least)
    return Remains(cells, residual, fit, reduced, group, stray)


def _stray(best, view, rows, floor) -> Stray | None:
    """A misfit outside the cells' orders in the residual rows (b, m) of a view's blocks; None if there are none."""
    if not len(view):
        return None
    return stray_order(view, rows, floor, sorted(_known_orders(best, "u"))) or stray_swing(view, rows, floor)


def _standing_out(search, found, cells, residual, use, floor) -> str:
    """Channel and order with the largest relative residual, if it exceeds the noise and the curve tolerance."""
    chi, worst = (residual / found.sigma) ** 2, (0.0, "")
    for channel in np.unique(cells.channel):
        for order in np.unique(cells.order[cells.channel == channel]):
            rows = use & (cells.channel == channel) & (cells.order == order)
            if rows.sum() < GROUP_ROWS or abs(order) in _known_orders(found.best, channel):
                continue
            after = np.mean(residual[rows] ** 2) - np.mean(found.pure[rows] ** 2)
            before = np.mean(search.cells.y[rows] ** 2)
            if chi[rows].mean() > GROUP_CHI2 and after > max(GROUP_SHARE**2 * before, floor[channel] ** 2):
                worst = max(worst, (float(np.sqrt(after / before)), f"{channel} at order {order:g}"))
    return worst[1]


def _known_orders(best, channel) -> set[float]:
    """Electrical orders at which an effect of the best model has more harmonics than its core."""
    names = best.model.names
    if channel == "u" and names & {"emf_harmonics", "dead_time"}:
        return {12.0, 18.0, 24.0}
    return {float(h) for h in range(2, 38, 2)} if channel == "torque" and "cogging" in names else set()


def _least(view) -> dict[str, float]:
    """Smallest residual of practical interest, per channel."""
    m = view.machine
    torque = rated_torque(view.nominal)
    return {
        "u": 1e-3 * float(voltage_level(view).max()),
        "sum": 2e-3 * m.rated_current_a,
        "torque": 8e-3 * torque,
    }


def _fit(search, found, cells, residual, held) -> Fit:
    """Misfit before and after, rms over blocks of all its orders, on fitted and held-out blocks [V].

    The floor is the noise and the error of the balance, which no model can undercut.
    """

    def rms(values, blocks):
        use = cells.ok & (cells.channel == "u") & blocks[cells.block]
        power = np.bincount(cells.block[use], values[use] ** 2, minlength=len(blocks))[blocks]
        return float(np.sqrt(power.mean())) if len(power) else 0.0

    before = search.cells.y + search.adjust
    return Fit(
        "u_dq",
        "V",
        rms(before, ~held),
        rms(residual, ~held),
        rms(before, held),
        rms(residual, held),
        rms(search.unwidened, ~held),
    )
