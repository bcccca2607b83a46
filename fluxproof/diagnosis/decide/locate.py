# SPDX-License-Identifier: BSD-3-Clause
"""Location of the misfit: signal, harmonic orders, and regions of speed, current, temperature, bus and time."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.orders import at_order, harmonic, rms
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import Evidence, Location, OrderLine, Region


def _block_means(view):
    """{variable: ((b,), unit)} that may bound a region."""
    i = view.i.mean(axis=1)
    return {
        "omega_e": (view.omega.mean(axis=1), "rad/s"),
        "i_d": (i.real, "A"),
        "i_q": (i.imag, "A"),
        "u_dc": (view.u_dc.mean(axis=1), "V"),
        "temp_winding": (view.temp, "degC"),
        "t": (view.t, "s"),
    }


def locate(view, cells, pure) -> Location:
    """Location of the nominal drive's misfit."""
    y0 = at_order(cells, cells.y, 0.0)
    signal = "u_q" if rms(y0.imag) >= rms(y0.real) else "u_d"
    orders = []
    for order in np.unique(np.abs(cells.order[cells.channel == "u"])):
        both = [harmonic(view, cells, cells.y, s * order) for s in ((1,) if order == 0 else (1, -1))]
        quiet = [at_order(cells, pure, s * order) for s in ((1,) if order == 0 else (1, -1))]
        amplitude, floor = np.hypot(rms(both[0]), rms(both[1])) if order else rms(both[0]), max(map(rms, quiet))
        if amplitude > 3.0 * floor:
            orders.append(OrderLine(round(float(order), 4), float(amplitude), "V"))
    orders.sort(key=lambda line: -line.amplitude)
    return Location(signal, tuple(orders[:8]), _regions(view, y0))


def _regions(view, y0) -> tuple[Region, ...]:
    """For each variable the side of its best quartile on which the misfit is clearly larger."""
    out, power = [], np.abs(y0) ** 2
    for variable, (x, unit) in _block_means(view).items():
        good = np.isfinite(x) & np.isfinite(power)
        if good.sum() < 8 or np.ptp(x[good]) < 1e-6 * (np.abs(x[good]).max() + 1e-12):
            continue
        best = None
        for cut in np.unique(np.quantile(x[good], (0.25, 0.5, 0.75))):
            for side in (x <= cut, x > cut):
                a, b = power[good & side], power[good & ~side]
                if len(a) >= 3 and len(b) >= 3:
                    ratio = np.sqrt(a.mean() / max(b.mean(), 1e-30))
                    if best is None or ratio > best[0]:
                        best = (ratio, x[good & side], a, b)
        if best and best[0] > k.REGION:
            _, inside, a, b = best
            out.append(
                Region(
                    variable,
                    float(inside.min()),
                    float(inside.max()),
                    unit,
                    float(np.sqrt(a.mean())),
                    float(np.sqrt(b.mean())),
                )
            )
    return tuple(sorted(out, key=lambda r: -r.rms / max(r.rms_elsewhere, 1e-12))[:4])


def evidence(view, before, after, pure, holdout_blocks) -> Evidence:
    """Block means for the pictures: ``before`` and ``after`` are (cells, values) of the misfit."""
    (cells, y), (cells_after, left) = before, after
    y0, r0 = at_order(cells, y, 0.0), at_order(cells_after, left, 0.0)
    orders = np.unique(np.abs(cells.order[cells.channel == "u"]))

    def spectrum(c, values):
        return np.array(
            [
                np.hypot(rms(harmonic(view, c, values, h)), rms(harmonic(view, c, values, -h)) if h else 0.0)
                for h in orders
            ]
        )

    arrays = {name: x for name, (x, _) in _block_means(view).items() if np.isfinite(x).all()}
    arrays |= {
        "theta_e": np.mod(view.theta_mid.mean(axis=1), 2 * np.pi),
        "before_d": y0.real,
        "before_q": y0.imag,
        "after_d": r0.real,
        "after_q": r0.imag,
        "holdout": holdout_blocks,
        "noise": np.array(rms(at_order(cells, pure, 0.0)) / np.sqrt(2)),
        "orders": orders,
        "spectrum_before": spectrum(cells, y),
        "spectrum_after": spectrum(cells_after, left),
    }
    if view.lacks is not None and all("harmonics" in words for words in view.lacks):  # operating points of a slow log
        for name in ("theta_e", "orders", "spectrum_before", "spectrum_after"):
            arrays.pop(name)
    return Evidence(arrays, torque=bool(np.isfinite(view.torque).any()))
