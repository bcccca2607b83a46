# SPDX-License-Identifier: BSD-3-Clause
"""Effects of machine, inverter and shaft, in the catalogue's form and in others (registry.py)."""

from __future__ import annotations

import math

import numpy as np

from studies.blind import params as P
from studies.blind.magnetics import self_flux
from studies.blind.registry import CATALOGUE, effect, rated, sign, three


@effect("tanh_diode", "atan", "capacitance")
def dead_time(b, rng, size, form):
    """Typical: 1.5 us and a drop of 0.7 V (0.2 V on low buses)."""
    bus, T, i_r = b.nominal.inverter["dc_bus_v"], b.nominal.period_s, rated(b)
    dead = float(np.clip(size * rng.uniform(1.0, 2.0) * 1e-6, 0.25e-6, 4.5e-6))
    v = size * (0.7 if bus > 100.0 else 0.2) * rng.uniform(0.3, 1.0)
    if form == CATALOGUE:
        zone = rng.uniform(0.005, 0.02) * i_r
        b.change(
            "bridge",
            dead_s=dead,
            direction=P.DIRECTION_CLIP,
            i_zone=zone,
            drop=P.DROP_CONSTANT,
            v_drop=v,
            i_drop=zone,
        )
        return {"v_dead_v": bus * dead / T + v}
    zone = rng.uniform(0.02, 0.06) * i_r
    kind = {"tanh_diode": P.DIRECTION_TANH, "atan": P.DIRECTION_ATAN, "capacitance": P.DIRECTION_CAPACITANCE}[form]
    device = P.DROP_ATAN if form == "atan" else P.DROP_DIODE
    scale = 1.0 if form == "atan" else 1.0 / math.asinh(20.0)
    b.change("bridge", dead_s=dead, direction=kind, i_zone=zone, drop=device, v_drop=v * scale, i_drop=0.03 * i_r)
    return {"v_dead_v": bus * dead / T + v}


@effect("in_bridge", "skin")
def resistance(b, rng, size, form):
    """Typical: +20 %, seldom less than nominal."""
    r = b.nominal.machine["resistance_ohm"]
    rise = size * 0.2 if form == "in_bridge" or rng.random() < 0.75 else -min(size, 1.7) * 0.2
    if form == "in_bridge":  # switches and cables: the same resistance outside the winding
        b.change(
            "bridge",
            drop=P.DROP_CONSTANT if b.drive.bridge.drop == P.DROP_NONE else b.drive.bridge.drop,
            r_drop=rise * r,
        )
        return {"resistance_ohm": r * (1.0 + rise)}
    m = b.drive.motor
    b.change("motor", r_a=m.r_a * (1.0 + rise), r_b=m.r_b * (1.0 + rise), r_c=m.r_c * (1.0 + rise))
    if form == "skin":
        p, rated, bend = b.nominal.machine["pole_pairs"], b.nominal.omega_rated, 0.15 * abs(rise)
        b.on_course.append(lambda c, x: c.r_scale.__imul__(1.0 + bend * (p * c.omega / rated) ** 2))
        return {}
    return {"resistance_ohm": r * (1.0 + rise)}


def _rise(form, x, rate):
    """Relative temperature rise at the share x of the recording."""
    return x if form == CATALOGUE else (1.0 - np.exp(-rate * x)) / (1.0 - math.exp(-rate))


@effect("exponential_lag", "hot_start")
def resistance_temperature(b, rng, size, form):
    """Copper, 0.0039/K; typical rise 50 K over the recording; the thermocouple may lag."""
    alpha, span, reference = 0.0039, min(50.0 * size, 140.0), b.nominal.machine["temperature_ref_c"]
    rate, lag = rng.uniform(2.0, 5.0), rng.uniform(0.02, 0.08)

    def share(x):
        if form == "hot_start":  # cools down, from hot
            return 1.0 - _rise("exponential", x, rate)
        return _rise(form, x, rate)

    b.with_temp = True
    b.on_course.append(lambda c, x: c.r_scale.__imul__(1.0 + alpha * span * share(x)))
    late = lag if form == "exponential_lag" else 0.0
    b.temperature = lambda x: reference + span * share(np.maximum(x - late, 0.0))
    return {} if late else {"resistance_temp_coeff_per_k": alpha}


