# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of a simulated drive: named tuples for compiled code, SI units, peak values.

``ideal()`` is a drive without any effect; an effect changes fields of it (forms.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

SELF_LINEAR, SELF_CUBIC, SELF_TANH, SELF_RATIONAL, SELF_LANGEVIN, SELF_ROOT, SELF_SHIFTED = range(7)
CROSS_NONE, CROSS_SQUARE, CROSS_LEVELLING, CROSS_BOTH_LEVEL, CROSS_MODULUS = range(5)
DIRECTION_CLIP, DIRECTION_TANH, DIRECTION_ATAN, DIRECTION_CAPACITANCE = range(4)
DROP_NONE, DROP_CONSTANT, DROP_DIODE, DROP_ATAN = range(4)
WAVE_COSINE, WAVE_TRIANGLE, WAVE_SKEWED = range(3)
DELAY_MIX, DELAY_HALF, DELAY_SHIFT = range(3)


class Motor(NamedTuple):
    """Windings and iron.  psi_h rows: order, d amplitude [Wb], d phase, q amplitude [Wb], q phase."""

    pole_pairs: float
    r_a: float
    r_b: float
    r_c: float
    psi_m: float
    l_d: float
    l_q: float
    self_d: int
    self_q: int
    sat_d: float  # 1/A2 (cubic) or A (all others)
    sat_q: float
    shift_d: float  # A, of SELF_SHIFTED
    cross: int
    c_x: float  # Wb/A2; CROSS_MODULUS: Wb/A
    i_x: float  # A
    g_eddy: float  # S
    g_hyst: float  # S at w_hyst, falling with 1/speed
    w_hyst: float  # rad/s
    g_short: float  # S, across the rotational EMF of phase a alone
    psi_h: np.ndarray


class Bridge(NamedTuple):
    """The three legs.  dead_s: dead time.  leg_gain: lost share of the high time, per leg."""

    dead_s: float
    direction: int
    i_zone: float  # A, width of the zone around zero current
    drop: int
    v_drop: float
    i_drop: float
    r_drop: float
    leg_a: float
    leg_b: float
    leg_c: float
    delay_kind: int
    delay: float  # periods


class Shaft(NamedTuple):
    """Mechanics, at the mechanical shaft.  cogging rows: order per turn, amplitude [Nm], phase."""

    free: int
    inertia: float
    viscous: float
    coulomb: float
    stribeck: float
    w_stribeck: float
    w_sign: float
    cogging: np.ndarray
    unbalance: float


class Sensor(NamedTuple):
    """Sensors.  measured = true * (1 + scale) * (1 + gain) + offset, then noise and quantisation."""

    scale: float
    gain_a: float
    gain_b: float
    gain_c: float
    quadratic: float  # 1/A
    cubic: float  # 1/A2
    cross_talk: float
    lowpass_s: float
    noise_a: float
    lsb_a: float
    range_a: float
    two_sensors: int
    skew_s: float
    ecc_1: float
    ecc_1_phase: float
    ecc_1_wave: int
    ecc_2: float
    ecc_2_phase: float
    ecc_n: float
    ecc_order: float
    theta_noise: float
    theta_lsb: float  # electrical
    pll_rad_s: float  # 0: the angle is not tracked by a PLL
    omega_exact: int
    theta_late_s: float  # the angle is latched this long after the valley
    omega_filter_rad_s: float
    u_gain: float
    u_offset: float
    u_noise: float
    u_lsb: float
    torque_noise: float


class Control(NamedTuple):
    """The float field-oriented controller, which uses the nominal machine only."""

    kp_d: float
    ki_d: float
    kp_q: float
    ki_q: float
    l_d: float
    l_q: float
    psi_m: float
    decouple: float
    svm: int
    limit: float  # share of the linear range
    duty_min: float
    duty_lsb: float
    speed_loop: int
    kp_w: float
    ki_w: float
    i_limit: float


class Drive(NamedTuple):
    """A drive and its sample time."""

    motor: Motor
    bridge: Bridge
    shaft: Shaft
    sensor: Sensor
    control: Control
    period_s: float


class Course(NamedTuple):
    """External inputs, one value per row, shape (n + 1,) except the references, shape (n,).

    u_dc [V] truly there; u_hidden [V] added to it and not seen by the sensor; omega [rad/s] mechanical,
    imposed or asked for by the speed loop; load [Nm] of a free shaft; r_scale (3, n + 1), psi_scale: factors
    of the phases' resistances and of the magnet flux; offsets (3, n + 1) [A] of the current sensors;
    theta_offset [rad] electrical, of the encoder.
    """

    u_dc: np.ndarray
    u_hidden: np.ndarray
    omega: np.ndarray
    load: np.ndarray
    r_scale: np.ndarray
    psi_scale: np.ndarray
    offsets: np.ndarray
    theta_offset: np.ndarray
    i_d_ref: np.ndarray
    i_q_ref: np.ndarray


NO_HARMONICS = np.zeros((0, 5))
NO_COGGING = np.zeros((0, 3))


def ideal(machine: dict, inertia: float, control: Control, period_s: float) -> Drive:
    """A drive without any effect.  machine: the [machine] section of drive.toml."""
    r = machine["resistance_ohm"]
    motor = Motor(
        float(machine["pole_pairs"]), r, r, r, machine["magnet_flux_wb"], machine["inductance_d_h"],
        machine["inductance_q_h"], SELF_LINEAR, SELF_LINEAR, 1.0, 1.0, 0.0, CROSS_NONE, 0.0, 1.0,
        0.0, 0.0, 1.0, 0.0, NO_HARMONICS,
    )  # fmt: skip
    bridge = Bridge(0.0, DIRECTION_CLIP, 1.0, DROP_NONE, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, DELAY_MIX, 0.0)
    shaft = Shaft(0, inertia, machine.get("viscous_friction_nms", 0.0), 0.0, 0.0, 1.0, 1.0, NO_COGGING, 0.0)
    sensor = Sensor(
        *(0.0,) * 10, 1e30, 0, 0.0, 0.0, 0.0, WAVE_COSINE, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1, 0.0,
        2000.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip
    return Drive(motor, bridge, shaft, sensor, control, period_s)
