# SPDX-License-Identifier: BSD-3-Clause
"""Integers of the core's signals to SI units and back; ``UNITS`` gives the unit of each signal.

The scale of a signal is the value of its LSB: format LSB times base.  Compare values count clocks.
"""

import math

from golden_model.fluxproof import OBSERVED
from golden_model.io import sample_latch

TURN_RAD = 2.0 * math.pi
SIGNALS = {p.name: p for p in sample_latch.BLOCK.outputs} | OBSERVED  # raw sample and references first

_OF_UNIT = {
    "A": "i_a i_b i_c i_d i_q i_q_ref i_d_ref i_q_ext residual_sum",
    "V": "u_dc u_max u_dec_d u_dec_q u_int_d u_int_q u_d u_q u_alpha u_beta u_applied_alpha u_applied_beta "
    "u_comp_d u_comp_q v_dead v_comp",
    "rad/s": "omega_me omega_chord omega_ref",
    "Wb": "lambda_d lambda_q lambda_c_d lambda_c_q lambda_m_alpha lambda_m_beta delta_lambda_d delta_lambda_q "
    "lambda_pi_d lambda_pi_q psi_m residual_d residual_q residual_mean_d residual_mean_q residual_sixth_d "
    "residual_sixth_q",
    "Nm": "torque",
    "degC": "temp_winding",
    "rad": "theta_me",
}
UNITS = {name: unit for unit, names in _OF_UNIT.items() for name in names.split()}  # the rest: "1"


# What 1.0 of a number in a register is: SI unit -> product of the bases (drive.py), the sample time T_s and the clock.
ONE_IS = {
    "1": "1",
    "A": "I_base",
    "V": "U_base",
    "rad/s": "omega_base",
    "Wb": "U_base/omega_base",
    "Nm": "1.5*pole_pairs*I_base*U_base/omega_base",
    "degC": "1 degC",
    "rad": "2*pi rad",
    "turn": "2*pi rad",
    "code": "half the codes",
    "ohm": "U_base/I_base",
    "ohm/K": "U_base/I_base/K",
    "H": "U_base/omega_base/I_base",
    "V/A": "U_base/I_base",
    "A/V": "I_base/U_base",
    "V/(A s)": "U_base/I_base/T_s",
    "1/Wb": "omega_base/U_base",
    "Nm s/rad": "1.5*pole_pairs*I_base*U_base/omega_base/omega_base",
    "Nm/rad": "1.5*pole_pairs*I_base*U_base/omega_base/omega_base/T_s",
    "Wb s/rad": "U_base/omega_base/omega_base",
    "A s/rad": "I_base/omega_base",
    "A/rad": "I_base/omega_base/T_s",
    "1/A": "1/I_base",
    "s": "1/omega_base",
    "s2": "1/omega_base/omega_base",
    "s/rad": "1/omega_base",
    "s2/rad2": "1/omega_base/omega_base",
    "1/s": "1/T_s",
    "A s/rad of shaft": "I_base*T_s/(2*pi)",
    "Nm s/rad of shaft": "1.5*pole_pairs*I_base*U_base/omega_base*T_s/(2*pi)",
    "A s2/rad": "I_base*T_s*T_s/(2*pi)",
    "Nm s2/rad": "1.5*pole_pairs*I_base*U_base/omega_base*T_s*T_s/(2*pi)",
}
_ONE_OF_REGISTER = {
    "k_delay": "2*pi/omega_base",
    "omega_0": "1/T_s",
    "position_kp": "omega_base/(2*pi*pole_pairs)",
    "move_speed": "2*pi/T_s",
    "way_stall": "omega_base*T_s",
    **dict.fromkeys(("dead_time", "min_pulse", "watchdog"), "1/clock_hz"),
    **dict.fromkeys(
        ("runaway_samples", "stall_samples", "emf_samples", "residual_samples", "heartbeat", "charge_samples"), "T_s"
    ),
}


def one_is(name, si_unit):
    """What 1.0 of a register or status value is, for software: electrical speed, peak values."""
    return _ONE_OF_REGISTER.get(name) or ONE_IS[si_unit]


def unit(name):
    """SI unit of a signal; electrical angles and speeds, peak values; "1" for duties, flags and counts."""
    return UNITS.get(name, "1")


def si_per_lsb(name, drive):
    """SI value of one LSB of the signal; KeyError for an unknown signal."""
    if name not in SIGNALS:
        raise KeyError(f"{name} is not a signal; known are {', '.join(SIGNALS)}")
    bases = drive.bases
    scale = {
        "A": bases.current_a,
        "V": bases.voltage_v,
        "rad/s": bases.omega_me_rad_s,
        "Wb": bases.flux_wb,
        "Nm": drive.torque_base_nm,
        "rad": TURN_RAD,
        "degC": 1.0,
        "1": 1.0,
    }[unit(name)]
    return SIGNALS[name].fmt.lsb * scale


def to_si(name, value, drive):
    """The signal's integer (or an array of them) in SI units."""
    return value * si_per_lsb(name, drive)


def from_si(name, value, drive):
    """Nearest integer for a value in SI units; angles wrap, anything else out of range is a ValueError."""
    lsb = si_per_lsb(name, drive)
    port = SIGNALS[name]
    if not math.isfinite(value):
        raise ValueError(f"{name} = {value} is not a finite number")
    integer = math.floor(value / lsb + 0.5)
    if unit(name) == "rad":
        return integer % (port.fmt.hi + 1)
    if not port.low <= integer <= port.high:
        lo, hi = port.low * lsb, port.high * lsb
        raise ValueError(f"{name} = {value:g} {unit(name)} is out of range: allowed is {lo:.6g} to {hi:.6g}")
    return integer
