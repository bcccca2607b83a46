# SPDX-License-Identifier: BSD-3-Clause
"""What the real drive does differently from its drive file: plain physics, with sizes that a bench would notice."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Truth:
    """The real drive; values without a fault are the drive file's."""

    r: float
    l_d: float
    l_q: float
    psi: float
    r_phase: np.ndarray = field(default_factory=lambda: np.zeros(3))  # Ohm beyond r, sum zero
    v_dead: float = 0.0  # V lost in a leg
    i_dead: float = 1.0  # A over which the loss changes its sign
    leg: np.ndarray = field(default_factory=lambda: np.zeros(3))  # V in each leg, constant
    knee_d: float = 0.0  # saturation: share by which L falls at rated current
    knee_q: float = 0.0
    cross: float = 0.0
    r_fe: float = 0.0  # Ohm across the induced voltage; 0: none
    emf: dict = field(default_factory=dict)  # {order: complex share of psi}
    ripple_l: float = 0.0  # share of L_q that turns with six times the angle
    warm_r: float = 0.0  # change of R over the recording, share
    warm_psi: float = 0.0
    coulomb: float = 0.0  # Nm
    viscous: float = 0.0  # Nm s
    cogging: dict = field(default_factory=dict)  # {order per turn: (Nm, phase)}
    late: float = 0.0  # s by which the voltage is later than assumed
    # sensors
    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))  # A
    gain: np.ndarray = field(default_factory=lambda: np.ones(3))
    gain_drift: float = 0.0
    lag: float = 0.0  # s, filter of the currents
    skew: float = 0.0  # s after the middle of the zero vector
    angle: float = 0.0  # rad electrical
    runout: complex = 0.0  # rad mechanical, once a turn
    bus_gain: float = 1.0
    bus_lag: float = 0.0  # s
    bus_ripple: float = 0.0  # share at 300 Hz


def truth_of(drive) -> Truth:
    return Truth(drive.r, drive.l_d, drive.l_q, drive.psi, i_dead=0.03 * drive.current)


def _sign(rng):
    return float(rng.choice((-1.0, 1.0)))


def _balanced(rng, size):
    """Three values with sum zero whose largest is ``size``."""
    angle = rng.uniform(0, 2 * np.pi)
    x = np.cos(angle + 2 * np.pi / 3 * np.arange(3))
    return size * x / np.abs(x).max()


def _saturation(t, d, rng, s):
    t.knee_d, t.knee_q = 0.08 * s * rng.uniform(0.3, 1.0), 0.15 * s


def _cross(t, d, rng, s):
    t.cross = 0.12 * s


def _emf(t, d, rng, s):
    for order in (6, 12)[: 1 + int(rng.integers(2))]:
        t.emf[order] = 0.02 * s * 6 / order * np.exp(1j * rng.uniform(0, 6.28))
        t.emf[-order] = 0.4 * t.emf[order] * np.exp(1j * rng.uniform(0, 6.28))


def _cogging(t, d, rng, s):
    order = int(rng.choice((6, 12))) * d.pole_pairs // np.gcd(d.pole_pairs, 2)
    t.cogging[order] = (0.02 * s * 1.5 * d.pole_pairs * d.psi * d.current, rng.uniform(0, 6.28))


def _friction(t, d, rng, s):
    rated = 1.5 * d.pole_pairs * d.psi * d.current
    t.coulomb = 0.03 * s * rated
    top = 0.45 * d.bus / max(d.psi, 1e-9) / d.pole_pairs
    t.viscous = 0.02 * s * rated / top


def _set(name, change):
    def apply(t, d, rng, s):
        setattr(t, name, change(getattr(t, name), d, rng, s))

    return apply


# effect: its change of the truth for a size s of about 1
FAULTS = {
    "resistance": _set("r", lambda x, d, g, s: x * (1 + 0.3 * s) if _sign(g) > 0 else x / (1 + 0.3 * s)),
    "magnet_flux": _set("psi", lambda x, d, g, s: x * (1 + _sign(g) * 0.06 * s)),
    "inductance_d": _set("l_d", lambda x, d, g, s: x * (1 + 0.2 * s) if _sign(g) > 0 else x / (1 + 0.2 * s)),
    "inductance_q": _set("l_q", lambda x, d, g, s: x * (1 + 0.2 * s) if _sign(g) > 0 else x / (1 + 0.2 * s)),
    "dead_time": _set("v_dead", lambda x, d, g, s: 0.012 * s * d.bus),
    "saturation": _saturation,
    "cross_saturation": _cross,
    "iron_loss": _set("r_fe", lambda x, d, g, s: d.bus / (0.04 * s * d.current)),
    "emf_harmonics": _emf,
    "phase_resistance_asymmetry": _set("r_phase", lambda x, d, g, s: _balanced(g, 0.2 * s * d.r)),
    "resistance_temperature": _set("warm_r", lambda x, d, g, s: 0.25 * s),
    "magnet_temperature": _set("warm_psi", lambda x, d, g, s: -0.05 * s),
    "delay": _set("late", lambda x, d, g, s: 0.3 * min(s, 2.0) * d.period),
    "current_offset": _set("offset", lambda x, d, g, s: _balanced(g, 0.02 * s * d.current)),
    "current_gain": _set("gain", lambda x, d, g, s: 1.0 + _balanced(g, 0.04 * s)),
    "current_scale": _set("gain", lambda x, d, g, s: x * (1.0 + _sign(g) * 0.08 * s)),
    "sampling_skew": _set("skew", lambda x, d, g, s: _sign(g) * 0.06 * s * d.period),
    "encoder_offset": _set("angle", lambda x, d, g, s: _sign(g) * 0.08 * s),
    "encoder_eccentricity": _set(
        "runout", lambda x, d, g, s: 0.02 * s / d.pole_pairs * np.exp(1j * g.uniform(0, 6.28))
    ),
    "udc_gain": _set("bus_gain", lambda x, d, g, s: 1.0 + _sign(g) * 0.05 * s),
    "friction": _friction,
    "cogging": _cogging,
}
# physics that no effect of any catalogue stands for
UNKNOWN = {
    "current_filter": _set("lag", lambda x, d, g, s: 0.5 * s * d.period),
    "leg_voltages": _set("leg", lambda x, d, g, s: _balanced(g, 0.01 * s * d.bus)),
    "gain_drift": _set("gain_drift", lambda x, d, g, s: _sign(g) * 0.06 * s),
    "slow_bus_sensor": lambda t, d, g, s: (setattr(t, "bus_lag", 2e-3), setattr(t, "bus_ripple", 0.04 * s)),
    "slotted_inductance": _set("ripple_l", lambda x, d, g, s: 0.06 * s),
}
