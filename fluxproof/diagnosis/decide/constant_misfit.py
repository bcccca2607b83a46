# SPDX-License-Identifier: BSD-3-Clause
"""The misfit of a single operating point that stays the same over time, and the effects that explain it.

The voltage that stays is two numbers, so that every effect with a column near their direction explains it with some
size.  A measurement error is far from linear, so that its size is found by steps, each on the corrected data.  Where a
single effect explains it, two others may do so together: one point does not exclude them.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from fluxproof.diagnosis.balance.cells import cells_of, voltage_level
from fluxproof.diagnosis.balance.orders import at_order
from fluxproof.diagnosis.effects import MeasurementError, is_usual
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import NamedEffect

ACROSS = 0.2  # least sine of the angle between the columns of a pair
STEPS = 8  # of a measurement error; each leaves a fraction of the last one's change


def resolution(view) -> float:
    """Size of a constant misfit [V] that may be due to ripple or resolution."""
    return k.CONSTANT_DC * view.nominal.inverter.dc_bus_v + k.CONSTANT_U * float(voltage_level(view).mean())


def explaining(view, cells, effects, drifting, constant) -> tuple[NamedEffect, ...]:
    """Effects that do not drift and explain the constant misfit alone, with the size that each then has.

    None of a size that no drive has; of implausible sizes only if no other effect explains it.  Beside the only one
    stand those that explain it in pairs, each with its size in the pair in which it is smallest.
    """
    found = [(_alone(view, cells, name, effects[name], constant), effects[name]) for name in sorted(effects)
             if name not in drifting]  # fmt: skip
    able = [(one, effect) for one, effect in found if one is not None]
    usual = [one for one, effect in able if is_usual(one.parameters, effect.plausible, view.nominal)]
    alone = tuple(usual or [one for one, _ in able])
    if len(alone) != 1:
        return alone
    linear = {n: e for n, e in effects.items() if n not in (*drifting, alone[0].name)}
    return alone + _in_pairs(view, cells, linear, constant)


def _in_pairs(view, cells, effects, constant) -> tuple[NamedEffect, ...]:
    """Effects of one coefficient and a usual size that explain the constant misfit together with another one."""
    columns = {}
    for name, effect in effects.items():
        keys = [key for key in cells.columns[name] if (name, key) not in cells.free]
        if len(keys) == 1 and not isinstance(effect, MeasurementError):
            columns[name] = keys[0], complex(np.nanmean(at_order(cells, cells.columns[name][keys[0]], 0.0)))
    found: dict[str, tuple[float, NamedEffect]] = {}
    for pair in combinations(columns, 2):
        across = [columns[name][1] for name in pair]
        matrix = np.array([[x.real for x in across], [x.imag for x in across]])
        if not np.abs(np.linalg.det(matrix)) > ACROSS * abs(across[0] * across[1]):  # of one direction, or no column
            continue
        sizes = np.linalg.solve(matrix, [constant.real, constant.imag])
        named = [_sized(view, cells, n, {columns[n][0]: float(c)}, effects[n], 0j, constant)
                 for n, c in zip(pair, sizes, strict=True)]  # fmt: skip
        usual = [o for o in named if o and is_usual(o.parameters, effects[o.name].plausible, view.nominal)]
        if len(usual) < len(pair):
            continue
        for one, c, column in zip(usual, sizes, across, strict=True):
            size = abs(c * column)
            if one.name not in found or size < found[one.name][0]:
                found[one.name] = size, one
    return tuple(one for _, one in found.values())


def _alone(view, cells, name, effect, constant) -> NamedEffect | None:
    """One effect with the size that explains the constant misfit, None if it leaves more than the resolution."""
    keys = [key for key in cells.columns[name] if (name, key) not in cells.free]
    tried = [_by(view, cells, (name, key), effect, constant) for key in keys]
    return min((one for one in tried if one is not None), key=lambda one: -one.explains, default=None)


def _by(view, cells, at, effect, constant) -> NamedEffect | None:
    """The same by one coefficient of it, ``at`` = (effect, coefficient)."""
    name, key = at
    c = dict.fromkeys((other for other in cells.columns[name] if (name, other) not in cells.free), 0.0)
    moves, left = isinstance(effect, MeasurementError), constant
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
    if abs(left) >= k.FITS * resolution(view):
        return None
    return _sized(view, cells, name, c, effect, left, constant)


def _sized(view, cells, name, c, effect, left, constant) -> NamedEffect | None:
    """The effect with these coefficients, which leave ``left`` of the constant misfit; None where no drive has them."""
    moved = {key: abs(complex(np.nanmean(at_order(cells, cells.columns[name][key], 0.0)))) for key in c}
    zero = np.zeros((len(c),) * 2)
    if effect.too_large(c, view) or not effect.possible(c, zero, view.nominal):
        return None
    sigmas = [resolution(view) / moved[key] if value else 0.0 for key, value in c.items()]
    share = float(np.clip(1.0 - abs(left / constant) ** 2, 0.0, 1.0))
    return NamedEffect(name, 0.5, effect.estimates(c, np.diag(np.square(sigmas)), view.nominal), share)
