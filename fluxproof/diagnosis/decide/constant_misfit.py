# SPDX-License-Identifier: BSD-3-Clause
"""The misfit of a single operating point that stays the same over time, and the effects that explain it alone.

The voltage that stays is two numbers, so that every effect with a column near their direction explains it with some
size.  A measurement error is far from linear, so that its size is found by steps, each on the corrected data.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.cells import cells_of, voltage_level
from fluxproof.diagnosis.balance.orders import at_order
from fluxproof.diagnosis.effects import MeasurementError, is_usual
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import NamedEffect

STEPS = 8  # of a measurement error; each leaves a fraction of the last one's change


def resolution(view) -> float:
    """Size of a constant misfit [V] that may be due to ripple or resolution."""
    return k.CONSTANT_DC * view.nominal.inverter.dc_bus_v + k.CONSTANT_U * float(voltage_level(view).mean())


def explaining(view, cells, effects, drifting, constant) -> tuple[NamedEffect, ...]:
    """Effects that do not drift and explain the constant misfit alone, with the size that each then has.

    None of a size that no drive has; of implausible sizes only if no other effect explains it.
    """
    found = [(_alone(view, cells, name, effects[name], constant), effects[name]) for name in sorted(effects)
             if name not in drifting]  # fmt: skip
    able = [(one, effect) for one, effect in found if one is not None]
    usual = [one for one, effect in able if is_usual(one.parameters, effect.plausible, view.nominal)]
    return tuple(usual or [one for one, _ in able])


def _alone(view, cells, name, effect, constant) -> NamedEffect | None:
    """One effect with the size that explains the constant misfit, None if it leaves more than the resolution."""
    keys = [key for key in cells.columns[name] if (name, key) not in cells.free]
    tried = [_by(view, cells, (name, key), effect, constant) for key in keys]
    return min((one for one in tried if one is not None), key=lambda one: -one.explains, default=None)


def _by(view, cells, at, effect, constant) -> NamedEffect | None:
    """The same by one coefficient of it, ``at`` = (effect, coefficient)."""
    name, key = at
    c = dict.fromkeys((other for other in cells.columns[name] if (name, other) not in cells.free), 0.0)
    moves, left, per_unit = isinstance(effect, MeasurementError), constant, 0.0
    for _ in range(STEPS if moves else 1):
        mean = complex(np.nanmean(at_order(cells, cells.columns[name][key], 0.0)))
        per_unit = abs(mean)
        if per_unit < 1e-9:
            return None
        step = (np.conj(mean) * left).real / per_unit**2
        c[key], left = c[key] + step, left - step * mean
        if effect.too_large(c, view):
            return None
        if moves:
            cells = cells_of(effect.corrected(view, c), [effect])
            left = complex(np.nanmean(at_order(cells, cells.y, 0.0)))
    limit = resolution(view)
    if abs(left) >= k.FITS * limit or not effect.possible(c, np.zeros((len(c),) * 2), view.nominal):
        return None
    covariance = np.diag([(limit / per_unit) ** 2 if other == key else 0.0 for other in c])
    share = float(np.clip(1.0 - abs(left / constant) ** 2, 0.0, 1.0))
    return NamedEffect(name, 0.5, effect.estimates(c, covariance, view.nominal), share)
