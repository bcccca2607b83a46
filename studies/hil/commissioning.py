# SPDX-License-Identifier: BSD-3-Clause
"""`fluxproof commission`, unchanged, on fluxproof_hil as models: what it measures beside the motor's registers.

Core and motor clock by clock (golden.py) behind the protocol of commission/bus.py.  The core begins with a file whose
machine is wrong; the sensors have offsets and noise, the encoder stands anyhow.  A write of a setting acts from the
next sample on, as in commission/simulated.py.  The motor's currents are 52 clocks old at the trigger, as in the RTL.
"""

from __future__ import annotations

import dataclasses
import math
import time
from dataclasses import dataclass

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.commission.bus import CODES, RUNNING, VALUES, checked
from fluxproof.commission.simulated import board_of
from fluxproof.commission.simulated_loop import INPUTS, LAST_ANGLE
from fluxproof.commission.steps import commission
from fluxproof.hil.load import sensor_registers
from fluxproof.hil.registers import bus_registers, machine_of, motor_registers, motor_scale, motor_tables
from fluxproof.plant import Machine
from fluxproof.simulate.run import bus_of
from golden_model import drive as drives
from golden_model import fluxproof
from golden_model.board_registers import board_generics
from golden_model.drive import Drive
from golden_model.io import board_map
from golden_model.motor.motor_sensors import Registers as SensorRegisters
from golden_model.registers import registers
from studies.hil.figure import least, most
from studies.hil.golden import Hil, Host, constant, run_clocks, start

HALF = 1700  # clocks of half a period: 34 MHz at 10 kHz; a 1/J that fits its register
START = {"resistance_ohm": 1.4, "inductance_d_h": 0.7, "inductance_q_h": 1.3, "magnet_flux_wb": 0.85}  # of the file
FIELDS = fluxproof.Observed._fields
ANSWER = (1, 4)  # periods until a snapshot, drawn
WAIT = 2000  # periods of a call at most
TARGETS = {"R": 3.0, "L_d": 3.0, "L_q": 3.0, "psi": 1.0, "J": 10.0}  # %, of docs/commissioning.md but for J
ANGLE_DEG = 3.0


@dataclass(frozen=True)
class Bench:
    """The drive as it is, the file that software has, core and motor, the machine that the rounded registers say."""

    drive: Drive
    file: Drive
    hil: Hil
    machine: Machine
    angle_rad: float  # of the encoder, mechanical


def bench(name: str = "paper001") -> Bench:
    """A drive of docs/drives at 34 MHz on the bus of [supply], with the sensors of `commission --bus sim`."""
    drive = drives.with_carrier(drives.load(DRIVES / f"{name}.toml"), HALF)
    board, u_dc = board_of(drive), drive.inverter.dc_bus_v
    scale = motor_scale(board.machine, u_dc, drive.sensors.current_range_a, drive.core.clock_hz)
    motor, tables = motor_registers(scale, board.machine, board.inverter), motor_tables(scale, board.machine)
    assert board.sensors is not None
    of_sensors = sensor_registers(drive, board.sensors, scale.current_a, scale.voltage_v)
    sensors = SensorRegisters(**{name: of_sensors[name] for name in SensorRegisters._fields})
    of_core = registers(drive)
    of_bus = bus_registers(scale, bus_of(drive))
    hil = Hil(of_core.values, of_core.config, motor, tables, sensors, scale.u_dc(u_dc), of_bus)
    machine = dataclasses.replace(
        drive.machine, **{key: share * getattr(drive.machine, key) for key, share in START.items()}
    )
    file = dataclasses.replace(drive, machine=machine)
    true = machine_of(scale, motor, board.machine, board.inverter)
    return Bench(drive, file, hil, true, board.sensors.position_offset_rad)


