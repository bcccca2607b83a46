# SPDX-License-Identifier: BSD-3-Clause
"""Runs of the golden core on the switching plant, with the drive's own dead time and device drops."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fluxproof.cosim.driven_plant import bus_of, described_sensors
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.sensor_edges import edges_of
from fluxproof.plant import FREE, IMPOSED_SPEED, Inverter, Machine, Sensors
from fluxproof.simulate.scene import Scene
from golden_model.drive import Drive
from golden_model.io import fault_latch
from golden_model.registers import RegisterSet
from golden_model.units import to_si

IN_SI = ("i_d", "i_q", "i_q_ref", "u_d", "u_q", "u_max", "theta_me", "omega_me", "v_comp", "torque", "shaft_position",
         "position_error")  # fmt: skip


@dataclass
class Run:
    """A scene's run: signals in SI units by name, one value a sample; the plant's true ones begin with ``true_``."""

    scene: Scene
    t: np.ndarray
    signals: dict[str, np.ndarray]
    compare: np.ndarray  # (n, 3) compare values in force in the next period
    tripped_at: int | None  # sample
    faults: tuple[str, ...]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.signals[name]

    def __len__(self) -> int:
        return len(self.t)


def machine_of(drive: Drive, imposed: bool = False) -> Machine:
    """The plant's machine; a driven shaft needs no inertia, and gets one where the file has none."""
    machine = Machine.from_mapping(vars(drive.machine))
    return replace(machine, inertia_kgm2=1.0) if imposed and machine.inertia_kgm2 <= 0.0 else machine


def inverter_of(drive: Drive) -> Inverter:
    """Device drops; the dead time is in the gates."""
    i = drive.inverter
    return Inverter(0.0, i.v_switch_v, i.v_diode_v, i.r_switch_ohm, i.r_diode_ohm)


def sensors_of(drive: Drive) -> Sensors:
    """Converters and encoder whose errors the trims of [sensors] take off, as commissioning has measured them."""
    s, mid, turning = drive.sensors, 2 ** (drive.sensors.adc_bits - 1), -1 if drive.sensors.position_reverse else 1
    codes = s.current_offset_code or (mid,) * 3
    return replace(
        described_sensors(drive),
        current_gain_error=tuple(1.0 / trim - 1.0 for trim in s.current_gain),
        current_offset_a=tuple((code - mid) * s.current_range_a / mid for code in codes),
        u_dc_gain_error=1.0 / s.u_dc_gain - 1.0,
        u_dc_offset_v=s.u_dc_offset_code * s.u_dc_range_v / 2**s.adc_bits,
        position_offset_rad=-turning * s.theta_offset_rad / drive.machine.pole_pairs,
        position_direction=turning,
    )


def run(
    drive: Drive,
    register_set: RegisterSet,
    scene: Scene,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Run:
    """Carry the scene out; from the sample after a trip on the gates are off, as the fault latch has it."""
    result = _simulate(drive, register_set, scene, progress)
    causes = fault_latch.of_sample(result.observed) & ~register_set.values.fault_ignore & fault_latch.TRIPPING
    trips = np.flatnonzero(causes * (scene.scenario.enable != 0))
    tripped_at, faults = None, ()
    if len(trips):
        tripped_at = int(trips[0])
        faults = tuple(name for k, name in enumerate(fault_latch.NAMES) if int(causes[tripped_at]) >> k & 1)
        enable = scene.scenario.enable.copy()
        enable[tripped_at:] = 0
        scene = replace(scene, scenario=replace(scene.scenario, enable=enable))
        result = _simulate(drive, register_set, scene, progress)
    observed = result.observed
    signals = {name: to_si(name, observed[name], drive) for name in IN_SI}
    signals |= {name: observed[name] for name in ("sat_d", "sat_q", "speed_limited", "regen_limited", "flux_faults")}
    signals |= {f"true_{name}": values for name, values in result.plant.items()}
    compare = np.array([observed[f"compare_{x}"] for x in "abc"]).T
    t = np.arange(len(scene.scenario)) * drive.sample_time_s
    return Run(scene, t, signals, compare, tripped_at, faults)


def _simulate(drive, register_set, scene, progress):
    return simulate(
        drive,
        register_set,
        scene.scenario,
        machine=machine_of(drive, scene.imposed),
        sensors=sensors_of(drive),
        dead_time_s=drive.inverter.dead_time_s,
        mode=IMPOSED_SPEED if scene.imposed else FREE,
        inverter=inverter_of(drive),
        progress=progress,
        bus=bus_of(drive),
        edges=edges_of(drive) if drive.encoder.kind == "hall" else None,
    )
