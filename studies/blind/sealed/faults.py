# SPDX-License-Identifier: BSD-3-Clause
"""What the real drive does differently from its drive file: changes of (machine, inverter, sensors)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.blind.sealed import magnetics
from studies.blind.sealed import params as P


@dataclass
class Real:
    """The real drive; seconds: length of the recording; known: {effect: {parameter: true value}}."""

    machine: P.Machine
    inverter: P.Inverter
    sensors: P.Sensors
    seconds: float

    def set(self, part: str, **values):
        """Replace values of a part."""
        setattr(self, part, getattr(self, part)._replace(**values))


def _sign(rng):
    return float(rng.choice((-1.0, 1.0)))


def _up_or_down(rng, x, share):
    return x * (1.0 + share) if rng.random() < 0.6 else x / (1.0 + share)


def _three(rng, size):
    """Three values with sum zero whose largest is ``size``: one phase deviates, or all do."""
    if rng.random() < 0.5:
        x = np.roll((1.0, -0.5, -0.5), int(rng.integers(3))) * _sign(rng)
    else:
        x = rng.standard_normal(3)
        x -= x.mean()
    return size * x / np.abs(x).max()


def _phase(rng):
    return np.exp(1j * rng.uniform(0.0, 2.0 * np.pi))


def resistance(a, d, rng, s):
    value = _up_or_down(rng, d.r, 0.32 * s)
    a.set("machine", r=value)
    return {"resistance_ohm": value}


def magnet_flux(a, d, rng, s):
    value = d.psi * (1.0 + _sign(rng) * 0.06 * s)
    a.set("machine", psi=value)
    return {"magnet_flux_wb": value}


def inductance_d(a, d, rng, s):
    value = _up_or_down(rng, d.l_d, 0.22 * s)
    a.set("machine", l_d=value)
    return {"inductance_d_h": value}


def inductance_q(a, d, rng, s):
    value = _up_or_down(rng, d.l_q, 0.18 * s)
    a.set("machine", l_q=value)
    return {"inductance_q_h": value}


def dead_time(a, d, rng, s):
    what = rng.random()
    if what < 0.85:
        dead = 0.013 * s * d.period * rng.uniform(0.8, 1.25)
        a.set("inverter", dead=dead, c_leg=dead * d.current * rng.uniform(0.005, 0.08) / d.bus)
    if what > 0.5:
        a.set("inverter", v_on=0.009 * s * d.bus, i_on=d.current * rng.uniform(0.005, 0.03))
    return {}


def _knee(curve, floor, drop, bias=0.0):
    """Knee over the rated current at which the chord at rated current falls by ``drop``."""
    low, high = 0.05, 50.0
    for _ in range(60):
        middle = np.sqrt(low * high)
        y0, slope = magnetics.unit_curve(curve, bias / middle)
        y = magnetics.unit_curve(curve, (bias + 1.0) / middle)[0]
        chord = floor + (1.0 - floor) * (y - y0) * middle / slope
        low, high = (middle, high) if 1.0 - chord > drop else (low, middle)
    return high


def saturation(a, d, rng, s):
    curve = int(rng.choice((P.ARCTAN, P.TANH, P.ROOT)))
    floor_d, floor_q = rng.uniform(0.1, 0.35, 2)
    bias = rng.uniform(0.0, 0.4)
    drop_q = min(0.16 * s, 0.45)
    knee_d = _knee(curve, floor_d, drop_q * rng.uniform(0.25, 0.8), bias)
    knee_q = _knee(curve, floor_q, drop_q)
    a.set(
        "machine", curve=curve, floor_d=floor_d, floor_q=floor_q, knee_d=knee_d * d.current, knee_q=knee_q * d.current,
        bias=bias * d.current, slope=magnetics.unit_curve(curve, bias / knee_d)[1],
    )  # fmt: skip
    return {}


def cross_saturation(a, d, rng, s):
    knee_d, knee_q, bias = rng.uniform(0.5, 1.3), rng.uniform(0.4, 1.0), rng.uniform(0.5, 1.2)
    lost = 0.07 * s * max(d.psi, 0.5 * d.l_d * d.current, 0.35 * d.l_q * d.current)
    at_rated = np.tanh(bias / knee_d) * magnetics.log_cosh(1.0 / knee_q)
    cross = lost / at_rated
    while True:
        a.set(
            "machine", cross=cross, cross_d=knee_d * d.current, cross_q=knee_q * d.current, cross_bias=bias * d.current
        )
        if magnetics.convex(a.machine, 1.3 * d.current):
            return {}
        cross *= 0.85


def iron_loss(a, d, rng, s):
    a.set("machine", r_fe=0.45 * d.bus / (0.035 * s * d.current), tau_fe=rng.uniform(0.3, 0.7) * d.period)
    return {}


def emf_harmonics(a, d, rng, s):
    z = np.zeros(4, complex)
    z[0] = 0.022 * s * rng.uniform(0.6, 1.0) * _phase(rng)
    z[1] = z[0] * rng.uniform(0.1, 0.6) * _phase(rng)
    if rng.random() < 0.5:
        z[2:] = 0.3 * z[:2] * _phase(rng)
    a.set("machine", harmonic=z * d.psi)
    return {}


def phase_resistance_asymmetry(a, d, rng, s):
    a.set("machine", r_phase=_three(rng, 0.2 * s * d.r))
    return {}


def resistance_temperature(a, d, rng, s):
    tau = a.seconds * rng.uniform(0.25, 0.6)
    a.set("machine", heat=60.0 * s / (tau * 1.5 * d.r * (0.55 * d.current) ** 2), tau_heat=tau)
    return {}


def magnet_temperature(a, d, rng, s):
    a.set("machine", magnet_drop=0.05 * s, tau_magnet=a.seconds * rng.uniform(0.3, 0.7))
    return {}


def delay(a, d, rng, s):
    what = rng.random()
    if what < 0.5:
        a.set("inverter", late=min(0.22 * s, 0.5) * d.period)
    elif what < 0.75:
        a.set("inverter", load_at=P.LOAD_PEAK)
    else:
        a.set("inverter", extra=1)
    return {}


def current_offset(a, d, rng, s):
    x = _three(rng, 0.018 * s * d.current)
    a.set("sensors", offset=a.sensors.offset + x)
    return {f"offset_{k}_a": float(v) for k, v in zip("abc", x, strict=True)}


def current_gain(a, d, rng, s):
    x = _three(rng, 0.035 * s)
    a.set("sensors", gain=a.sensors.gain * (1.0 + x))
    return {f"gain_{k}": float(v) for k, v in zip("abc", x, strict=True)}


def current_scale(a, d, rng, s):
    a.set("sensors", gain=a.sensors.gain * (1.0 + _sign(rng) * 0.07 * s))
    return {}


def sampling_skew(a, d, rng, s):
    a.set("sensors", skew=a.sensors.skew + _sign(rng) * 0.085 * s * d.period)
    return {}


def encoder_offset(a, d, rng, s):
    a.set("sensors", angle=_sign(rng) * 0.07 * s)
    return {}


def encoder_eccentricity(a, d, rng, s):
    a.set("sensors", runout=0.025 * s / d.pole_pairs, runout_phase=rng.uniform(0.0, 6.28))
    return {}


def udc_gain(a, d, rng, s):
    a.set("sensors", bus_gain=1.0 + _sign(rng) * 0.045 * s)
    return {}


def friction(a, d, rng, s):
    top = d.base / np.hypot(d.psi, 0.7 * d.l_q * d.current) / d.pole_pairs
    rated = d.rated_torque
    a.set(
        "machine", viscous=d.viscous + 0.025 * s * rated / top * rng.uniform(0.3, 1.5), coulomb=0.03 * s * rated,
        stribeck=0.01 * s * rated * rng.uniform(0.0, 1.0), creep=0.004 * top,
    )  # fmt: skip
    return {}


def cogging(a, d, rng, s):
    order = float(np.lcm(2 * d.pole_pairs, int(rng.choice((6, 9, 12)))))
    if order > 12 * d.pole_pairs:  # faster ones would be sampled too rarely
        order = 6.0 * d.pole_pairs
    a.set("machine", cog=0.022 * s * d.rated_torque, cog_order=order, cog_phase=rng.uniform(0.0, 6.28))
    return {}


FAULTS = {
    f.__name__: f
    for f in (
        resistance, magnet_flux, inductance_d, inductance_q, dead_time, saturation, cross_saturation, iron_loss,
        emf_harmonics, phase_resistance_asymmetry, resistance_temperature, magnet_temperature, delay, current_offset,
        current_gain, current_scale, sampling_skew, encoder_offset, encoder_eccentricity, udc_gain, friction, cogging,
    )
}  # fmt: skip


# -- physics that no effect's name stands for -----------------------------------------------------------------


def _slotted(a, d, rng, s):
    knee = rng.uniform(0.4, 0.9) * d.current
    a.set("machine", slot=0.09 * s * d.l_q * knee, slot_knee=knee, slot_phase=rng.uniform(0.0, 6.28))


def _short(a, d, rng, s):
    share = rng.uniform(0.05, 0.12)
    ohm = share**2 * 0.45 * d.bus / (0.14 * s * d.current)
    a.set("machine", short_share=share, r_short=ohm, tau_short=d.period * rng.uniform(0.4, 1.0))


def _slow_bus(a, d, rng, s):
    v = a.inverter
    a.set("sensors", bus_tau=3e-3)
    a.set("inverter", ripple=0.035 * s, ripple_hz=float(rng.choice((100, 300))), c_bus=2e-4 / v.r_source)


UNKNOWN = {
    "slotted_saturation": _slotted,
    "shorted_turns": _short,
    "eccentric_rotor": lambda a, d, rng, s: a.set("machine", eccentric=0.035 * s),
    "sensor_hysteresis": lambda a, d, rng, s: a.set("sensors", play=0.018 * s * d.current),
    "sensor_bend": lambda a, d, rng, s: a.set("sensors", bend=0.12 * s * (a.sensors.range_a / d.current / 1.4) ** 2),
    "channel_crosstalk": lambda a, d, rng, s: a.set("sensors", talk=_sign(rng) * 0.035 * s),
    "shaft_twist": lambda a, d, rng, s: a.set("sensors", twist=_sign(rng) * 0.07 * s / d.pole_pairs / d.rated_torque),
    "slow_bus_sensor": _slow_bus,
    "slow_current_sensor": lambda a, d, rng, s: a.set("sensors", tau=0.45 * s * d.period),
}  # fmt: skip