class HilBus:
    """A Bus (commission/bus.py); ``periods``: how many the drive has made."""

    def __init__(self, of: Bench, seed: int = 0):
        self.map, self.t_s, self.of = board_map.registers(), of.drive.sample_time_s, of
        config = of.hil.config
        self._values = {name: register.reset for name, register in self.map.items() if register.fields}
        self._values |= {"clock_hz": round(of.drive.core.clock_hz), **config._asdict(), **board_generics(of.drive)}
        self._hil, self._settled, self.periods, self._due = of.hil, False, 0, 0.0
        self._random = np.random.default_rng(seed)
        self._moving, self._forced = constant(of.hil.motor, WAIT), np.zeros(LAST_ANGLE + 1, np.int64)
        self._carry, self._clear, self._written = start(of.hil, self._moving), 0, 0
        self._sample, self._seen = np.zeros(len(fluxproof.Sample._fields), np.int64), np.zeros(len(FIELDS), np.int64)

    def read(self, name: str) -> int:
        if name in FIELDS:
            return int(self._seen[FIELDS.index(name)])
        if name in ("fault_flags", "first_fault"):
            return int(getattr(self._carry, name))
        if name == "flags":
            return int(self._sample[-1]) + 2 * int(self._carry.tripped)
        if name == "encoder_flags":
            return 1  # an absolute code is referenced
        if name == "snap_code":  # the encoder's own, also while a position is forced
            return int(self._carry.codes[4])
        if name in CODES:
            return int(self._sample[4 if name == "snap_position" else CODES.index(name) - 2])
        return self._values[name]

    def write(self, name: str, value: int) -> None:
        checked(self.map, name, value, lambda: bool(self._values["enable"] and self.read("flags") & RUNNING))
        self._written = 1
        if name == "clear_trip":
            self._clear = 1
            return
        self._values[name] = value
        self._forced[:3] = [self._values[n] for n in ("position_source", "forced_angle", "forced_rate")]
        self._settled = False

    def snapshot(self) -> dict[str, int]:
        self._written = 1
        self._run(int(self._random.integers(*ANSWER)) + 1)
        return {name: self.read(name) for name in (*CODES, *VALUES, "theta_me")}

    def wait(self, seconds: float) -> None:
        self._due += seconds / self.t_s
        whole = math.floor(self._due)
        self._due -= whole
        self._run(whole)

    def now(self) -> float:
        return self.periods * self.t_s

    def _run(self, periods: int) -> None:
        if not self._settled:
            core = fluxproof.Registers(**{n: self._values[n] for n in fluxproof.Registers._fields})
            self._hil, self._settled = self._hil._replace(core=core), True
        asked = np.array([*(self._values[n] for n in INPUTS), 0], np.int64)
        while periods > 0:
            n = min(periods, WAIT)
            samples, observed = np.zeros((n, len(self._sample)), np.int64), np.zeros((n, len(FIELDS)), np.int64)
            host = Host(int(self._values["enable"]), self._clear, self._written)
            self._carry = run_clocks(
                self._hil, np.tile(asked, (n, 1)), self._moving, host, self._forced, self._carry, samples, observed
            )
            self._clear = self._written = 0
            self._sample, self._seen = samples[-1], observed[-1]
            self.periods, periods = self.periods + n, periods - n


@dataclass
class Outcome:
    """Errors in percent by the names of TARGETS; of the encoder's angle [electrical degrees]; what each step said."""

    errors: dict[str, float]
    angle_deg: float
    said: list[str]
    periods: int
    seconds: float  # of processor time


def measured(of: Bench) -> Outcome:
    """The whole commissioning; commission.session.Refusal where it refuses."""
    bus, began, said = HilBus(of), time.process_time(), []

    def done(step) -> None:
        said.append(f"{step.name}: {step.said}")
        print(f"{said[-1]} ({bus.periods} periods, {time.process_time() - began:.0f} s)", flush=True)

    found, _ = commission(bus, of.file, done=done)
    m, n = of.machine, found.machine
    pairs = {
        "R": (n.resistance_ohm, m.resistance_ohm), "L_d": (n.inductance_d_h, m.inductance_d_h),
        "L_q": (n.inductance_q_h, m.inductance_q_h), "psi": (n.magnet_flux_wb, m.magnet_flux_wb),
        "J": (n.inertia_kgm2, m.inertia_kgm2),
    }  # fmt: skip
    errors = {name: 100.0 * (got / true - 1.0) for name, (got, true) in pairs.items()}
    off = found.sensors.theta_offset_rad + m.pole_pairs * of.angle_rad
    angle = math.degrees((off + math.pi) % (2.0 * math.pi) - math.pi)
    return Outcome(errors, angle, said, bus.periods, time.process_time() - began)


def figures(_options) -> list[dict]:
    """A commissioning from its first step to the last, each value against the registers."""
    found = measured(bench())
    rows = [most(f"commission on fluxproof_hil: {n}", abs(found.errors[n]), x, "%") for n, x in TARGETS.items()]
    rows.append(most("commission on fluxproof_hil: encoder", abs(found.angle_deg), ANGLE_DEG, "electrical degrees"))
    return [least("commission on fluxproof_hil, steps that ran", len(found.said), 8, "of 8"), *rows]
