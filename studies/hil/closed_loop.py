# SPDX-License-Identifier: BSD-3-Clause
"""Core and motor in one (`core_and_motor`): the RTL alone in Verilator, its gates at every clock against the models.

Python sets the references and a load step and only reads: the loop is closed in the RTL.  The golden loop runs beside.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.closed_loop import gate_words
from fluxproof.cosim.flat import FLAT
from fluxproof.cosim.golden_clock import GoldenClock
from fluxproof.cosim.golden_loop import mixed_kernel
from fluxproof.cosim.sleeping import with_sleep
from fluxproof.cosim.verilated import VerilatedCore
from fluxproof.hil.registers import (
    Scale,
    Thermal,
    bus_registers,
    filter_register,
    heat_registers,
    motor_registers,
    motor_scale,
    motor_tables,
)
from fluxproof.plant.bus import Bus
from fluxproof.plant.pmsm import Machine
from golden_model import fluxproof
from golden_model.drive import Drive, load
from golden_model.motor import motor_bench, motor_bus, motor_heat, motor_model, motor_sensors, motor_shaft
from golden_model.motor.motor_model import STEP
from golden_model.registers import RegisterSet, registers
from golden_model.units import from_si
from studies.hil import golden as golden_loop
from studies.hil.drive import SERVO, SWITCHES
from studies.hil.equal import write_tables
from studies.hil.figure import least, most

CHAIN, SHAFT = 40, 53  # clocks from a tick to its currents, to its angle
CONVERSION = 13  # clocks from sample_trigger to sample_valid
MotorInputs, bench_step = motor_model.Inputs, motor_bench.step
SPEED_RAD_S, LOAD_NM = 100.0, 0.1
BUS = Bus(capacitance=470e-6, source_ohm=0.1, diode=True, brake_ohm=5.0)
FILTER_S = 5e-6  # of the current sensors
COPPER = replace(SERVO, resistance_temp_coeff_per_k=0.0039, magnet_temp_coeff_per_k=-0.001)
THERMAL = Thermal(winding_j_per_k=1.0, winding_s=6.0, magnet_s=8.0, ambient_c=60.0)
PERIODS = 300
HELD = 200  # periods of a speed


class Parts(NamedTuple):
    """Both drives' registers, those of the core, the motor and its sensors."""

    drive: Drive
    core: RegisterSet
    scale: Scale
    motor: motor_model.Registers
    tables: motor_model.Tables
    sensors: motor_sensors.Registers
    bus: motor_bus.Registers
    k_filter: int
    heat: motor_heat.Own

    def hil(self) -> golden_loop.Hil:
        """What the compiled loop takes."""
        u_dc = self.scale.u_dc(self.drive.inverter.dc_bus_v)
        values, config = self.core.values, self.core.config
        return golden_loop.Hil(
            values, config, self.motor, self.tables, self.sensors, u_dc, self.bus, self.k_filter, self.heat
        )

    def of_motor(self) -> dict[str, int]:
        """The registers of motor, sensors and bus by name."""
        own = {**self.motor._asdict(), **self.sensors._asdict(), **self.bus._asdict(), **self.heat._asdict()}
        own |= {"k_filter": self.k_filter}
        return {f"motor_{name}": value for name, value in own.items()}


def parts(drive: Drive | None = None, machine: Machine = SERVO, bus: Bus = BUS, body: Thermal = THERMAL) -> Parts:
    """The core and the sensors of a drive, by default servo_24v, with the motor of the study and its bus."""
    drive = drive or load(DRIVES / "servo_24v.toml")
    of_core, sensors = registers(drive), drive.sensors
    scale = motor_scale(machine, drive.inverter.dc_bus_v, sensors.current_range_a, drive.core.clock_hz)
    unit = 1 << motor_sensors.SENSOR_GAIN.frac_bits
    bus_unit = round(2 * scale.voltage_v / sensors.u_dc_range_v * unit)
    scales = {"scale_a": unit, "scale_b": unit, "scale_c": unit, "scale_u": bus_unit}
    still = dict.fromkeys(motor_sensors.Registers._fields, 0) | scales | {"noise_i": 20}
    motor, tables = motor_registers(scale, machine, SWITCHES), motor_tables(scale, machine)
    of_bus = bus_registers(scale, bus)
    k_filter, heat = filter_register(scale, FILTER_S), heat_registers(scale, COPPER, body)
    return Parts(drive, of_core, scale, motor, tables, motor_sensors.Registers(**still), of_bus, k_filter, heat)


