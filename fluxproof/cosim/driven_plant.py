# SPDX-License-Identifier: BSD-3-Clause
"""What a closed loop is given, and the switching plant in it: references, load and bus in, sensors' codes out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np

from fluxproof.plant import FREE, Bus, Inverter, Machine, Sensors, SwitchingPlant, sensor_params
from fluxproof.plant.sensors import current_code, position_code, u_dc_code
from golden_model import supply
from golden_model.drive import Drive
from golden_model.io import sample_latch
from golden_model.kernel import kernel

INPUT_PORTS = tuple(p.name for p in sample_latch.BLOCK.inputs if p.name != "run_in")


@dataclass(frozen=True)
class Scenario:
    """References, load and bus voltage per sample, a period of the loops here: arrays of equal length."""

    omega_ref: np.ndarray  # integers, per unit format
    load: np.ndarray  # [Nm]
    u_dc: np.ndarray  # [V]
    i_d_ref: np.ndarray  # integers
    i_q_ext: np.ndarray  # integers
    speed_mode: np.ndarray  # 0 or 1
    enable: np.ndarray  # 0 or 1
    brake: np.ndarray | None = None  # [Nm] largest torque of a brake on the shaft, see ``load_torque``
    changes: Mapping[int, Mapping[str, int]] = field(default_factory=dict)  # period -> registers from there on
    omega_m: float = 0.0  # mechanical speed at the start [rad/s]
    theta_m: float = 0.0  # mechanical angle at the start [rad]
    clear_faults: np.ndarray | None = None  # 0 or 1; None: never
    temp_winding: np.ndarray | None = None  # winding temperature [degC]; NaN: reading lost; None: no sensor

    def __len__(self) -> int:
        return len(self.load)

    def first(self, periods: int | None) -> Scenario:
        """The scenario's first ``periods``; None: all of it."""
        if periods is None:
            return self
        columns = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{k: v[:periods] for k, v in columns.items() if isinstance(v, np.ndarray)})

    def slow_inputs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(temperature, whether it is valid, clear_faults) as inputs of the core."""
        zeros = np.zeros(len(self), np.int64)
        clear = zeros if self.clear_faults is None else self.clear_faults
        if self.temp_winding is None:
            return zeros, zeros, clear
        valid = np.isfinite(self.temp_winding)
        sixty_fourths = np.round(64.0 * np.where(valid, self.temp_winding, 0.0)).astype(np.int64)
        return sixty_fourths, valid.astype(np.int64), clear


BRAKE_SLOPE = 10.0  # Nm per rad/s: a held shaft creeps below half a rad/s, and a period still integrates well


@kernel
def load_torque(load, brake, omega_m):
    """Load [Nm] plus a brake torque that opposes the motion, up to ``brake`` [Nm]."""
    return load + max(-brake, min(brake, BRAKE_SLOPE * omega_m))


PLANT_SIGNALS = {
    "i_a": lambda p: p.i_abc[0],
    "i_d": lambda p: p.i_dq[0],
    "i_q": lambda p: p.i_dq[1],
    "lambda_d": lambda p: p.lambda_dq[0],
    "lambda_q": lambda p: p.lambda_dq[1],
    "omega_m": lambda p: p.omega_m,
    "torque": lambda p: p.torque,
}


def bus_of(drive: Drive) -> Bus:
    """The bus that [supply] describes."""
    if drive.supply.source == "ideal":
        return Bus()
    farad, diode = drive.supply.capacitance_f, drive.supply.source == "diode"
    return Bus(farad, supply.resistance_ohm(drive), diode, supply.brake_resistor_ohm(drive))


def described_sensors(drive) -> Sensors:
    """Sensors as drive.toml describes them."""
    s = drive.sensors
    return Sensors(
        current_bits=s.adc_bits,
        current_full_scale_a=s.current_range_a,
        u_dc_bits=s.adc_bits,
        u_dc_full_scale_v=s.u_dc_range_v,
        position_bits=s.position_bits,
        position_pole_pairs=s.position_pole_pairs,
        position_counts=drive.encoder.counts or 0,
    )


def build_plant(
    drive, sensors: Sensors | None = None, machine: Machine | None = None, omega_m: float = 0.0, mode: int = FREE,
    theta_m: float = 0.0,
) -> tuple[SwitchingPlant, Sensors]:  # fmt: skip
    """Plant and sensors as drive.toml describes them; the dead time is that of the device's gates."""
    machine = machine or Machine.from_mapping(vars(drive.machine))
    plant = SwitchingPlant(machine, Inverter(), mode, omega_m=omega_m, theta_m=theta_m)
    return plant, sensors or described_sensors(drive)


class PlantPeriods:
    """A scenario's plant period by period: its sensors' codes for the core, gate edges back.

    ``mode`` IMPOSED_SPEED: the scenario's load is the mechanical speed [rad/s].
    """

    def __init__(
        self,
        drive,
        scenario: Scenario,
        sensors: Sensors | None = None,
        machine: Machine | None = None,
        mode: int = FREE,
    ):
        self.scenario, self.period_s, self.mode = scenario, drive.sample_time_s, mode
        self.plant, described = build_plant(drive, sensors, machine, scenario.omega_m, mode, scenario.theta_m)
        self.codes, self.slow_inputs, self.rows = sensor_params(described), scenario.slow_inputs(), []

    def inputs(self, k: int) -> dict[str, int]:
        """The raw sample's ports at the start of period ``k``; the plant's signals are recorded."""
        plant, codes, scenario = self.plant, self.codes, self.scenario
        self.rows.append([read(plant) for read in PLANT_SIGNALS.values()])
        values = (
            *(current_code(codes, n, plant.i_abc[n], k) for n in range(3)),
            u_dc_code(codes, float(scenario.u_dc[k]), k),
            position_code(codes, plant.theta_m, k),
            *(scenario.omega_ref[k], scenario.i_d_ref[k], scenario.i_q_ext[k], scenario.speed_mode[k]),
            *(column[k] for column in self.slow_inputs),
        )
        return dict(zip(INPUT_PORTS, map(int, values), strict=True))

    def advance(self, k: int, times: np.ndarray, words: np.ndarray) -> None:
        """Period ``k`` with these gate words from these times [s] on."""
        scenario, plant = self.scenario, self.plant
        brake = 0.0 if scenario.brake is None else scenario.brake[k]
        load = float(scenario.load[k])
        if self.mode == FREE:
            load = load_torque(load, float(brake), plant.omega_m)
        plant.advance(times, words, float(scenario.u_dc[k]), load, self.period_s)
