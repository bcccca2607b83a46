# SPDX-License-Identifier: BSD-3-Clause
"""The drives of the study: three machines whose speed range the torque table opens."""

from __future__ import annotations

import dataclasses

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.runs import ClosedLoop
from fluxproof.plant import IMPOSED_SPEED, Machine
from golden_model import drive as drives
from golden_model.registers import registers
from golden_model.units import from_si

SPEEDS = 4.6  # largest speed that the speed base holds twice, over the rated one


def weakened(path, speeds=SPEEDS, **control):
    """The drive of a file with the torque table, its speed base wide enough for ``speeds`` times the rated speed."""
    drive = drives.load(path)
    m = drive.machine
    flux_base = drive.bases.voltage_v / (m.pole_pairs * m.rated_speed_rad_s * speeds / 2.0)
    control.setdefault("flux_compensation_limit_wb", min(0.5 * drive.nominal_flux_wb, 0.95 * flux_base))
    return dataclasses.replace(
        drive,
        core=dataclasses.replace(drive.core, references=True),
        base_choice=dataclasses.replace(
            drive.base_choice, omega_me_rad_s=m.pole_pairs * m.rated_speed_rad_s * speeds / 2.0
        ),
        control=dataclasses.replace(drive.control, **control),
        protection=dataclasses.replace(drive.protection, overspeed_rad_s=0.98 * speeds * m.rated_speed_rad_s),
    )


def reluctance(drive):
    """The drive with a saturating PM-assisted reluctance motor in place of its own: an invented one, same ratings."""
    m = drive.machine
    machine = dataclasses.replace(
        m, inductance_d_h=m.inductance_d_h, inductance_q_h=4.0 * m.inductance_d_h, magnet_flux_wb=0.4 * m.magnet_flux_wb
    )
    return dataclasses.replace(drive, machine=machine)


def saturated(machine) -> Machine:
    """The plant of a nameplate whose q axis saturates: 25 % of L_q lost at rated current, cross saturation besides."""
    i = machine.rated_current_a
    extra = {
        "saturation_q_per_a2": 0.3 / i**2,
        "saturation_d_per_a2": 0.05 / i**2,
        "cross_saturation_wb_per_a2": 0.05 * machine.inductance_d_h / i,
    }
    return Machine.from_mapping({**vars(machine), **extra})


def scene(drive, torque_nm, speed_rad_s, u_dc=None, enable=None) -> Scenario:
    """Torque mode at imposed speeds: arrays (n,) of torque [Nm], mechanical speed [rad/s] and bus voltage [V]."""
    n = len(speed_rad_s)
    zeros = np.zeros(n, np.int64)
    lsb = drive.torque_base_nm * 2.0**-16
    return Scenario(
        omega_ref=zeros,
        load=np.asarray(speed_rad_s, float),
        u_dc=np.full(n, drive.inverter.dc_bus_v) if u_dc is None else u_dc,
        i_d_ref=zeros,
        i_q_ext=np.clip(np.round(np.asarray(torque_nm) / lsb), -131072, 131071).astype(np.int64),
        speed_mode=zeros,
        enable=np.ones(n, np.int64) if enable is None else enable,
        omega_m=float(speed_rad_s[0]),
    )


def over_the_border(carrier_half: int, periods: int) -> ClosedLoop:
    """Paper 001's motor across base speed and back with torques of both signs, a bus sag and a stop of the gates."""
    return _across(drives.with_carrier(weakened(DRIVES / "paper001.toml"), carrier_half), periods)


def over_the_hexagon(carrier_half: int, periods: int) -> ClosedLoop:
    """The same with over-modulation."""
    return _across(drives.with_carrier(overmodulated(weakened(DRIVES / "paper001.toml")), carrier_half), periods)


def overmodulated(drive, **control):
    """The drive with over-modulation; ``control``: keys of [control]."""
    core = dataclasses.replace(drive.core, overmodulation=True)
    return dataclasses.replace(drive, core=core, control=dataclasses.replace(drive.control, **control))


def _across(drive, periods: int) -> ClosedLoop:
    """The scene of both."""
    k = np.arange(periods) / periods
    speed = drive.machine.rated_speed_rad_s * (0.4 + 2.4 * np.sin(np.pi * k))
    torque = np.where(np.floor(9 * k) % 3 == 0, 2.5, np.where(np.floor(9 * k) % 3 == 1, 9.0, -4.0))
    u_dc = drive.inverter.dc_bus_v * np.where((k > 0.55) & (k < 0.62), 0.8, 1.0)
    enable = ((k < 0.7) | (k > 0.72)).astype(np.int64)
    return ClosedLoop(drive, registers(drive), scene(drive, torque, speed, u_dc, enable), mode=IMPOSED_SPEED)


def speed_loop(carrier_half: int, periods: int) -> ClosedLoop:
    """The speed loop through base speed: its output is a torque."""
    drive = drives.with_carrier(weakened(DRIVES / "paper001.toml"), carrier_half)
    n, ones = periods, np.ones(periods, np.int64)
    target = from_si("omega_ref", 2.2 * drive.machine.rated_speed_rad_s * drive.machine.pole_pairs, drive)
    scenario = Scenario(
        omega_ref=target * ones, load=np.zeros(n), u_dc=np.full(n, drive.inverter.dc_bus_v), i_d_ref=0 * ones,
        i_q_ext=0 * ones, speed_mode=ones, enable=ones, omega_m=1.5 * drive.machine.rated_speed_rad_s,
    )  # fmt: skip
    return ClosedLoop(drive, registers(drive), scenario)