@mixed_kernel
def follow(bench, words, u_dc, load, motor, bus, k_filter, heat, tables):
    """The motor through whole steps, from the gates of each of their clocks; the brake resistor stays off."""
    counts = np.zeros(6, np.int64)
    for n in range(len(words) // STEP):
        counts[:] = 0
        for word in words[n * STEP : (n + 1) * STEP]:
            for k in range(6):
                counts[k] += word >> k & 1
        now = MotorInputs(u_dc, load, 0, counts[0], counts[3], counts[1], counts[4], counts[2], counts[5])
        bench, _ = bench_step(bench, now, 0, motor, bus, k_filter, heat, tables, STEP)
    return bench


class GoldenMotor:
    """The golden motor clock by clock, from the gates that it is given."""

    def __init__(self, of: Parts):
        self.of, self.ticks = of, 0
        self.u_dc = of.scale.u_dc(of.drive.inverter.dc_bus_v)
        self.state, _ = self._tick(motor_bench.State(), 0)
        self.random = motor_sensors.State()

    def _tick(self, state, load_code):
        inputs = motor_model.Inputs(u_dc=self.u_dc, load=load_code)
        of = self.of
        return motor_bench.step(state, inputs, 0, of.motor, of.bus, of.k_filter, of.heat, of.tables, STEP)

    def advance(self, words: np.ndarray, clock: int, load_code: int) -> None:
        """Up to the last tick at or before ``clock``; ``words``: the gates of every clock so far."""
        steps = clock // STEP - self.ticks
        part = words[self.ticks * STEP : (self.ticks + steps) * STEP].astype(np.int64)
        of = self.of
        self.state = follow(self.state, part, self.u_dc, load_code, of.motor, of.bus, of.k_filter, of.heat, of.tables)
        self.ticks += steps

    def codes(self, clock: int, load_code: int) -> tuple[int, ...]:
        """What the sensors say of the currents and the angle that stand at the outputs at ``clock``."""
        s = self.state.motor
        chain = (s.chain_1, s.chain_2, s.chain_3, s.chain_4)[self.ticks - (clock - CHAIN) // STEP]
        theta = s.of_shaft.theta >> motor_shaft.DROP_THETA
        if self.ticks - (clock - SHAFT) // STEP == 3:  # the shaft's next step is done already
            theta = self._tick(self.state, load_code)[1].theta_m
        seen = motor_sensors.Inputs(*motor_bench.sampled(self.state, chain, theta, clock, self.of.k_filter))
        config = self.of.core.config
        self.random, codes = motor_sensors.step(
            self.random, seen, self.of.sensors, config.adc_bits, config.position_bits
        )
        return codes


@dataclass(frozen=True)
class Run:
    """Gate words after every clock; values of each sample that the core shows."""

    words: np.ndarray
    observed: list[dict[str, int]]
    seconds: float = 0.0  # of processor time
    missed: int = 0  # clocks that a witness found missing


def references(of: Parts) -> dict[str, int]:
    """Speed control from the start, a winding temperature that is not measured."""
    omega = from_si("omega_ref", SPEED_RAD_S * of.drive.machine.pole_pairs, of.drive)
    return {"omega_ref": int(omega), "i_d_ref": 0, "i_q_ext": 0, "speed_mode": 1, "temp_winding": 0, "temp_valid": 0}


def golden_run(of: Parts, periods: int, load_at: int) -> Run:
    """Core and motor as models; the load from clock ``load_at``, a tick."""
    core, motor = GoldenClock(of.core.values, of.core.config), GoldenMotor(of)
    words, observed = np.zeros(1, np.int64), []
    sample, loads, seen = None, (0, of.scale.load(LOAD_NM)), []
    for _ in range(periods):
        made = [] if sample is None else [core.advance(CONVERSION, enable=1)]
        made.append(core.advance(4 * of.core.config.carrier_half, sample, until_trigger=True, enable=1))
        if core.observed is not None:
            observed.append(core.observed._asdict())
        seen.append(gate_words(np.concatenate(made)))
        words = np.concatenate([words, seen[-1]])
        if motor.ticks * STEP < load_at <= core.clock:
            motor.advance(words, load_at - 1, loads[0])
        now = loads[core.clock >= load_at]
        motor.advance(words, core.clock, now)
        sample = dict(zip(fluxproof.Sample._fields, motor.codes(core.clock, now), strict=False))
        sample |= references(of) | {"clear_faults": 0}
    return Run(words[1:], observed)


def rtl_of(of: Parts, rewrite: Callable[[str], str]) -> VerilatedCore:
    """The RTL after its reset, registers and tables loaded."""
    config = of.core.config
    generics = {"ADC_BITS": config.adc_bits, "POSITION_BITS": config.position_bits, "CARRIER_HALF": config.carrier_half}
    core = VerilatedCore(generics, top=f"core_and_motor{FLAT}", rewrite=rewrite)
    core.set_many(of.core.values._asdict())
    core.set_many(of.of_motor())
    core.set("motor_u_dc", of.scale.u_dc(of.drive.inverter.dc_bus_v))
    core.set_many({name if name in core.inputs else f"{name}_in": v for name, v in references(of).items()})
    write_tables(core, of.tables, "motor_")
    core.set("enable", 1)
    core.reset()
    return core


def rtl_run(of: Parts, golden: Run, load_at: int, rewrite: Callable[[str], str] = with_sleep) -> Run:
    """The RTL for as many clocks; observed values are those at the golden run's triggers."""
    core = rtl_of(of, rewrite)
    began, names = time.process_time(), ("gate_high", "gate_low", "sample_trigger")
    before = core.trace(load_at, names)
    core.set("motor_load", of.scale.load(LOAD_NM))
    after = core.trace(len(golden.words) - load_at, names)
    seconds = time.process_time() - began
    rows = np.concatenate([before, after])
    return Run(rows[:, 0] + 8 * rows[:, 1], [core.get_many(golden.observed[-1])], seconds, core.missed)


def compare(periods: int, filter_s: float = FILTER_S) -> tuple[Run, Run]:
    """(golden, RTL) of the same closed loop, a load step in the middle."""
    of = parts()
    of = of._replace(k_filter=filter_register(of.scale, filter_s))
    load_at = periods // 2 * 2 * of.core.config.carrier_half // STEP * STEP
    golden = golden_run(of, periods, load_at)
    return golden, rtl_run(of, golden, load_at)


class Long(NamedTuple):
    """Samples compared, values that differ, processor time of the RTL."""

    samples: int
    wrong: int
    seconds: float


def long_run(periods: int, seed: int = 53) -> Long:
    """Every value of every sample of the RTL against the compiled loop of models, with speeds drawn again and again."""
    of, rng = parts(), np.random.default_rng(seed)
    speeds = rng.uniform(-SPEED_RAD_S, SPEED_RAD_S, -(-periods // HELD)) * of.drive.machine.pole_pairs
    omega = np.repeat([from_si("omega_ref", speed, of.drive) for speed in speeds], HELD)[:periods]
    given = references(of)
    asked = np.array([[*given.values(), 0]] * periods, np.int64)
    asked[:, list(given).index("omega_ref")] = omega
    _, observed = golden_loop.record(of.hil(), asked, golden_loop.constant(of.motor, periods))
    names = list(observed)
    wanted = np.stack([observed[name] for name in names], axis=1)

    core, wrong, most = rtl_of(of, with_sleep), 0, 4 * of.core.config.carrier_half
    began = time.process_time()
    core.clocks_until("sample_trigger", most)
    for row, speed in enumerate(omega):
        core.set("omega_ref_in", int(speed))
        core.clocks_until("sample_trigger", most)
        wrong += int((np.fromiter(core.get_many(names).values(), np.int64) != wanted[row]).sum())
    return Long(periods, wrong, time.process_time() - began)


def figures(options) -> list[dict]:
    golden, rtl = compare(PERIODS)
    wrong = int((golden.words != rtl.words).sum()) + int(golden.observed[-1] != rtl.observed[-1])
    long = long_run(options.periods)
    return [
        least("closed loop of core and motor in the RTL, gates at every clock", PERIODS, PERIODS, "periods"),
        most("its differences from the golden models", wrong, 0, "differences"),
        least("closed loop, every value of every sample", long.samples, options.periods, "periods"),
        most("its differences from the golden models, values", long.wrong, 0, "differences"),
        least("its rate in Verilator, processor time", PERIODS / rtl.seconds, 240, "periods/s"),
    ]
