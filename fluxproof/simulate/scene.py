# SPDX-License-Identifier: BSD-3-Clause
"""The scene that a drive is put through, chosen from its own data: what it can reach, and how long its loops take.

Speeds are mechanical, [rad/s]; currents peak values.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.scenarios import RPM, scenario
from fluxproof.plant.transforms import linear_limit
from golden_model.drive import Drive
from golden_model.drive_keys import DriveError
from golden_model.formats import PU
from golden_model.protection_limits import regen_end_v
from golden_model.scaling import speed_gains
from golden_model.units import from_si

TAIL = 0.15  # of a stage, at its end: what must have settled
LOW, TOP, LOADED = 0.3, 0.8, 0.5  # of the rated speed, twice, and of the current limit
OF_REACH = 0.9  # of the speed at which the loaded drive fills the voltage circle
LONGEST_COAST_S = 20.0  # a shaft that coasts longer, with a bus that takes no more, is not waited for
LONGEST_S = 1.0  # an acceleration that takes longer is one to a lower speed
MOST_PERIODS = 1_000_000  # about half a minute of computing
SETTLE = 30.0  # over the crossover of the speed loop [rad/s]: six time constants of its integral
STEP_SAMPLES = 300  # before and after the step of the current
OFF_SAMPLES = 60  # of these: on a shaft that turns the gates come on when the core knows the speed, as in a drive
STEP_OF_LIMIT = 0.3
OF_STEP = 0.7  # of the speed at which the step's current fills the voltage circle: the rest makes the step


@dataclass(frozen=True)
class Stage:
    """Part of a scene: its name, first and end sample, reference (rpm or A) and load [Nm] in it."""

    name: str
    first: int
    end: int
    reference: float
    load: float = 0.0


@dataclass(frozen=True)
class Scene:
    """A scenario and its stages; ``imposed``: the shaft is driven, the scenario's load is its speed."""

    scenario: Scenario
    stages: tuple[Stage, ...]
    imposed: bool = False
    shortened: bool = False  # speeds were lowered for LONGEST_S

    def stage(self, name: str) -> Stage:
        """The stage of this name; KeyError if there is none."""
        return {stage.name: stage for stage in self.stages}[name]


def torque_per_a(drive: Drive) -> float:
    """Torque of 1 A of i_q at i_d = 0 [Nm/A]."""
    return 1.5 * drive.machine.pole_pairs * drive.machine.magnet_flux_wb


def torque_code(drive: Drive, i_q: float) -> int:
    """i_q_ext for a current [A]; with the torque table it is a torque, that of this current at i_d = 0."""
    if not drive.core.references:
        return int(from_si("i_q_ext", i_q, drive))
    asked = torque_per_a(drive) * i_q / drive.torque_base_nm / PU.lsb
    return int(np.clip(round(asked), PU.lo, PU.hi))


def voltage(drive: Drive, omega_m: float, i_q: float) -> float:
    """Magnitude of the phase voltage in steady state at i_d = 0 [V]."""
    m = drive.machine
    omega = m.pole_pairs * omega_m
    return math.hypot(m.resistance_ohm * i_q + omega * m.magnet_flux_wb, omega * m.inductance_q_h * i_q)


def voltage_limit(drive: Drive) -> float:
    """Radius of the voltage circle at the nominal bus, reserve taken off [V]."""
    return linear_limit(drive.inverter.dc_bus_v) * (1.0 - drive.control.voltage_reserve)


def reach(drive: Drive, i_q: float) -> float:
    """Mechanical speed at which ``i_q`` fills the voltage circle [rad/s]; 0 if it does at standstill."""
    limit = voltage_limit(drive)
    low, high = 0.0, 100.0 * drive.machine.rated_speed_rad_s
    for _ in range(80):
        middle = (low + high) / 2.0
        low, high = (middle, high) if voltage(drive, middle, i_q) <= limit else (low, middle)
    return low


def main_scene(drive: Drive) -> Scene:
    """Start, speed step, load step, load off, reversal; without a speed loop steps of torque on a driven shaft."""
    return speed_scene(drive) if speed_gains(drive)[0] > 0.0 else torque_scene(drive)


def speed_scene(drive: Drive) -> Scene:
    """The scene of a drive with a speed loop; DriveError without an inertia or a flux, or if it would take too long."""
    for key in ("inertia_kgm2", "magnet_flux_wb"):
        if getattr(drive.machine, key) <= 0.0:
            raise DriveError(f"[machine] {key} = 0 is out of range: allowed is above 0, to simulate a speed loop")
    m, i_load = drive.machine, LOADED * drive.current_limit_a
    top = min(TOP * m.rated_speed_rad_s, OF_REACH * reach(drive, i_load))
    per_s = torque_per_a(drive) * drive.current_limit_a / m.inertia_kgm2  # acceleration [rad/s2]
    quickest = LONGEST_S * per_s / 2.0  # the reversal is twice the speed
    shortened = top > quickest
    top = min(top, quickest)
    low = LOW / TOP * top
    settle = SETTLE / crossover(drive)
    load = torque_per_a(drive) * i_load
    plan = (  # name, speed, load, change of speed
        ("start", low, 0.0, low),
        ("speed step", top, 0.0, top - low),
        ("load step", top, load, 0.0),
        ("load off", top, 0.0, 0.0),
        ("reversal", -top, 0.0, 2.0 * top),
    )
    stages, now = [], 0.0
    for name, speed, torque, change in plan:
        length = settle + 1.3 * change / per_s
        if name == "reversal":
            length += coast_s(drive, top) / (1.0 - TAIL)
        first = round(now / drive.sample_time_s)
        now += length
        stages.append(Stage(name, first, round(now / drive.sample_time_s), speed / RPM, torque))
    if stages[-1].end > MOST_PERIODS:
        asked = f"a speed loop that crosses over at {crossover(drive) / 2.0 / math.pi:.3g} Hz"
        least = "faster: see [control] speed_bandwidth_hz, speed_kp_as_per_rad"
        raise DriveError(f"{asked} needs {stages[-1].end} PWM periods, allowed is up to {MOST_PERIODS}; {least}")
    t_s = drive.sample_time_s
    rpm = {s.first * t_s: s.reference for s in stages}
    loads = {s.first * t_s: s.load for s in stages}
    return Scene(scenario(drive, stages[-1].end * t_s, rpm, loads), tuple(stages), shortened=shortened)


