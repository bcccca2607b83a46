# SPDX-License-Identifier: BSD-3-Clause
"""The order at which a torque repeats with the rotor angle, and the orders at which torque is evaluated.

The number of cogging periods per mechanical turn is the least common multiple of slots and poles, which the drive file
does not contain: with 27 slots and ten poles there are 54 per electrical turn.  Magnets or slots that differ from each
other add the number of slots or of poles itself, so that every whole number per mechanical turn is looked at.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.balance.shaft import bend_gain

LEAST_PER_TURN = 5  # per mechanical turn: an unbalanced load or a bent shaft has fewer
EVERY = 36  # per electrical turn: up to here every order per mechanical turn is a candidate
MOST_PER_PERIOD = 108  # per electrical turn: up to here the even ones
ALWAYS = range(2, 38, 2)  # per electrical turn, evaluated in every recording
MULTIPLES = (1, 2, 3)  # of the repeating order
LOCKS = 0.5  # least phase lock, relative to the best one, of a cogging order


def torque_orders(view) -> tuple[float, ...]:
    """Orders per electrical turn, besides order 0, at which a view's torque is evaluated."""
    pairs = view.machine.pole_pairs
    orders = {round(float(h), 9) for h in ALWAYS} | {round(n * repeating_order(view) / pairs, 9) for n in MULTIPLES}
    return tuple(sorted({round(1.0 / pairs, 9), 1.0, *orders}))


def repeating_order(view) -> int:
    """The order per mechanical turn whose torque repeats from block to block; of several, the largest.

    Harmonics of the cogging repeat too, so that the order with the best phase lock may be a harmonic.
    """
    if "torque_order" not in view.memo:
        view.memo["torque_order"] = _searched(view)
    return view.memo["torque_order"]


def log_prior(view) -> float:
    """Log of the prior probability of the repeating order.

    As probable as all others together are those that poles and equal slots can have, multiples of the number of poles.
    """
    pairs = view.machine.pole_pairs
    candidates = np.array(_candidates(pairs))
    alike = (candidates % (2 * pairs) == 0) == (repeating_order(view) % (2 * pairs) == 0)
    return -float(np.log(2.0 * alike.sum()))


def _candidates(pairs: int) -> list[int]:
    """Orders per mechanical turn that are tried."""
    even = range(2 * pairs, MOST_PER_PERIOD * pairs + 1, 2 * pairs)
    return sorted({*range(LEAST_PER_TURN, EVERY * pairs + 1), *even})


def _searched(view) -> int:
    seen, pairs = np.isfinite(view.torque).all(axis=1), view.machine.pole_pairs
    if not seen.any():
        return 6 * pairs
    torque = misfit(view)["torque"][seen]
    torque = torque - torque.mean(axis=1, keepdims=True)
    theta = view.theta_mid[seen] / pairs
    taper = 1.0 - np.cos(2 * np.pi * (np.arange(theta.shape[1]) + 0.5) / theta.shape[1])
    turns = np.abs(theta[:, -1] - theta[:, 0]) / (2 * np.pi)
    found, torque, rows = [], torque * taper / theta.shape[1], theta.shape[1]
    turn, at, wave = np.exp(-1j * theta), 0, np.ones_like(theta, complex)
    for n in _candidates(pairs):
        wave = wave * turn if n == at + 1 else np.exp(-1j * n * theta)
        at = n
        use = (n * turns > 2.0) & (n * turns < rows / 2.5)
        f = np.einsum("ij,ij->i", torque[use], wave[use])
        weight = _weights(np.abs(f) ** 2, bend_gain(view, n / pairs)[seen][use] ** 2)
        lock = float(np.abs(np.sum(weight * f)) ** 2 / max(np.sum(weight**2 * np.abs(f) ** 2), 1e-300))
        found.append((lock, float(np.abs(np.sum(weight * f)) / max(np.sum(weight), 1e-300)), n))
    least = LOCKS * max(lock for lock, _, _ in found)
    return max((size, n) for lock, size, n in found if lock >= least)[1] if least > 0.0 else 6 * pairs


def _weights(power, gain):
    """(k,) weights of blocks with these powers; gain: of the angle's noise, 0 with a transducer."""
    if not len(power):
        return np.zeros(0)
    gain = np.where(gain > 0.0, gain, 1.0)
    return 1.0 / np.maximum(power, gain * np.median(power / gain))
