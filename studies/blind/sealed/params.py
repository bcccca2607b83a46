# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of the real drive and its controller, as the compiled simulation takes them; SI units, peak values."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

LINEAR, ARCTAN, TANH, ROOT = range(4)
ENCODER, RESOLVER = range(2)
LOAD_VALLEY, LOAD_PEAK = range(2)
SINE, MIDDLE, THIRD = range(3)


class Machine(NamedTuple):
    """Windings, magnets, iron and shaft."""

    pole_pairs: float
    r: float  # Ohm at 25 degrees
    l_d: float
    l_q: float
    psi: float
    curve: int = LINEAR  # shape of the saturation
    floor_d: float = 1.0  # saturated over unsaturated inductance
    floor_q: float = 1.0
    knee_d: float = 1.0  # A
    knee_q: float = 1.0
    bias: float = 0.0  # A of d current that the magnet stands for
    slope: float = 1.0  # of the unit curve at the bias
    cross: float = 0.0  # Wb
    cross_d: float = 1.0  # A
    cross_q: float = 1.0
    cross_bias: float = 0.0
    harmonic: np.ndarray = np.zeros(4, np.complex128)  # Wb, turning with ORDERS times the angle
    slot: float = 0.0  # Wb, slotting of the q flux
    slot_knee: float = 1.0  # A
    slot_phase: float = 0.0
    eccentric: float = 0.0  # share of psi, once a mechanical turn
    r_fe: float = 0.0  # Ohm; 0: no iron loss
    tau_fe: float = 1e-5  # s
    short_share: float = 0.0  # turns short-circuited in phase a
    r_short: float = 1.0
    tau_short: float = 1e-5
    r_phase: np.ndarray = np.zeros(3)
    inertia: float = 1e-3
    viscous: float = 0.0
    coulomb: float = 0.0
    stribeck: float = 0.0
    creep: float = 1.0  # rad/s
    cog: float = 0.0  # Nm
    cog_order: float = 0.0
    cog_phase: float = 0.0
    heat: float = 0.0  # K for a joule
    tau_heat: float = 1.0  # s
    magnet_drop: float = 0.0  # share of psi at the end
    tau_magnet: float = 1.0


ORDERS = np.array([-6.0, 6.0, -12.0, 12.0])


class Inverter(NamedTuple):
    """Legs and bus."""

    period: float
    u_source: float
    r_source: float
    c_bus: float
    ripple: float = 0.0  # share of the source, at ripple_hz
    ripple_hz: float = 300.0
    dead: float = 0.0  # s
    c_leg: float = 1e-9  # F
    v_on: float = 0.0  # V at the rated current
    i_on: float = 1.0
    i_rated: float = 1.0
    late: float = 0.0  # s by which the whole carrier is late
    load_at: int = LOAD_VALLEY
    extra: int = 0  # periods by which duties take effect later
    steps: int = 20


class Sensors(NamedTuple):
    """What the electronics make of currents, angle and bus."""

    offset: np.ndarray  # A
    gain: np.ndarray
    lsb: float  # A
    noise: float  # A
    tau: float = 0.0  # s, anti-alias filter
    skew: float = 0.0  # s after the middle of the zero vector
    play: float = 0.0  # A, half the width of a hysteresis
    bend: float = 0.0  # share by which full scale reads low
    talk: float = 0.0  # share of the neighbouring phase
    range_a: float = 1.0
    kind: int = ENCODER
    angle_lsb: float = 1e-4  # rad mechanical
    angle_noise: float = 0.0
    track: float = 1000.0  # rad/s of the resolver's loop
    angle: float = 0.0  # rad electrical
    runout: float = 0.0  # rad mechanical
    runout_phase: float = 0.0
    twist: float = 0.0  # rad/Nm mechanical
    bus_gain: float = 1.0
    bus_lsb: float = 0.1
    bus_noise: float = 0.05
    bus_tau: float = 0.0


class Control(NamedTuple):
    """What the controller believes and how fast it is."""

    pole_pairs: float
    r: float
    l_d: float
    l_q: float
    psi: float
    current: float
    inertia: float
    period: float
    bandwidth: float  # rad/s
    complex_vector: bool
    damping: float  # active resistance as a share of bandwidth * L
    speed_loop: bool
    speed_bandwidth: float
    speed_filter: float  # rad/s
    d_share: float  # i_d over |i_q| of the speed loop
    modulation: int
    ticks: float  # of the PWM counter in a period