@effect("recovering")
def magnet_flux(b, rng, size, form):
    """Typical: -5 %."""
    fall = 0.05 * size * sign(rng, 0.25)
    psi = b.nominal.machine["magnet_flux_wb"]
    if form == "recovering":  # a part of the lost flux recovers during the recording
        b.on_course.append(lambda c, x: c.psi_scale.__imul__(1.0 + fall * (1.0 - 0.15 * x)))
        return {}
    b.on_course.append(lambda c, x: c.psi_scale.__imul__(1.0 + fall))
    return {"magnet_flux_wb": psi * (1.0 + fall)}


@effect("exponential")
def magnet_temperature(b, rng, size, form):
    """NdFeB, -0.1 %/K; typical rise 40 K.  The magnet temperature is not measured, so that only the drift is known."""
    beta, span, rate = -0.001, min(40.0 * size, 120.0), rng.uniform(2.0, 5.0)
    b.on_course.append(lambda c, x: c.psi_scale.__imul__(1.0 + beta * span * _rise(form, x, rate)))
    return {}


def _inductance(b, rng, size, form, axis):
    change = 0.15 * size * sign(rng)
    change = max(change, -0.4)
    value = b.nominal.machine[f"inductance_{axis}_h"] * (1.0 + change)
    b.change("motor", **{f"l_{axis}": value})
    if form == "rounded":  # the excess inductance saturates slightly: by 12 % at rated current
        sat = rated(b) / math.sqrt(0.24 * abs(change))
        b.change("motor", **{f"self_{axis}": P.SELF_ROOT, f"sat_{axis}": sat})
        return {}
    return {f"inductance_{axis}_h": value}


@effect("rounded")
def inductance_d(b, rng, size, form):
    """Typical: 15 % either way."""
    return _inductance(b, rng, size, form, "d")


@effect("rounded")
def inductance_q(b, rng, size, form):
    """Typical: 15 % either way."""
    return _inductance(b, rng, size, form, "q")


@effect("tanh", "rational", "langevin", "root", "shifted_d")
def saturation(b, rng, size, form):
    """Typical: q flux 15 % below the linear one at rated current, d flux a third of that."""
    i_r = rated(b)
    loss_q = min(0.15 * size, 0.38)
    loss_d = loss_q * rng.uniform(0.2, 0.6)
    if form == CATALOGUE:
        kind_d = kind_q = P.SELF_CUBIC
        sat_d, sat_q = min(loss_d, 0.22) / i_r**2, min(loss_q, 0.22) / i_r**2
    else:
        kind_q = {"tanh": P.SELF_TANH, "rational": P.SELF_RATIONAL, "langevin": P.SELF_LANGEVIN}.get(form, P.SELF_ROOT)
        kind_d = P.SELF_SHIFTED if form == "shifted_d" else kind_q
        sat_d, sat_q = _knee(kind_d, loss_d) * i_r, _knee(kind_q, loss_q) * i_r
    b.change("motor", self_d=kind_d, self_q=kind_q, sat_d=sat_d, sat_q=sat_q, shift_d=0.4 * sat_d)
    return {}


def _knee(kind, loss):
    """Knee over rated current at which the flux at rated current is ``loss`` below the linear one."""
    low, high = 0.05, 1000.0
    for _ in range(60):
        middle = math.sqrt(low * high)
        if kind == P.SELF_SHIFTED:  # towards positive current, to which the magnet biases the iron
            flux = self_flux(kind, 1.0, middle, 0.4 * middle, 1.0)[0]
        else:
            flux = self_flux(kind, 1.0, middle, 0.0, 1.0)[0]
        low, high = (middle, high) if 1.0 - flux > loss else (low, middle)
    return middle


@effect("levelling", "both_level", "modulus")
def cross_saturation(b, rng, size, form):
    """Typical: d flux 4 % of the magnet flux lower at rated i_q, as far as the co-energy stays convex."""
    m, i_r = b.nominal.machine, rated(b)
    most = 0.3 * math.sqrt(m["inductance_d_h"] * m["inductance_q_h"]) / i_r
    c = -min(0.04 * size * m["magnet_flux_wb"] / i_r**2, most) * sign(rng, 0.8)
    if form == "modulus":
        b.change("motor", cross=P.CROSS_MODULUS, c_x=c * i_r * 1.3, i_x=0.25 * i_r)
        return {}
    kind = {CATALOGUE: P.CROSS_SQUARE, "levelling": P.CROSS_LEVELLING, "both_level": P.CROSS_BOTH_LEVEL}[form]
    b.change("motor", cross=kind, c_x=c, i_x=i_r * rng.uniform(1.0, 2.0))
    return {}


