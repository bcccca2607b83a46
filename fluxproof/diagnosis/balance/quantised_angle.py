# SPDX-License-Identifier: BSD-3-Clause
"""What the codes of an encoder leave in the balance: a beat with the sampling.

An angle in steps q of a shaft at constant speed is a sawtooth, harmonics m = 1, 2, ... of the amplitude q / (pi m) at
m codes per sample.  Sampled, they appear at the frequency f = m omega T / (2 pi q) less the nearest whole number, at
some speeds so low that the moving average g(f) of the angle lets it pass.  Its error delta turns the flux linkage psi:

    u: psi (omega + d/dt) delta                   the voltage is known in the stator frame, as duties are
    u: psi (omega + g d/dt) delta / g             the drive turned a voltage in dq with its own codes
    torque: J/p d^2/dt^2 delta / g                of a shaft whose acceleration follows from the codes themselves
    torque: J/p d^2/dt^2 delta                    of one with an imposed speed, over many samples

Its phase differs from block to block, so that it is noise, but only at these speeds.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.view import HALF_WIDTH, SLOPE_REACH

HARMONICS = 50  # harmonics of the sawtooth; those above have less than 1 % of its power
REGULAR, OF_A_STEP = 0.95, 0.1  # share of the second differences that are whole steps, within this part of one
BLOCKS = 64  # at once, for the memory


def angle_step(theta, linked) -> float:
    """Step of a recorded angle [rad]; 0 for an angle without steps.

    theta: (n,) unwrapped [rad]; linked: (n - 1,) bool, whether a row follows the one before.
    """
    bends = np.abs(np.diff(theta, 2))[linked[1:] & linked[:-1]]
    bends = bends[bends > 1e-7]
    if len(bends) < 100:
        return 0.0
    step = float(np.quantile(bends, 0.05))
    near = bends[bends < 1.5 * step]
    step = float(np.median(near))
    whole = np.abs(bends / step - np.round(bends / step)) < OF_A_STEP
    return step if whole.mean() >= REGULAR else 0.0


def beat_variance(view, channel, orders) -> np.ndarray:
    """Variance of real and imaginary part of a block's functionals (cells.py) by the beat, (b, h); orders: (h,).

    channel: "u" [V^2] or "torque" [(Nm)^2].
    """
    places = _turn(view)[:, None] * orders / (2 * np.pi)
    return _beats(view, {"u": _voltage, "torque": _torque}[channel], places, tapered=channel == "torque")


def beat_ripple(view, order) -> np.ndarray:
    """Power (b,) [V^2] of the misfit in dq by the beat at an order of a block's tapered spectrum."""
    places = _turn(view)[:, None] * order / (2 * np.pi)
    return 2.0 * _beats(view, _voltage, places, tapered=True)[:, 0]


def beat_spectrum(view, bins) -> np.ndarray:
    """Variance [V^2] of the misfit in dq by the beat, in bins of a block's tapered spectrum, (b, k); bins: (k,)."""
    places = np.tile(bins / view.u_dc.shape[1], (len(view.omega), 1))
    return _beats(view, _voltage, places, tapered=True)


def _turn(view):
    """(b,) [rad per sample]."""
    return view.omega.mean(axis=1) * view.sample_time_s


def _beats(view, response, places, tapered):
    """(b, h) variance by the beat at places (b, h), in cycles per sample."""
    out = np.zeros(places.shape)
    if not view.angle_step:
        return out
    m, turn = np.arange(1, HARMONICS + 1), _turn(view)
    for at in range(0, len(out), BLOCKS):
        part = slice(at, at + BLOCKS)
        cycles = m * (turn[part, None] / view.angle_step)
        cycles -= np.round(cycles)
        for sign in (1.0, -1.0):
            size = response(view, part, turn[part, None], sign * cycles) * view.angle_step / (2 * np.pi * m)
            away = sign * cycles[:, :, None] - places[part, None, :]
            seen = _window(away, view.u_dc.shape[1], tapered)
            out[part] += 0.5 * np.sum((size[:, :, None] * seen) ** 2, axis=1)
    return out


def _voltage(view, part, turn, cycles):
    """Misfit [V] per rad of the codes' error at so many cycles per sample."""
    rate, gain = 2 * np.pi * cycles, mean_of_wave(cycles, 2 * HALF_WIDTH + 1)
    psi = np.abs(view.nominal_psi[part].mean(axis=1))[:, None]
    rotated = turn + gain * rate if view.dq_voltage else gain * (turn + rate)
    return psi * rotated / view.sample_time_s


def _torque(view, part, _turn, cycles):
    """Torque [Nm] per rad of the codes' error: the second differences of blocks.py, four-point or slow."""
    x, inertia = np.pi * cycles, (view.machine.inertia_kgm2 or 0.0) / view.machine.pole_pairs
    slow = mean_of_wave(cycles, 2 * HALF_WIDTH + 1) * 2.0 * (np.cos(2 * SLOPE_REACH * x) - 1.0) / SLOPE_REACH**2
    bend = np.where(view.turns_freely[part][:, None], np.cos(3 * x) - np.cos(x), slow)
    return inertia * bend / view.sample_time_s**2


def _window(cycles, count, tapered):
    """Mean over ``count`` samples of a wave of so many cycles per sample; tapered: times 1 + cos, as the torque is."""
    if not tapered:
        return mean_of_wave(cycles, count)
    beside = mean_of_wave(cycles + 1 / count, count) + mean_of_wave(cycles - 1 / count, count)
    return mean_of_wave(cycles, count) + 0.5 * beside


def mean_of_wave(cycles, count):
    """Mean of a wave of so many cycles per sample over ``count`` samples around its maximum."""
    x = np.pi * cycles
    small = np.abs(np.sin(x)) < 1e-9
    return np.where(small, 1.0, np.sin(count * x) / (count * np.where(small, 1.0, np.sin(x))))
