"""Separates a wrong inductance from saturation, which have the same free form.

The excess over the nominal flux, divided by the current, is constant for a wrong inductance and vanishes with the
current for saturation.  Its ratio between the smallest and the largest recorded current decides; intermediate values
and recordings with one current level are ambiguous.  If the excess changes its sign or is far larger at small currents,
both are present.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.catalogue.saturation import q_curves
from fluxproof.diagnosis.effect import flux

LEAST = 0.08  # of rated current: smaller currents do not determine an excess flux
SPREAD = 1.35  # least ratio of the largest and the smallest current level
STRAIGHT, BENT = 0.68, 0.55  # ratio above which it is a wrong inductance, below which saturation

FAMILY = ("inductance_d", "inductance_q", "saturation")


OVER, UNDER = 1.35, -0.2  # ratio beyond which both are present
PART = 0.03  # of L: least size of each of the two
LEAST_GAIN = 30.0  # in chi^2 over the dispersion: least gain of a linear part in addition to any saturation


def axes_told(view) -> str:
    """The axes, of "dq", with enough current in a view to determine their flux."""
    i = view.i.mean(axis=1) / view.machine.rated_current_a
    return "".join(axis for axis, part in zip("dq", (i.real, i.imag), strict=True) if np.abs(part).max() > LEAST)


def surplus(solution, axis, x):
    """Excess over the nominal flux at currents x (per unit of rated current), in Wb per rated A."""
    out = np.zeros_like(x)
    own = solution.c.get(f"inductance_{axis}", {})
    out += own.get(f"delta_l_{axis}", 0.0) * x
    even = x * (x if axis == "d" else np.abs(x))
    out += own.get("bend_2", 0.0) * even + own.get("bend_3", 0.0) * x**3
    return out


def saturated(solution, axis, x, inductance):
    """The same for the coefficients of a saturation."""
    c = solution.c.get("saturation", {})
    powers = {"1": x, "2": x * np.abs(x) if axis == "q" else x**2, "2s": x * np.abs(x), "3": x**3, "5": x**5}
    return inductance * sum((c.get(f"{axis}_{k}", 0.0) * p for k, p in powers.items()), np.zeros_like(x))


def ratio(view, solution, axis) -> tuple[float, float]:
    """(ratio of the excess inductance at small and at large current, largest excess relative to L).

    The ratio is nan with only one current level.
    """
    x, shape, inductance = _ends(view, solution, axis)
    if not len(x):
        return np.nan, 0.0
    largest = float(np.max(np.abs(shape * x / x[1]))) / inductance
    if abs(x[1]) < SPREAD * abs(x[0]) or abs(shape[1]) < 1e-12:
        return np.nan, largest
    return float(shape[0] / shape[1]), largest


def has_both(view, solution, axis) -> bool:
    """Whether the curve of an axis needs both a wrong inductance and saturation."""
    value, _ = ratio(view, solution, axis)
    if not np.isfinite(value):
        return False
    x, shape, inductance = _ends(view, solution, axis)
    if UNDER < value < OVER and not (value > 1.0 and _levels_off(x, shape)):
        return False
    return bool(min(abs(shape[0]), abs(shape[1] - shape[0])) > PART * inductance)


def _levels_off(x, shape) -> bool:
    """Whether an excess that falls from a smaller to a larger current would fall far up to rated current.

    Between two similar currents it can fall only little; the fall from zero to rated current along a parabola decides.
    """
    bend = (shape[1] - shape[0]) / (x[1] ** 2 - x[0] ** 2)
    straight = shape[0] - bend * x[0] ** 2
    return bool((straight + bend) / straight < 1.0 / OVER)


def _ends(view, solution, axis):
    """(smallest and largest current recorded [rated], surplus inductance at both [H], inductance [H])."""
    m = view.machine
    i = view.i.mean(axis=1)
    levels = (i.real if axis == "d" else i.imag) / m.rated_current_a
    levels = levels[np.abs(levels) > LEAST]
    inductance = getattr(m, f"inductance_{axis}_h")
    if not len(levels):
        return levels, levels, inductance
    x = np.array([levels[np.argmin(np.abs(levels))], levels[np.argmax(np.abs(levels))]])
    if axis == "d":
        x = np.sign(x[1]) * np.abs(x)
    return x, (surplus(solution, axis, x) + saturated(solution, axis, x, inductance)) / x, inductance


def labels(view, solution, least=0.012) -> tuple[set[str], bool]:
    """(names that follow from the solution's curves, whether they are certain)."""
    names, sure = set(), True
    for axis in "dq":
        value, size = ratio(view, solution, axis)
        if size < least:
            continue
        if has_both(view, solution, axis):
            names |= {f"inductance_{axis}", "saturation"}
        elif not np.isfinite(value):
            names.add(f"inductance_{axis}")
            sure = False
        elif value >= STRAIGHT:
            names.add(f"inductance_{axis}")
        else:
            names.add("saturation")
            sure &= value <= BENT
    return names, sure


def straight_beside_saturation(search, solution) -> bool:
    """Whether the q axis has a wrong inductance in addition to saturation of any curve.

    The excess flux of saturation vanishes faster than the current; |i| i, i^3 and i^5 represent any such curve.
    """
    f = search.fitter(solution.view, [search.effects[n] for n in sorted(solution.model.names)])
    axis = {("inductance_q", key) for key in ("delta_l_q", "bend_2", "bend_3")}
    axis |= {("saturation", f"q_{key}") for key in (1, 2, 3, 5)}
    kept = [k for k in f.carried(solution.model) if (f.owner[k], f.names[k].lstrip("~")) not in axis]
    view = solution.view
    powers = [search.projector.rows(flux(view, psi))[f.use] / f.sigma[f.use] for psi in q_curves(view)]
    if not all(row.any() for row in powers):
        return False
    straight, *bent = (row / np.linalg.norm(row) for row in powers)
    a = np.column_stack([f.a[:, kept], *bent, straight])
    c, *_ = np.linalg.lstsq(a, f.y, rcond=None)
    without, *_ = np.linalg.lstsq(a[:, :-1], f.y, rcond=None)
    gain = float(np.sum((f.y - a[:, :-1] @ without) ** 2) - np.sum((f.y - a @ c) ** 2))
    return bool(gain > LEAST_GAIN * search.dispersion and abs(c[-1]) > PART * np.linalg.norm(powers[0]))
