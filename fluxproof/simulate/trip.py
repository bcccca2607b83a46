# SPDX-License-Identifier: BSD-3-Clause
"""What a trip at the top speed leaves to the bus: the rectified EMF, and what capacitor and switches would see.

With the gates off the diodes of the inverter are a rectifier of the EMF, of which a line voltage has the peak

    u = sqrt(3)*omega_me*psi_m                                the bus ends there, if nothing takes the energy

The windings' inductance carries the bus beyond it, and the current that flowed at the trip adds its own energy; so the
bus voltage is that of a run: full torque at the speed that trips as overspeed, gates off, a shaft that keeps its
speed, the drive's own supply.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.scenarios import RPM
from fluxproof.simulate.figures import figure
from fluxproof.simulate.run import run
from fluxproof.simulate.scene import Scene, Stage
from golden_model.drive import Drive
from golden_model.formats import PU
from golden_model.registers import RegisterSet

RAMP_S, HELD_S, AFTER_S = 0.15, 0.05, 0.1  # to the top speed with the table, at it, after the trip
FROM = 0.3  # of the top speed, where the ramp begins
OF_TOP = 0.99  # of the speed that trips


@dataclass(frozen=True)
class Trip:
    """A trip at ``rpm``: rectified EMF [V], largest bus voltage of the run [V], mean braking torque after it [Nm]."""

    rpm: float
    emf_v: float
    bus_v: float
    braking_nm: float


def top_speed(register_set: RegisterSet, drive: Drive) -> float:
    """Mechanical speed beyond which overspeed trips [rad/s]."""
    limit = next(row.represented for row in register_set.rows if row.name == "omega_trip")
    return limit / drive.machine.pole_pairs


def trip(drive: Drive, register_set: RegisterSet) -> Trip:
    """Of a drive as its file describes it; below base speed and without ratings the EMF alone, nothing is run."""
    top = OF_TOP * top_speed(register_set, drive)
    emf = math.sqrt(3.0) * drive.machine.pole_pairs * top * drive.machine.magnet_flux_wb
    if emf <= drive.inverter.dc_bus_v and not ratings(drive):
        return Trip(top / RPM, emf, drive.inverter.dc_bus_v, 0.0)
    scene = trip_scene(drive, top)
    done = run(drive, register_set, scene)
    after = slice(scene.stage("gates off").first, None)
    braking = -float(np.mean(done["true_torque"][after]))
    return Trip(top / RPM, emf, float(done["true_u_dc"][after].max()), braking)


def trip_scene(drive: Drive, top: float) -> Scene:
    """Up to ``top`` [rad/s] at full torque where the table weakens the field, else without a current; gates off."""
    t_s, weakens = drive.sample_time_s, drive.core.references
    before, after = round((RAMP_S + HELD_S) / t_s) if weakens else 1, round(AFTER_S / t_s)
    n, zeros = before + after, np.zeros(before + after, np.int64)
    ramp = np.minimum(FROM + (1.0 - FROM) * np.arange(n) * t_s / RAMP_S, 1.0) if weakens else np.ones(n)
    on = (np.arange(n) < before).astype(np.int64) * weakens
    scenario = Scenario(
        omega_ref=zeros, load=top * ramp, u_dc=np.full(n, drive.inverter.dc_bus_v), i_d_ref=zeros,
        i_q_ext=zeros + PU.hi * weakens, speed_mode=zeros, enable=on, omega_m=top * ramp[0],
    )  # fmt: skip
    stages = (Stage("top speed", 0, before, drive.current_limit_a * weakens), Stage("gates off", before, n, 0.0))
    return Scene(scenario, stages, imposed=True)


def ratings(drive: Drive) -> dict[str, float]:
    """{key: volts} of what the file says capacitor and switches stand."""
    given = {"[supply] capacitor_rated_v": drive.supply.capacitor_rated_v,
             "[inverter] switch_rated_v": drive.inverter.switch_rated_v}  # fmt: skip
    return {key: volts for key, volts in given.items() if volts is not None}


def of_trip(drive: Drive, found: Trip, u_dc_high: float) -> dict:
    """The figures of a trip; ``u_dc_high``: the limit of the bus voltage [V]."""
    run_at_all = found.emf_v > drive.inverter.dc_bus_v or ratings(drive)
    figures = {
        "speed_of_the_trip": figure(found.rpm, "rpm", "calculated"),
        "rectified_emf": figure(found.emf_v, "V", "calculated"),
        "u_dc_high": figure(u_dc_high, "V", "calculated"),
        "bus_voltage_after_the_trip": figure(found.bus_v, "V", "simulated" if run_at_all else "calculated"),
        "braking_torque_after_the_trip": figure(found.braking_nm, "Nm", "simulated" if run_at_all else "calculated"),
    }
    return figures | {key.split()[1]: figure(volts, "V", "given") for key, volts in ratings(drive).items()}


def beyond(drive: Drive, found: Trip, highest_v: float) -> str:
    """Why the bus voltage is not allowed; empty if it is or no rating is given.  ``highest_v``: of the other runs."""
    for key, volts in ratings(drive).items():
        if highest_v > volts:
            return f"the bus reaches {highest_v:.4g} V, {key} is {volts:g} V"
        if found.bus_v > volts:
            return f"{told(drive, found)}, {key} is {volts:g} V: a lower [protection] overspeed_rad_s, a brake resistor"
    return ""


def told(drive: Drive, found: Trip) -> str:
    """What a trip at the top speed does, in words."""
    emf = f"a trip at {found.rpm:.4g} rpm rectifies an EMF of {found.emf_v:.4g} V"
    return f"{emf}, which takes the bus from {drive.inverter.dc_bus_v:g} V to {found.bus_v:.4g} V"


def unjudged(drive: Drive, found: Trip) -> str:
    """What follows where the EMF is beyond the bus and a rating is missing; else empty."""
    if found.emf_v <= drive.inverter.dc_bus_v or len(ratings(drive)) == 2:
        return ""
    return f"{told(drive, found)}; [supply] capacitor_rated_v and [inverter] switch_rated_v would judge it"
