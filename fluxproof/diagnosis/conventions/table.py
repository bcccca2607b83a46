# SPDX-License-Identifier: BSD-3-Clause
"""The mistakes that people make with drive recordings and data sheets, one entry each.

A new entry is a new line; of entries that leave the same balance the first is reported first.  Units that only the
numbers reveal stand in units.py, exchanged columns and signs in exchanges.py.

Sources of the factors: amplitude-invariant against power-invariant Clarke, sqrt(3/2); peak against rms, sqrt(2); phase
against line-to-line voltage, sqrt(3), and resistance or inductance between two terminals, 2; a
voltage or torque constant of the shaft, the pole pairs.
"""

from __future__ import annotations

import math

from fluxproof.diagnosis.conventions.reading import Reading

ROOT2, ROOT3, POWER = math.sqrt(2.0), math.sqrt(3.0), math.sqrt(1.5)
KRPM = 1000.0 * math.pi / 30.0  # rad/s
R, L, PSI = ("resistance_ohm",), ("inductance_d_h", "inductance_q_h"), ("magnet_flux_wb",)


def _machine(code, names, factor, says, **more):
    """A reading of the drive file: its values are ``factor`` times the true ones."""
    keys = {key: 1.0 / factor for key in names}
    return Reading(code, ", ".join((*names, *more)), says, machine=keys | {k: 1.0 / f for k, f in more.items()})


def _angle(degrees, meaning):
    sign, name = "ahead of" if degrees > 0 else "behind", abs(degrees)
    code = f"angle_{'minus_' if degrees < 0 else ''}{name}"
    return Reading(
        code, "theta_e", f"the angle is {name} degrees {sign} the d axis{meaning}", turn=-math.radians(degrees)
    )


READINGS = (
    # the drive file
    _machine("machine_line_rl", (*R, *L), 2.0, "R, L_d and L_q are line-to-line values, twice the phase values"),
    _machine("machine_half_rl", (*R, *L), 0.5, "R, L_d and L_q are half the phase values"),
    _machine("resistance_line", R, 2.0, "the resistance is a line-to-line value, twice the phase value"),
    _machine("inductances_line", L, 2.0, "L_d and L_q are line-to-line values, twice the phase values"),
    _machine("psi_line", PSI, ROOT3, "the magnet flux is a line-to-line value, 1.7321 of the phase value"),
    _machine("psi_rms", PSI, 1 / ROOT2, "the magnet flux is an rms value, 0.7071 of the peak value"),
    _machine("psi_line_rms", PSI, POWER, "the magnet flux is a line-to-line rms value, 1.2247 of the peak value"),
    _machine(
        "machine_line", (*R, *L), 2.0,
        "R, L_d, L_q (2 times) and the magnet flux (1.7321 times) are line-to-line values",
        magnet_flux_wb=ROOT3,
    ),
    _machine(
        "machine_line_rms", (*R, *L), 2.0,
        "R, L_d, L_q (2 times) and the magnet flux (1.2247 times, rms) are line-to-line values", magnet_flux_wb=POWER,
    ),
    _machine("psi_milli", PSI, 1e3, "the magnet flux is in mWb"),
    _machine("inductances_milli", L, 1e3, "L_d and L_q are in mH"),
    _machine("inductances_micro", L, 1e6, "L_d and L_q are in uH"),
    _machine("resistance_milli", R, 1e3, "the resistance is in milliohm"),
    # scales of recorded columns
    Reading("currents_rms", "i", "the currents are rms values, 0.7071 of the peak values", currents=ROOT2),
    Reading(
        "currents_double", "i", "the recorded currents are twice the true ones (peak to peak)", currents=0.5, unit=True,
    ),
    Reading("currents_half", "i", "the recorded currents are half the true ones", currents=2.0, unit=True),
    Reading(
        "currents_power_invariant", "i_d, i_q", "the dq currents are power-invariant, 1.2247 of the peak values",
        currents=1 / POWER, dq=True,
    ),
    Reading(
        "dq_power_invariant", "i_d, i_q, u_d_ref, u_q_ref",
        "the dq currents and voltages are power-invariant, 1.2247 of the peak values",
        currents=1 / POWER, voltages=1 / POWER, dq=True,
    ),
    Reading(
        "dq_rms", "i_d, i_q, u_d_ref, u_q_ref",
        "the dq currents and voltages are rms values, 0.7071 of the peak values",
        currents=ROOT2, voltages=ROOT2, dq=True,
    ),
    Reading(
        "voltages_rms", "u_d_ref, u_q_ref", "the voltages are rms values, 0.7071 of the peak values", voltages=ROOT2,
        dq=True,
    ),
    Reading(
        "voltages_half", "u_d_ref, u_q_ref", "the recorded voltages are half the true ones", voltages=2.0, dq=True,
        unit=True,
    ),
    Reading(
        "voltages_double", "u_d_ref, u_q_ref", "the recorded voltages are twice the true ones", voltages=0.5, dq=True,
        unit=True,
    ),
    Reading(
        "voltages_line", "u_d_ref, u_q_ref", "the voltages are line-to-line values, 1.7321 of the phase values",
        voltages=1 / ROOT3, dq=True,
    ),
    Reading(
        "voltages_line_rms", "u_d_ref, u_q_ref",
        "the voltages are line-to-line rms values, 1.2247 of the phases' peak values", voltages=1 / POWER, dq=True,
    ),
    Reading(
        "voltages_power_invariant", "u_d_ref, u_q_ref",
        "the dq voltages are power-invariant, 1.2247 of the peak values", voltages=1 / POWER, dq=True,
    ),
    Reading("bus_half", "u_dc", "the recorded bus voltage is half the true one", bus=2.0, dq=False, unit=True),
    Reading("bus_double", "u_dc", "the recorded bus voltage is twice the true one", bus=0.5, dq=False, unit=True),
    # the angle
    _angle(90, ": it is the angle of the q axis"),
    _angle(-90, ": its d axis is the q axis of the model"),
    _angle(180, ": the magnet points the other way"),
    _angle(60, ", one sector"),
    _angle(-60, ", one sector"),
    _angle(120, ", one phase"),
    _angle(-120, ", one phase"),
    _angle(30, ": counted from a line-to-line voltage"),
    _angle(-30, ": counted from a line-to-line voltage"),
)  # fmt: skip


