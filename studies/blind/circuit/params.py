# SPDX-License-Identifier: BSD-3-Clause
"""The numbers that the compiled simulation takes; SI units, peak values, reference temperature 25 degC."""

from __future__ import annotations

from typing import NamedTuple


class Machine(NamedTuple):
    """Magnetic circuit, winding, losses, shaft."""

    pole_pairs: int
    r: float  # Ohm at 25 degC
    psi: float  # Wb, source of the magnets at 25 degC
    gap_d: float  # 1/H, gap and leakage in the d axis
    gap_q: float
    rated: float  # A
    inertia: float  # kg m2, rotor alone
    teeth: int  # per pole pair, even
    tooth_t: float  # T in a tooth on the axis of a flux linkage of 1 Wb
    yoke_t: float
    bridge_d_t: float  # T in the rotor iron
    bridge_q_t: float
    iron_m: float  # A of stator current that magnetise a path to 1 A/m
    r_a: float = 0.0  # share of r beyond r in each phase
    r_b: float = 0.0
    r_c: float = 0.0
    slot: float = 0.0  # share by which the gap's reluctance pulsates with the teeth
    emf_6: float = 0.0  # share of psi: forward harmonic in the d axis
    emf_12: float = 0.0
    emf_q: float = 0.0  # the same in the q axis, relative to that in the d axis
    emf_phase: float = 0.0
    cogging: float = 0.0  # Nm
    friction: float = 0.0  # Nm
    g_eddy: float = 0.0  # S across the induced voltage
    t_eddy: float = 1e-4  # s, diffusion of the eddy currents
    g_hysteresis: float = 0.0  # A per Wb, in the direction of the induced voltage
    short_share: float = 0.0  # of the turns of phase a
    short_r: float = 1.0  # Ohm, in the shorted turns
    short_l: float = 1.0  # H
    loose_r: float = 0.0  # Ohm of a connector in phase a when it opens most
    loose_hz: float = 37.0  # of the vibration


class Thermal(NamedTuple):
    """Three nodes in a chain to the ambient; capacities divided so that minutes pass in seconds."""

    c_winding: float  # J/K
    c_iron: float
    c_magnet: float
    k_winding: float  # W/K, winding to iron
    k_magnet: float  # magnet to iron
    k_ambient: float
    magnet_share: float  # of the core loss that arises in the magnets
    magnet_w: float = 0.0  # W into the magnets from a hot shaft
    alpha: float = 0.00393  # 1/K of copper
    beta: float = -0.0011  # 1/K of the magnets


class Inverter(NamedTuple):
    """Two-level bridge and its supply."""

    period: float
    bus: float  # V without load
    rated: float
    dead: float  # s
    t_on: float  # s at small current; grows with it
    t_off: float  # s at rated current
    c_leg: float  # F, output capacitance of a leg
    v_switch: float  # V
    v_diode: float
    r_on: float  # Ohm
    c_bus: float  # F
    r_bus: float  # Ohm of battery or rectifier
    rectifier: bool
    mains_hz: float
    late_a: float = 0.0  # s by which the driver of leg a switches on later
    late_b: float = 0.0
    late_c: float = 0.0


class Sensors(NamedTuple):
    """Converters, encoder, slower messages."""

    range_a: float
    bits: int
    range_v: float
    encoder_bits: int
    noise_a: float  # A
    noise_v: float
    gain_a: float = 1.0
    gain_b: float = 1.0
    gain_c: float = 1.0
    offset_a: float = 0.0
    offset_b: float = 0.0
    offset_c: float = 0.0
    bus_gain: float = 1.0
    bus_every: int = 1  # periods between two messages
    bus_late: int = 0  # periods by which a message is old
    angle: float = 0.0  # rad electrical
    angle_late: float = 0.0  # s
    runout: float = 0.0  # rad mechanical, once a turn
    runout_phase: float = 0.0
    resolver: float = 0.0  # rad mechanical, twice a turn
    speed_every: int = 10
    hum: float = 0.0  # A of mains hum in the currents


class Control(NamedTuple):
    """Current regulator in integers; currents and voltages have 15 fractional bits of their ranges."""

    kp: int  # 10 fractional bits
    ki: int  # 20 fractional bits
    ticks: int  # of a PWM period
    ff_psi: int  # induced voltage per code of the speed message, 16 fractional bits
    ff_d: int  # drop of L_d per code and current, 20 fractional bits
    ff_q: int


class Bench(NamedTuple):
    """The load machine."""

    inertia: float  # kg m2, its own
    kp: float  # Nm s
    ki: float  # Nm
