"""Uses of a slow log's model: a flux map for the plant, bounds on effects that were not found, other splits."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from fluxproof.diagnosis.effects.effect import FluxEffect
from fluxproof.diagnosis.inference.fit import Model
from fluxproof.diagnosis.inference.slow_search import SlowSearch
from fluxproof.diagnosis.slow_diagnosis import axis_misfit
from fluxproof.plant import FluxMap

STEPS = (9, 41)  # of the map along i_d and i_q
ROUND = 0.15  # of rated current: half width of the map along an axis without current
SIGMAS = 2.0


def flux_map_of(search, solution) -> FluxMap | None:
    """The flux linkages of a solution as a map for the plant; None if no effect changes the flux.

    It covers the recorded currents and their mirror images, since the effects' formulas are odd or even in i_q.
    """
    magnetic = [n for n in solution.model.names if isinstance(search.effects[n], FluxEffect)]
    if not magnetic:
        return None
    m, seen = search.view.machine, solution.view.i
    edge = [max(np.abs(x).max(), ROUND * m.rated_current_a) for x in (seen.real, seen.imag)]
    axes = [np.linspace(-e, e, n) for e, n in zip(edge, STEPS, strict=True)]
    i = axes[0][:, None] + 1j * axes[1]
    psi = m.inductance_d_h * i.real + m.magnet_flux_wb + 1j * m.inductance_q_h * i.imag
    at = SimpleNamespace(i=i, machine=m, nominal=search.view.nominal, course=np.zeros(len(i)))
    for name in magnetic:
        psi = psi + search.effects[name].psi(at, solution.c[name])
    return FluxMap(*axes, psi.real.copy(), psi.imag.copy())


def bounds(search, found) -> dict[str, dict]:
    """{effect that is not in the best model: its estimate if it is added}.

    parameters: {name: [value, standard deviation, unit]}; score: change of the score, above 0 if the effect is not
    significant; refused: the reason why it cannot be added to the best model.
    """
    out = {}
    for name, effect in search.effects.items():
        if name in found.best.model.names or not search.linear.index[name][0]:
            continue
        solution = search.refine(Model(found.best.model.names | {name}, found.best.model.free))
        if not np.isfinite(solution.score):
            out[name] = {"refused": "its sign or size is impossible"}
            continue
        e = effect.estimates(
            solution.c[name], solution.covariance[name] * found.dispersion, search.view.nominal
        )
        out[name] = {
            "parameters": {k: [v.value, v.sigma, v.unit] for k, v in e.items()},
            "score": solution.score - found.best.score,
        }
    return out


def on_other_rows(view, model, train) -> tuple[SlowSearch, object, dict]:
    """(search, solution, misfit of the held-out rows) of a model fitted to the rows of ``train`` (b,) bool."""
    search = SlowSearch(view, train)
    solution = search.refine(model)
    return search, solution, axis_misfit(search, solution, ~train)