def says_pole_pairs(right, stated) -> str:
    """The clause about wrong pole pairs, whether the file was read again or only the balance tells them."""
    return f"the machine has {right} pole pair{'s' * (right != 1)}, not {stated} as in the drive file"


def pole_pairs_for(nominal) -> list[Reading]:
    """Readings with other pole pairs: a digit beside the right one, or poles in place of pairs."""
    stated = nominal.machine.pole_pairs
    near = {stated - 2, stated - 1, stated + 1, stated + 2, 2 * stated} | ({stated // 2} if stated % 2 == 0 else set())
    return [
        Reading(
            f"pole_pairs {n}", "machine.pole_pairs",
            says_pole_pairs(n, stated),
            pole_pairs=n, speed=n / stated,
        )
        for n in sorted(near) if n > 0
    ]  # fmt: skip


def readings_for(nominal) -> list[Reading]:
    """All readings; those of the shaft depend on the pole pairs."""
    pairs = nominal.machine.pole_pairs
    if pairs == 1:
        return list(READINGS)
    return [
        *READINGS,
        _machine(
            "psi_of_shaft", PSI, float(pairs),
            f"the magnet flux is per rad/s of the shaft, {pairs} times the flux linkage",
        ),
        _machine(
            "psi_torque", PSI, 1.5 * pairs, f"the magnet flux is a torque constant, {1.5 * pairs:g} times the flux"
        ),
        *(_machine(code, PSI, factor, f"the magnet flux is {what}, {factor:.5g} times the flux linkage")
          for code, factor, what in _of_data_sheets(pairs)),
    ]  # fmt: skip


def _of_data_sheets(pairs):
    """(code, factor, what) of the constants of a data sheet that are rms values and of the shaft."""
    line = pairs * POWER  # rms value of the line-to-line voltage at 1 rad/s of the shaft, per flux linkage
    return (
        ("psi_line_rms_of_shaft", line, "a voltage constant, line-to-line rms per rad/s of the shaft"),
        ("psi_line_rms_krpm", line * KRPM, "a voltage constant, line-to-line rms per 1000 rpm"),
        ("psi_torque_rms", 1.5 * pairs * ROOT2, "a torque constant per ampere rms"),
    )
