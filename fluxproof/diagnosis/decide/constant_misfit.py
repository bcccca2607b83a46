# SPDX-License-Identifier: BSD-3-Clause
"""The misfit of a single operating point that stays the same over time, and the effects that explain it alone."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.cells import voltage_level
from fluxproof.diagnosis.balance.orders import at_order
from fluxproof.diagnosis.ground import constants as k


def resolution(view) -> float:
    """Size of a constant misfit [V] that may be due to ripple or resolution."""
    return k.CONSTANT_DC * view.nominal.inverter.dc_bus_v + k.CONSTANT_U * float(voltage_level(view).mean())


def explaining(view, cells, effects, drifting, constant) -> list[str]:
    """Effects that do not drift and explain the constant misfit alone, with a size that a drive can have."""
    out, limit = [], resolution(view)
    for name, effect in effects.items():
        cores = {key: v for key, v in cells.columns[name].items() if (name, key) not in cells.free}
        if name in drifting or not cores:
            continue
        means = {key: complex(np.nanmean(at_order(cells, v, 0.0))) for key, v in cores.items()}
        most = max(means, key=lambda key: abs(means[key]))
        if abs(means[most]) < 1e-9:
            continue
        value = (np.conj(means[most]) * constant).real / abs(means[most]) ** 2
        c = {key: value if key == most else 0.0 for key in cores}
        close = abs(constant - value * means[most]) < k.FITS * limit
        if close and effect.possible(c, np.zeros((len(c),) * 2), view.nominal) and not effect.too_large(c, view):
            out.append(name)
    return sorted(out)
