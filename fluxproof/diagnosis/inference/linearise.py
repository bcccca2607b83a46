# SPDX-License-Identifier: BSD-3-Clause
"""Linear model of a recording: rows, columns, linearisations, independent of the constants in constants.py.

The steps of an inference are run by a function ``call(step, *arguments)``, by default ``at_once``.  A step is pure: its
result depends on its arguments and on the constants that it reads, so that a study may keep results (`make
sensitivity`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fluxproof.diagnosis.balance.cells import Cells, Projector, cells_of, columns_of, noise
from fluxproof.diagnosis.balance.curves import parabola
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.balance.shaft import MEASURED
from fluxproof.diagnosis.balance.view import View
from fluxproof.diagnosis.effects import LegLoss, MeasurementError
from fluxproof.diagnosis.effects.corrections import in_turn, with_flux
from fluxproof.diagnosis.effects.inverter import late_s
from fluxproof.diagnosis.ground.machine import rated_torque
from fluxproof.diagnosis.inference.least_squares import Fitter, everything


def at_once(step, *arguments):
    """Run a step of the inference."""
    return step(*arguments)


class Rows:
    """Blocks, functionals, misfit, columns and noise of a recording; train_blocks: (b,) bool, blocks of the fit."""

    def __init__(self, view, effects, train_blocks):
        self.view, self.effects = view, dict(effects)
        self.projector = Projector(view, loads=True)
        measured = bool(np.isin(view.shaft, MEASURED).all())
        self.load = 0.0 if measured else rated_torque(view.machine)
        self.train = train_blocks[self.projector.block]
        self.cells = cells_of(view, self.effects.values(), self.projector)
        plain = noise(view, self.cells, self.cells.y)
        # The ripple of a free shaft's acceleration is mostly noise, which a fit with equal weights would follow.
        bends = (self.cells.channel == "torque") & (self.cells.order != 0) & view.turns_freely[self.cells.block]
        rough = Fitter(self.cells, np.ones(len(bends)), ~bends).unscored(everything(self.cells))
        # Both bound the noise: the misfit also has what differs between neighbours, the rough fit what it fits wrongly.
        self.noise = np.minimum(noise(view, self.cells, rough.residual), plain)
        self.smooth = smooth(view)
        self.smooth_rows = self.projector.rows(misfit(self.smooth))


def smooth(view):
    """The view without noise: the parabolas of current and voltage over each block."""
    middle = np.exp(1j * view.interval_angle)
    u = parabola(view.u * np.conj(middle)) * middle
    i_abc = None if view.i_abc is None else view.phases(view.i)
    return view.replace(i_raw=view.stator(view.i), i_abc=i_abc, u=u)


@dataclass
class Linearisation:
    """The view and its columns around coefficients of a set of effects.

    totals: {effect: {coefficient: value}} of measurement errors; change, ripple: (r,) of the misfit, by what the
    corrections change in the smooth signals and beyond them; doubt: (b,) [V] of the curves, or None.
    """

    view: View
    cells: Cells
    totals: dict
    change: np.ndarray
    ripple: np.ndarray
    doubt: np.ndarray | None


def scaled(cells: Cells, scale) -> Cells:
    """The cells with misfit and columns times ``scale`` (r,)."""
    columns = {name: {key: scale * x for key, x in own.items()} for name, own in cells.columns.items()}
    return replace(cells, y=scale * cells.y, columns=columns)


def frozen(c) -> tuple:
    """{effect: {coefficient: value}} as a value that is equal if the coefficients are."""
    return tuple((name, tuple(own.items())) for name, own in c.items())


def linearised(rows: Rows, coefficients: tuple, names: tuple | None) -> Linearisation | None:
    """The columns of ``names`` (None: of all effects) around ``coefficients`` (see frozen); None: impossible ones."""
    effects, c = rows.effects, {name: dict(own) for name, own in coefficients}
    totals = {n: dict(own) for n, own in c.items() if isinstance(effects[n], MeasurementError)}
    view, plain = (in_turn(v, effects, totals, rows.view) for v in (rows.view, rows.smooth))
    if not (np.isfinite(view.u).all() and np.isfinite(view.i_raw).all()):
        return None
    late = sum(late_s(effects[n], own, view.nominal) for n, own in c.items())
    view = with_flux(view, effects, c, late_s=late)
    cells = cells_of(view, [e for n, e in effects.items() if names is None or n in names], rows.projector)
    # The balance stays in recorded units: one that a gain scales down leaves less, and is not better for that.
    kept = (view.voltage_kept, view.current_kept)
    volts, amps = (np.broadcast_to(share, (len(view), 1))[cells.block, 0] for share in kept)
    scale = 1.0 / np.where(cells.channel == "u", volts, np.where(cells.channel == "sum", amps, 1.0))
    cells = scaled(cells, scale)
    change = scale * rows.projector.rows(misfit(plain)) - rows.smooth_rows if totals else np.zeros(len(cells.y))
    ripple = cells.y - rows.cells.y - change
    kept = [n for n in c if not isinstance(effects[n], (MeasurementError, LegLoss)) and n in cells.electrical]
    if kept:
        rough, *_ = columns_of(view.with_raw_current(), [effects[n] for n in kept], rows.projector)
    for name in kept:
        even, raw = cells.columns[name], rough[name]
        for key, value in c[name].items():
            if value and key in even and key in raw:
                ripple -= value * (scale * raw[key] - even[key])
    doubts = [effects[n].doubt(own, view) for n, own in c.items()]
    doubt = np.sqrt(sum((np.square(d) for d in doubts), np.zeros(len(view)))) if doubts else None
    return Linearisation(view, cells, totals, change, ripple, doubt)
