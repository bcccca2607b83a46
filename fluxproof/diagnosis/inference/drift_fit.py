# SPDX-License-Identifier: BSD-3-Clause
"""The fit of drifts at one operating point: the change of the misfit over time and of every effect's columns.

The mean over time is subtracted from both, after which an effect that does not drift has no columns left.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.balance.cells import voltage_level
from fluxproof.diagnosis.balance.orders import at_order
from fluxproof.diagnosis.catalogue.resistance_temperature import COPPER
from fluxproof.diagnosis.effects import MeasurementError
from fluxproof.diagnosis.ground import constants
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.inference.least_squares import Fitter, Model


def centred_cells(cells):
    """The cells with the mean over the blocks subtracted from the misfit and from all columns."""
    b = int(cells.block.max()) + 1

    def centre(x):
        table = x.copy()
        for order in np.unique(cells.order[cells.channel == "u"]):
            for part in (0, 1):
                rows = (cells.channel == "u") & (cells.order == order) & (cells.part == part)
                table[rows] -= table[rows].sum() / b
        return table

    columns = {n: {k: centre(c) for k, c in own.items()} for n, own in cells.columns.items()}
    return replace(cells, y=centre(cells.y), columns=columns)


def drifts(cells, centred, name, effect) -> bool:
    """Whether the usual formula of an effect changes over time at a constant operating point."""
    rows = (cells.channel == "u") & (cells.order == 0)
    cores = [k for k in cells.columns[name] if (name, k) not in cells.free]
    size = lambda c, k: float(np.linalg.norm(c.columns[name][k][rows]))  # noqa: E731
    return not isinstance(effect, MeasurementError) and any(
        size(centred, k) > constants.DRIFTS * max(size(cells, k), 1e-30) for k in cores
    )


def row_sigmas(view, cells, raw: Complex):
    """(r,) standard deviation [V]: of neighbouring means, and a share of the voltage for the balance itself."""
    step: Complex = np.diff(raw) if len(raw) > 1 else np.zeros(1, complex)
    each = [float(np.sqrt(np.nanmean(x**2) / 2.0)) for x in (step.real, step.imag)]
    own = constants.BALANCE_U * voltage_level(view) + constants.BALANCE_DC * view.nominal.inverter.dc_bus_v
    return np.hypot(np.array(each)[cells.part], own[cells.block])


def best_sets(fitter, effects, drifting, view):
    """(best solution, others within TIE) of all sets of drifting effects in core and free form."""
    solved = []
    for count in range(len(drifting) + 1):
        for names in itertools.combinations(drifting, count):
            bendable = [n for n in names if fitter.index[n][1]]
            for k in range(len(bendable) + 1):
                for free in itertools.combinations(bendable, k):
                    solution = fitter.solve(Model(frozenset(names), frozenset(free)))
                    fine = all(
                        effects[n].possible(solution.c[n], solution.covariance[n], view.nominal)
                        and not effects[n].too_large(solution.c[n], view)
                        for n in names
                    )
                    if fine:
                        solved.append(solution)
    spread = max(1.0, min(s.chi2 / max(s.rows - s.count, 1) for s in solved))
    for s in solved:
        s.score += s.chi2 / spread - s.chi2
    solved.sort(key=lambda s: s.score)
    best = solved[0]
    return best, [s for s in solved[1:] if s.score < best.score + constants.TIE and s.model.names != best.model.names]


def fuller(fitter, best, effects, drifting, view) -> list:
    """Solutions with one more drifting effect, which is always possible, although the fit does not need it."""
    more = [best.model.with_(n, free) for n in drifting if n not in best.model.names for free in (False, True)]
    solved = [fitter.solve(m) for m in more]
    return [s for s in solved if not any(effects[n].too_large(s.c[n], view) for n in s.model.names)]


def with_copper(fitter, best, cells, view) -> list:
    """The best model, solved on a winding that warms like copper: without i_d this resembles warming magnets.

    Not if the model contains the winding's warming already.
    """
    if not np.isfinite(view.temp).all() or view.machine.resistance_temp_coeff_per_k:
        return []
    share = COPPER * (view.temp - view.temp.mean()) * view.machine.resistance_ohm
    drop = np.stack([(view.i.mean(axis=1) * share).real, (view.i.mean(axis=1) * share).imag], axis=1)
    rows = (cells.channel == "u") & (cells.order == 0)
    copper = drop[cells.block[rows], cells.part[rows]]
    own = [c[rows] for n in best.model.names for c in fitter.cells.columns[n].values()]
    if any(
        np.linalg.norm(c) and c @ copper > constants.SAME_COLUMN * np.linalg.norm(c) * np.linalg.norm(copper)
        for c in own
    ):
        return []
    y = fitter.cells.y.copy()
    y[rows] -= copper
    changed = replace(fitter.cells, y=y)
    return [Fitter(changed, fitter.sigma, fitter.use).solve(best.model)]


def fitted(cells, solution):
    """(b,) complex misfit of a solution's columns, not centred [V]."""
    total = np.zeros(len(cells.y))
    for name, c in solution.c.items():
        for key, value in c.items():
            total = total + value * cells.columns[name][key]
    return at_order(cells, total, 0.0)
