"""The order at which a torque repeats with the rotor angle, and the orders at which torque is evaluated.

The number of cogging periods per mechanical turn is the least common multiple of slots and poles, which the drive file
does not contain: with 27 slots and ten poles there are 54 per electrical turn.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.misfit import misfit

ORDERS = range(2, 110, 2)  # per electrical turn; cogging orders are even
ALWAYS = range(2, 38, 2)  # evaluated in every recording
MULTIPLES = (1, 2, 3)  # of the repeating order
LOCKS = 0.5  # least phase lock, relative to the best one, of a cogging order


def torque_orders(view) -> tuple[float, ...]:
    """Orders per electrical turn, besides order 0, at which a view's torque is evaluated."""
    even = sorted({*ALWAYS, *(n * repeating_order(view) for n in MULTIPLES)})
    return (1.0 / view.machine.pole_pairs, 1.0, *map(float, even))


def repeating_order(view) -> int:
    """The order whose torque repeats from block to block; of several, the one with the largest amplitude.

    Harmonics of the cogging repeat too, so that the order with the best phase lock may be a harmonic.
    """
    if "torque_order" not in view.memo:
        view.memo["torque_order"] = _searched(view)
    return view.memo["torque_order"]


def _searched(view) -> int:
    seen = np.isfinite(view.torque).all(axis=1)
    if not seen.any():
        return 6
    torque = misfit(view)["torque"][seen]
    torque = torque - torque.mean(axis=1, keepdims=True)
    theta = view.theta_mid[seen]
    taper = 1.0 - np.cos(2 * np.pi * (np.arange(theta.shape[1]) + 0.5) / theta.shape[1])
    turns = np.abs(theta[:, -1] - theta[:, 0]) / (2 * np.pi)
    found = []
    for h in ORDERS:
        f = (torque * taper * np.exp(-1j * h * theta)).mean(axis=1)[h * turns > 2.0]
        # The acceleration of a free shaft is noisier at higher speed.
        weight = 1.0 / np.maximum(np.abs(f) ** 2, np.median(np.abs(f) ** 2)) if len(f) else np.zeros(0)
        lock = float(np.abs(np.sum(weight * f)) ** 2 / max(np.sum(weight**2 * np.abs(f) ** 2), 1e-300))
        found.append((lock, float(np.abs(np.sum(weight * f)) / max(np.sum(weight), 1e-300)), h))
    least = LOCKS * max(lock for lock, _, _ in found)
    return max((size, h) for lock, size, h in found if lock >= least)[1] if least > 0.0 else 6
