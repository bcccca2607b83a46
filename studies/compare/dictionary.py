# SPDX-License-Identifier: BSD-3-Clause
"""The generic library from which pySINDy and SysIdentPy choose: candidate terms for each equation.

In per unit: d, q the currents over the rated one, w the speed over its maximum, t the elapsed share of the recording,
T the winding's temperature rise (t without a thermocouple signal), e the mechanical angle, 1, 2, 6, 12 electrical
orders.  The library has powers of current times powers of speed, products with the usual harmonics of drives, the
direction of the phase currents, and the change of the voltage vector between rows.  This is more than a plain
polynomial library; both packages can find every effect of the catalogue with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.compare.data import Data, averaged

TORQUE_ORDERS = (4, 6, 8, 12, 18, 24, 30, 36)
SOFT = 0.05  # of rated current: above it the direction of a phase current is definite


@dataclass
class Equation:
    """One left-hand side with its candidates, scaled to unit rms over the fitted rows.

    x: (n, k) fitted rows; y: (n,) target in per mille (data.units); blocks: (b, k) and y_blocks: (b,) block
    means of both; scale: (k,) rms of each column before scaling.
    """

    name: str
    terms: list[str]
    x: np.ndarray
    y: np.ndarray
    blocks: np.ndarray
    y_blocks: np.ndarray
    scale: np.ndarray


def _powers(d, q, degree):
    """Monomials of the two currents up to a degree, {name: column}."""
    out = {}
    for total in range(degree + 1):
        for k in range(total + 1):
            a, b = total - k, k
            name = ("d" if a == 1 else f"d{a}" if a else "") + ("q" if b == 1 else f"q{b}" if b else "")
            out[name] = d**a * q**b
    return out


def _course(view):
    """Warming in per unit and time, both (b, 1)."""
    time = (view.t / max(view.span_s, 1e-9))[:, None]
    if np.isfinite(view.temp).all() and np.ptp(view.temp) > 3.0:
        return (view.temp - view.machine.temperature_ref_c)[:, None] / np.ptp(view.temp), time
    return time, time


def voltage_terms(data: Data) -> dict[str, np.ndarray]:
    """Candidates of u_d and u_q, {name: (b, m)}."""
    view, machine = data.view, data.view.machine
    i = view.i_mid / machine.rated_current_a
    top = max(float(np.abs(view.omega).max()), 1e-9)
    d, q, w, theta = i.real, i.imag, view.omega_mid / top, view.theta_mid
    warm, time = _course(view)
    out = dict(_powers(d, q, 3))
    out["1"] = out.pop("")
    out |= {f"w {name}".strip(): w * x for name, x in _powers(d, q, 3).items()}
    out |= {f"w2 {name}".strip(): w**2 * x for name, x in _powers(d, q, 1).items()}
    way = view.from_phases(np.clip(view.phases(view.i_mid) / (SOFT * machine.rated_current_a), -1.0, 1.0))
    change = data.voltage_change()
    out |= {"sgn_d": way.real, "sgn_q": way.imag, "du_d": change.real, "du_q": change.imag}
    out |= {"T d": warm * d, "T q": warm * q, "t w": time * w}
    for label, order, factors in (
        ("e", 1.0 / machine.pole_pairs, {"w": w}),
        ("2e", 2.0 / machine.pole_pairs, {"w": w}),
        ("1", 1.0, {"": 1.0, "w": w}),
        ("2", 2.0, {"d": d, "q": q, "w d": w * d, "w q": w * q}),
        ("6", 6.0, {"": 1.0, "w": w}),
        ("12", 12.0, {"": 1.0, "w": w}),
    ):
        for factor, x in factors.items():
            out[f"{factor} cos{label}".strip()] = x * np.cos(order * theta)
            out[f"{factor} sin{label}".strip()] = x * np.sin(order * theta)
    return {name: np.broadcast_to(x, d.shape) for name, x in out.items()}


def sum_terms(data: Data) -> dict[str, np.ndarray]:
    """Candidates of the sum of three measured currents."""
    view = data.view
    i = view.i_mid * np.exp(1j * view.theta_mid) / view.machine.rated_current_a
    return {"1": np.ones(i.shape), "alpha": i.real, "beta": i.imag}


def torque_terms(data: Data) -> dict[str, np.ndarray]:
    """Candidates of the shaft torque."""
    view = data.view
    i = view.i_mid / view.machine.rated_current_a
    top = max(float(np.abs(view.omega).max()), 1e-9)
    d, q, w, theta = i.real, i.imag, view.omega_mid / top, view.theta_mid
    out = {"w": w, "sgn_w": np.tanh(w / 0.01), "w abs": w * np.abs(w)}
    out |= {name: x for name, x in _powers(d, q, 3).items() if "q" in name}
    out |= {f"w {name}": w * x for name, x in _powers(d, q, 1).items() if name}
    for h in TORQUE_ORDERS:
        out |= {f"cos{h}": np.cos(h * theta), f"sin{h}": np.sin(h * theta)}
    return out


def equations(data: Data, rows: int) -> list[Equation]:
    """u_d, u_q and, where recorded, sum and torque; ``rows`` neighbours are averaged on both sides."""
    if rows in data.memo:
        return data.memo[rows]
    out = data.memo[rows] = []
    for channel, make in (("u", voltage_terms), ("sum", sum_terms), ("torque", torque_terms)):
        if channel not in data.misfit:
            continue
        terms = make(data)
        use = data.fitted(channel)
        fitted = averaged(np.stack([x[use] for x in terms.values()], axis=2), rows).reshape(-1, len(terms))
        blocks = np.stack([x.mean(axis=1) for x in terms.values()], axis=1)
        scale = np.sqrt(np.mean(fitted**2, axis=0))
        scale[scale < 1e-9] = np.inf
        y = data.misfit[channel] / data.units[channel]
        parts = {"u_d": y.real, "u_q": y.imag} if channel == "u" else {channel: y}
        for name, part in parts.items():
            target = averaged(part[use], rows).ravel()
            out.append(Equation(name, list(terms), fitted / scale, target, blocks / scale, part.mean(axis=1), scale))
    return out