def coast_s(drive: Drive, top: float) -> float:
    """How long the shaft coasts from ``top`` [rad/s] to rest when the bus takes no more, or 0 where it is not limited.

    The capacitor takes C/2*(u_end**2 - u_dc**2) of the kinetic energy; friction alone takes what is left,
    J*dw/dt = -T_c - b*w.
    """
    m, p = drive.machine, drive.protection
    if p.regen_start_v is None or p.brake_on_v is not None or drive.supply.source != "diode":
        return 0.0
    taken = drive.supply.capacitance_f / 2.0 * (regen_end_v(drive) ** 2 - drive.inverter.dc_bus_v**2)
    left = math.sqrt(max(top**2 - 2.0 * taken / m.inertia_kgm2, 0.0))
    b, torque = m.viscous_friction_nms, m.coulomb_friction_nm
    if torque <= 0.0:
        return 0.0
    lost = b * left / torque
    seconds = m.inertia_kgm2 * left / torque * (math.log1p(lost) / lost if lost > 0.0 else 1.0)
    return seconds if seconds <= LONGEST_COAST_S else 0.0


def crossover(drive: Drive) -> float:
    """Crossover of the speed loop [rad/s], from its gain on the integrator."""
    m = drive.machine
    return speed_gains(drive)[0] * 1.5 * m.pole_pairs**2 * m.magnet_flux_wb / m.inertia_kgm2


def torque_scene(drive: Drive) -> Scene:
    """Torque mode on a shaft that is driven: steps of i_q of both signs at the low and at the top speed."""
    i_q = LOADED * drive.current_limit_a
    top = min(TOP * drive.machine.rated_speed_rad_s, OF_REACH * reach(drive, i_q))
    low = LOW / TOP * top
    samples = max(round(10.0 / drive.control.current_bandwidth_hz / drive.sample_time_s), 200)
    plan = (
        ("start", low, 0.0),
        ("torque step", low, i_q),
        ("torque reversal", low, -i_q),
        ("top speed", top, 0.0),
        ("top speed, torque", top, i_q),
        ("top speed, torque reversal", top, -i_q),
    )
    stages = tuple(Stage(name, k * samples, (k + 1) * samples, current) for k, (name, _, current) in enumerate(plan))
    speeds = np.repeat([speed for _, speed, _ in plan], samples)
    ramp = np.minimum(np.arange(len(speeds)) / samples, 1.0) * speeds  # a driven shaft does not jump
    ramp[3 * samples : 4 * samples] = np.linspace(low, top, samples)
    base = _driven(drive, ramp, np.repeat([current for *_, current in plan], samples))
    return Scene(base, stages, imposed=True)


def current_step(drive: Drive) -> Scene:
    """A step of i_q in torque mode on a shaft that is driven at the low speed."""
    return _current_step(
        drive, LOW * min(TOP * drive.machine.rated_speed_rad_s, reach(drive, drive.current_limit_a)) / TOP
    )


def fast_current_step(drive: Drive) -> Scene:
    """The same at rated speed, or where the voltage lets the step pass: the delay turns the axes into each other."""
    return _current_step(drive, fastest(drive))


def fastest(drive: Drive) -> float:
    """Mechanical speed of the step at the top [rad/s]."""
    return min(drive.machine.rated_speed_rad_s, OF_STEP * reach(drive, STEP_OF_LIMIT * drive.current_limit_a))


def _current_step(drive: Drive, speed: float) -> Scene:
    size = STEP_OF_LIMIT * drive.current_limit_a
    i_q = np.repeat([0.0, size], STEP_SAMPLES)
    enable = (np.arange(len(i_q)) >= OFF_SAMPLES).astype(np.int64)
    driven = replace(_driven(drive, np.full(len(i_q), speed), i_q), omega_m=speed, enable=enable)
    if drive.core.references:  # the step is one of the current regulators, without the table
        codes = np.array([from_si("i_q_ext", value, drive) for value in i_q], np.int64)
        driven = replace(driven, i_q_ext=codes, changes={0: {"use_table": 0}})
    stages = (Stage("before", 0, STEP_SAMPLES, 0.0), Stage("current step", STEP_SAMPLES, 2 * STEP_SAMPLES, size))
    return Scene(driven, stages, imposed=True)


def _driven(drive: Drive, speed: np.ndarray, i_q: np.ndarray) -> Scenario:
    """Torque mode with an imposed speed [rad/s] and a reference [A], a value a sample."""
    n = len(speed)
    zeros, ones = np.zeros(n, np.int64), np.ones(n, np.int64)
    return Scenario(
        omega_ref=zeros,
        load=speed.astype(float),
        u_dc=np.full(n, drive.inverter.dc_bus_v),
        i_d_ref=zeros,
        i_q_ext=np.array([torque_code(drive, value) for value in i_q], np.int64),
        speed_mode=zeros,
        enable=ones,
    )