@effect("hysteresis", "mixed")
def iron_loss(b, rng, size, form):
    """Typical: draws 3 % of the rated current at rated speed."""
    g = 0.03 * size * rated(b) / (b.nominal.omega_rated * b.nominal.machine["magnet_flux_wb"])
    share = {CATALOGUE: 0.0, "hysteresis": 0.9, "mixed": 0.5}[form]
    b.change("motor", g_eddy=g * (1.0 - share), g_hyst=g * share, w_hyst=b.nominal.omega_rated)
    return {} if share else {"iron_resistance_ohm": 1.0 / g}


@effect("asymmetric")
def emf_harmonics(b, rng, size, form):
    """Typical: 1.5 % of the EMF at order 6, less at 12 (and 18)."""
    a = 0.015 * size * b.nominal.machine["magnet_flux_wb"] / 6.0
    rows = []
    for k, order in enumerate((6.0, 12.0) if form == CATALOGUE else (6.0, 12.0, 18.0)):
        scale = a * (0.3**k)
        if form == CATALOGUE:  # 5th and 7th harmonic of a winding that is symmetric about the d axis
            ratio = rng.uniform(-0.8, 0.8)
            rows.append((order, scale, 0.0, scale * ratio, -0.5 * math.pi))
        else:
            rows.append((order, scale * rng.uniform(0.3, 1.0), rng.uniform(0, 6), scale, rng.uniform(0, 6)))
    b.change("motor", psi_h=np.array(rows))
    return {}


@effect("whole", "half", "shift")
def delay(b, rng, size, form):
    """Typical: 10 us; other forms: one period, registers that load at the carrier peak, shifted gates."""
    T = b.nominal.period_s
    if form == "half":
        b.change("bridge", delay_kind=P.DELAY_HALF, delay=0.5)
        return {"delay_s": 0.5 * T}
    if form == "shift":
        b.change("bridge", delay_kind=P.DELAY_SHIFT, delay=rng.uniform(0.35, 0.6))
        return {}
    share = 1.0 if form == "whole" else min(10e-6 * size / T, 0.95)
    b.change("bridge", delay_kind=P.DELAY_MIX, delay=share)
    return {"delay_s": share * T}


@effect("warming")
def phase_resistance_asymmetry(b, rng, size, form):
    """Typical: 10 % in the worst phase at constant mean resistance."""
    x = 0.1 * size * three(rng, form != CATALOGUE)
    fade = 0.25 * (form != CATALOGUE)  # a bad contact improves as it warms
    b.on_course.append(lambda c, s: c.r_scale.__imul__(1.0 + x[:, None] * (1.0 - fade * s)))
    return {} if fade else dict(zip(("asymmetry_a", "asymmetry_b", "asymmetry_c"), x, strict=True))


@effect("two_harmonics")
def cogging(b, rng, size, form):
    """Typical: 5 % of the rated torque at LCM(slots, poles) per turn."""
    poles = 2 * b.nominal.machine["pole_pairs"]
    slots = int(rng.choice([s for s in (6, 9, 12, 18, 24, 27, 30, 36) if s != poles]))
    order, a = math.lcm(slots, poles), 0.05 * size * b.nominal.torque_rated
    rows = [(order, a, rng.uniform(0, 6))]
    if form == "two_harmonics":
        rows.append((2 * order, 0.4 * a, rng.uniform(0, 6)))
    b.change("shaft", cogging=np.array(rows, float))
    return {"cogging_nm": a} if form == CATALOGUE else {}


@effect("stribeck")
def friction(b, rng, size, form):
    """Typical: 5 % of the rated torque at rated speed, half of it Coulomb friction."""
    t, share = 0.05 * size * b.nominal.torque_rated, rng.uniform(0.3, 0.7)
    omega_m = b.nominal.omega_rated / b.nominal.machine["pole_pairs"]
    viscous = b.drive.shaft.viscous + (1.0 - share) * t / omega_m
    b.change("shaft", viscous=viscous, coulomb=share * t)
    if form == "stribeck":
        b.change("shaft", stribeck=0.5 * share * t)
        return {}
    return {"viscous_friction_nms": viscous, "coulomb_friction_nm": share * t}
