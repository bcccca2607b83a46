"""The flux map that a diagnosis found: the nominal flux linkage and that of the named magnetic effects, as a table.

    write_flux_map(answer, out)     # OUT/flux_map.csv, if a named effect bends the flux; returns its path or None

The columns are those of plant.FluxMap, and a drive file reads the table with

    [plant.machine]
    flux_map = "flux_map.csv"       # beside the drive file

The grid covers the recorded currents only: the curves are free, so that beyond them nothing is known.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fluxproof.diagnosis.answer.request import steady_view
from fluxproof.diagnosis.effects.effect import LEAST_CURRENT, FluxEffect
from fluxproof.files import write_text
from fluxproof.plant import FluxMap

NAME = "flux_map.csv"
HEADER = "i_d_a,i_q_a,psi_d_wb,psi_q_wb"
POINTS = 13  # along each axis


def flux_map_of(answer) -> FluxMap | None:
    """The map of a fast recording's answer; None if no named effect bends the flux or an axis had no current."""
    posterior = answer.search
    if posterior is None or not hasattr(posterior, "best"):
        return None
    best, effects = posterior.best(), posterior.setup.effects
    mine = [n for n in (e.name for e in answer.effects) if isinstance(effects[n], FluxEffect) and n in best.c]
    if not any(effects[n].bends for n in mine):
        return None
    view = posterior.setup.view
    seen, rated = view.i.mean(axis=1), view.machine.rated_current_a
    axes = [np.linspace(x.min(), x.max(), POINTS) for x in (seen.real, seen.imag)]
    if min(np.ptp(axis) for axis in axes) < LEAST_CURRENT * rated:
        return None
    i_d, i_q = (grid.ravel() for grid in np.meshgrid(*axes, indexing="ij"))
    at = steady_view(view, np.zeros(i_d.size), i_d + 1j * i_q, rows=1)
    psi = at.nominal_psi + sum(effects[n].psi(at, best.c[n]) for n in mine)
    psi = psi[:, 0].reshape(POINTS, POINTS)
    return FluxMap(*axes, psi.real, psi.imag)


def write_flux_map(answer, out) -> Path | None:
    """Write OUT/flux_map.csv; without a map, remove that of an earlier run and return None."""
    path, chart = Path(out) / NAME, flux_map_of(answer)
    if chart is None:
        path.unlink(missing_ok=True)
        return None
    grids = [*np.meshgrid(chart.i_d_a, chart.i_q_a, indexing="ij"), chart.psi_d_wb, chart.psi_q_wb]
    rows = np.stack([grid.ravel() for grid in grids], axis=1)
    return write_text(path, "\n".join([HEADER, *(",".join(f"{x:.9g}" for x in row) for row in rows)]) + "\n")
