# SPDX-License-Identifier: BSD-3-Clause
"""A set of effects fitted to one part of a log and tested on the rest; effects added to it; its flux linkage."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from fluxproof.diagnosis.effects import FluxEffect
from fluxproof.diagnosis.ground.machine import flux_linkage
from fluxproof.diagnosis.inference.converge import around, converged, fit_of_set
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.fitted_set import covariance_of, possible
from fluxproof.diagnosis.inference.setup import Setup
from fluxproof.plant import FluxMap

STEPS = (9, 41)  # of the map along i_d and i_q
ROUND = 0.15  # of rated current: half width of the map along an axis without current


def axis_misfit(fit, blocks) -> dict:
    """{"d", "q": {"before", "after"}}: rms of the blocks' mean misfit (b,) bool with and without a Fit [V]."""
    cells, left, out = fit.problem.setup.cells, fit.left(), {}
    for part, axis in enumerate("dq"):
        rows = (cells.channel == "u") & (cells.order == 0) & (cells.part == part) & blocks[cells.block]
        both = {"before": cells.y[rows], "after": left[rows]}
        out[axis] = {k: float(np.sqrt(np.mean(x**2))) if len(x) else float("nan") for k, x in both.items()}
    return out


def on_other_rows(view, effects, names, train) -> tuple[object, dict]:
    """(Fit, misfit of the held-out rows) of the effects ``names`` fitted to the blocks ``train`` (b,) bool."""
    fit = fit_of_set(Setup(view, effects, train), names)
    return fit, axis_misfit(fit, ~train)


def estimates_of(fit, only=None) -> dict:
    """{parameter: [value, standard deviation, unit]} of the effects of a Fit, or of those in ``only``."""
    found, nominal = {}, fit.problem.view.nominal
    for name in fit.names if only is None else only:
        effect = fit.problem.setup.effects[name]
        found |= effect.estimates(fit.c[name], covariance_of(fit, name, fit.cov), nominal)
    return {k: [e.value, e.sigma, e.unit] for k, e in found.items()}


def bounds(posterior) -> dict[str, dict]:
    """{effect that is not in the best set: its estimate if it is added}.

    parameters: {name: [value, standard deviation, unit]}; log_odds: of the set with the effect, below 0 if it is not
    there.  refused: the reason why it cannot be added.
    """
    best, out = posterior.best(), {}
    problem = around(posterior.setup, best)
    for name in problem.able():
        if name in best.names:
            continue
        fit = fit_set(problem, (*best.names, name))
        fit = converged(posterior.setup, fit, len(best.names)) or fit
        if not possible(fit):
            out[name] = {"refused": "its sign or size is impossible"}
            continue
        out[name] = {"parameters": estimates_of(fit, [name]), "log_odds": fit.value - best.value}
    return out


def flux_map_of(fit) -> FluxMap | None:
    """The flux linkages of a Fit as a map for the plant; None if no effect changes the flux.

    It covers the recorded currents and their mirror images, since the effects' formulas are odd or even in i_q.
    """
    effects, view = fit.problem.setup.effects, fit.problem.view
    magnetic = [n for n in fit.names if isinstance(effects[n], FluxEffect)]
    if not magnetic:
        return None
    m, seen = view.machine, view.i
    edge = [max(np.abs(x).max(), ROUND * m.rated_current_a) for x in (seen.real, seen.imag)]
    axes = [np.linspace(-e, e, n) for e, n in zip(edge, STEPS, strict=True)]
    i = axes[0][:, None] + 1j * axes[1]
    psi = flux_linkage(m, i)
    at = SimpleNamespace(i=i, machine=m, nominal=view.nominal, course=np.zeros(len(i)))
    for name in magnetic:
        psi = psi + effects[name].psi(at, fit.c[name])
    return FluxMap(*axes, psi.real.copy(), psi.imag.copy())
