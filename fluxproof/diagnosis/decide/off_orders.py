# SPDX-License-Identifier: BSD-3-Clause
"""Two searches for misfits outside the cells' orders: other orders of the mechanical turn, and other frequencies.

A misfit locked to the rotor adds up over blocks with the same phase; noise does not.  The power of the sum over the sum
of powers is one for noise and the number of blocks for a locked misfit.  A misfit at a frequency that no angle
explains exceeds the rising noise spectrum at its low end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.balance.cells import voltage_level
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.balance.quantised_angle import beat_ripple, beat_spectrum
from fluxproof.diagnosis.effects import LegLoss, MeasurementError
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.machine import rated_torque

MOST_ORDER = 80  # per mechanical turn; of a machine with many pole pairs those up to
MOST_ELECTRICAL = 12  # per electrical turn
LEAST_BLOCKS = 6  # in which an order is looked for
WEIGHTS = {
    "1": (lambda v: np.ones(len(v)), "V"),
    "omega": (lambda v: v.omega.mean(axis=1), "V s/rad"),
    "i_q": (lambda v: v.i.imag.mean(axis=1), "V/A"),
}


@dataclass(frozen=True)
class Stray:
    """An unexplained misfit: its formula, the value of c and the standard deviation of c."""

    kind: str  # "order", "frequency" or "torque"
    formula: str
    value: float
    sigma: float
    unit: str
    explains: float
    order: float = 0.0  # per electrical turn
    size: float = 0.0  # rms [size_unit]
    size_unit: str = "V"


def row_residual(fit):
    """Residual of the voltage balance after a fit, (b, m) complex dq [V]."""
    view, effects = fit.problem.view, fit.problem.setup.effects
    left = misfit(view)["u"].copy()
    for name, c in fit.c.items():
        effect = effects[name]
        if isinstance(effect, MeasurementError):
            continue
        seen = view if isinstance(effect, LegLoss) else view.with_raw_current()
        columns = effect.columns(seen)
        for key, value in c.items():
            if value and "u" in columns.get(key, {}):
                left -= value * columns[key]["u"]
    return left


def stray_torque(view, projector, cells, residual, sigma) -> Stray | None:
    """A torque of order one to four per mechanical turn, as of an unbalanced load or a bent shaft."""
    use = cells.ok & (cells.channel == "torque") & (cells.order == 0)
    if use.sum() < 12:
        return None
    m, best = view.machine, None
    rated = rated_torque(view.machine)
    for n in range(1, 5):
        angle = n * view.theta_mid / m.pole_pairs
        waves = [projector.rows({"torque": f(angle)})[use] / sigma[use] for f in (np.cos, np.sin)]
        a, y = np.array(waves).T, residual[use] / sigma[use]
        c, *_ = np.linalg.lstsq(a, y, rcond=None)
        gain = float(y @ y - np.sum((y - a @ c) ** 2))
        amplitude = float(np.hypot(*c))
        if gain > 2 * k.LOCKED and amplitude > k.LEAST_TORQUE * rated and (best is None or gain > best[0]):
            best = (gain, amplitude, n)
    if best is None:
        return None
    gain, amplitude, n = best
    total = float(np.sum((residual[use] / sigma[use]) ** 2))
    formula = f"torque = c * sin({n} theta_m + phi)"
    spread = amplitude / np.sqrt(gain)
    return Stray("torque", formula, amplitude, spread, "Nm", gain / total, n / m.pole_pairs, amplitude / 2**0.5, "Nm")


def stray_order(view, residual, floor, known=()) -> Stray | None:
    """The strongest order per mechanical turn that is locked to the rotor; None below ``floor`` [V].

    known: electrical orders that belong to an effect of the model and are skipped.
    """
    p, m, level = view.machine.pole_pairs, residual.shape[1], voltage_level(view)
    most = max(MOST_ORDER, MOST_ELECTRICAL * p)
    turns = np.where(view.locked, np.abs(view.theta[:, -1] - view.theta[:, 0]) / (2 * np.pi * p), 0.0)
    tapered = residual * (1.0 - np.cos(2 * np.pi * (np.arange(m) + 0.5) / m))
    turn, wave, found = np.exp(-1j * view.theta_mid / p), 1.0, {}
    for n in range(1, most + 1):
        wave = wave * turn
        found[n], found[-n] = (tapered * wave).mean(axis=1), (tapered * np.conj(wave)).mean(axis=1)

    def locked(n, use, largest):
        """The Stray of an order in the blocks ``use`` if it is larger than ``largest`` [V]."""
        out, f = None, found[n][use]
        for text, (weight, unit) in WEIGHTS.items():
            w = weight(view)[use]
            total = complex(np.sum(w * f))
            lock = abs(total) ** 2 / max(float(np.sum(w**2 * np.abs(f) ** 2)), 1e-300)
            c = abs(total) / max(float(np.sum(w**2)), 1e-300)
            volts = c * float(np.sqrt(np.mean(w**2)))
            if lock > min(k.LOCKED, 0.7 * use.sum()) and volts > max(least(use), largest):
                formula = f"u_d + j u_q = c * {text} * exp(j {n} theta_m + j phi)"
                explains = abs(total) ** 2 / float(np.sum(w**2) * np.sum(np.abs(f) ** 2))
                spread = c * float(np.sqrt(max(1.0 - explains, 0.0) / use.sum()))
                out, largest = Stray("order", formula, c, spread, unit, explains, n / p, volts), volts
        return out

    def least(use):
        return max(floor, k.LEAST_RIPPLE * float(np.sqrt(np.mean(level[use] ** 2))))

    best = None
    for n in [*range(1, most + 1), *range(-most, 0)]:
        if any(abs(n) == h * p for h in known):
            continue
        use, largest = (abs(n) * turns >= 2.5) & (abs(n) * turns < m / 5), best.size if best else 0.0
        if use.sum() < LEAST_BLOCKS or not locked(n, use, largest):
            continue
        # At one speed the codes of an encoder may beat with the sampling at just this order, with one phase.
        use &= beat_ripple(view, n / p) < least(use) ** 2
        if use.sum() >= LEAST_BLOCKS:
            best = locked(n, use, largest) or best
    return best


def stray_swing(view, residual, floor) -> Stray | None:
    """A low frequency in the voltage magnitude that no rotor angle explains; None below ``floor`` [V]."""
    m, level = residual.shape[1], voltage_level(view)
    if m < 100:
        return None
    taper = 1.0 - np.cos(2 * np.pi * (np.arange(m) + 0.5) / m)
    u = view.to_dq(view.u[:, 1:-1]).mean(axis=1, keepdims=True)
    along = ((residual - residual.mean(axis=1, keepdims=True)) * np.conj(u / np.abs(u).clip(1e-9))).real
    spectrum = np.abs(np.fft.rfft(along * taper, axis=1) / m) ** 2
    # Where the codes of an encoder beat with the sampling at such a frequency, nothing else is seen.
    beats = beat_spectrum(view, np.arange(1, 5)).max(axis=1) > np.median(spectrum[:, 8:20], axis=1)
    loud = (level > 0.4 * level.max()) & ~beats
    if not loud.any():
        return None
    usual = np.median(spectrum[loud], axis=0)  # a swing is in most blocks, what is in few is an event
    low, around = usual[1:5].max(), np.median(usual[8:20])
    amplitude = 2.0 * float(np.sqrt(usual[1:5].sum() / 1.5))
    share = amplitude / float(np.sqrt(np.mean(level[loud] ** 2)))
    if low < k.SWING * around or share < k.LEAST_SWING or amplitude < floor:
        return None
    hertz = (1 + int(np.argmax(usual[1:5]))) / (m * view.sample_time_s)
    formula = f"u proportional to 1 + c * sin(2 pi f t), f about {hertz:.0f} Hz"
    spread, size = share * float(np.sqrt(around / low)), amplitude / 2**0.5
    return Stray("frequency", formula, share, spread, "1", float(1.0 - around / low), 0.0, size)
