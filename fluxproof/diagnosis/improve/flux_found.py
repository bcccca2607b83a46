# SPDX-License-Identifier: BSD-3-Clause
"""The flux map that a diagnosis found: the nominal flux linkage and that of the named magnetic effects, as a table.

    write_flux_map(decision, out)   # OUT/flux_map.csv, if a named effect bends the flux; returns its path or None

The columns are those of plant.FluxMap, and a drive file reads the table with

    [plant.machine]
    flux_map = "flux_map.csv"       # beside the drive file

The grid covers the recorded currents only: the curves are free, so that beyond them nothing is known.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fluxproof.diagnosis.decide.decision import Decision
from fluxproof.diagnosis.effects import LEAST_CURRENT, BentFlux, FluxEffect
from fluxproof.diagnosis.plan.candidates import steady_view
from fluxproof.files import write_text
from fluxproof.plant import FluxMap

NAME = "flux_map.csv"
HEADER = "i_d_a,i_q_a,psi_d_wb,psi_q_wb"
POINTS = 13  # along each axis
WIDTH = 0.05  # rms distance of the currents from a line, in units of their range


def flux_map_of(decision: Decision) -> FluxMap | None:
    """The map of a decision; None if no effect of it bends the flux or the recorded currents cover no area."""
    effects, c, view, mine = _model(decision)
    if view is None or not mine:
        return None
    seen = view.i.mean(axis=1)
    axes = [np.linspace(x.min(), x.max(), POINTS) for x in (seen.real, seen.imag)]
    if not _covers_area(seen, view.machine.rated_current_a):
        return None
    i_d, i_q = (grid.ravel() for grid in np.meshgrid(*axes, indexing="ij"))
    at = steady_view(view, np.zeros(i_d.size), i_d + 1j * i_q, rows=1)
    psi = at.nominal_psi + sum(effects[n].psi(at, c[n]) for n in mine)
    psi = psi[:, 0].reshape(POINTS, POINTS)
    return FluxMap(axes[0], axes[1], psi.real, psi.imag)


def _model(decision: Decision):
    """(effects, their coefficients {effect: {coefficient: value}}, view, effects of the map) of a decision."""
    posterior = decision.posterior
    if posterior is None:
        return {}, {}, None, []
    best, setup = posterior.best(), posterior.setup
    magnetic = {n for n, effect in setup.effects.items() if isinstance(effect, FluxEffect)}
    asserted = {n for group in ([e.name for e in decision.effects], *decision.ambiguity) for n in group}
    mine = sorted(asserted & magnetic & set(best.names))
    # Effects that replace each other leave one flux, if none of the group is something else.
    split = any(magnetic & set(group) and not magnetic >= set(group) for group in decision.ambiguity)
    bent = not split and any(isinstance(setup.effects[n], BentFlux) for n in mine)
    return setup.effects, best.c, setup.view, mine if bent else []


def _covers_area(seen, rated) -> bool:
    """Whether currents (b,) [A] are on both axes, and on no line: the map between would be a guess."""
    sides = np.array([np.ptp(seen.real), np.ptp(seen.imag)])
    if sides.min() < LEAST_CURRENT * rated:
        return False
    scaled = np.stack([seen.real - seen.real.mean(), seen.imag - seen.imag.mean()]) / sides[:, None]
    return float(np.linalg.svd(scaled, compute_uv=False)[-1]) > WIDTH * np.sqrt(len(seen))


def write_flux_map(decision: Decision, out) -> Path | None:
    """Write OUT/flux_map.csv; None without a map."""
    path, chart = Path(out) / NAME, flux_map_of(decision)
    if chart is None:
        return None
    grids = [*np.meshgrid(chart.i_d_a, chart.i_q_a, indexing="ij"), chart.psi_d_wb, chart.psi_q_wb]
    rows = np.stack([grid.ravel() for grid in grids], axis=1)
    return write_text(path, "\n".join([HEADER, *(",".join(f"{x:.9g}" for x in row) for row in rows)]) + "\n")
