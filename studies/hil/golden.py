# SPDX-License-Identifier: BSD-3-Clause
"""Core and motor as models in one compiled loop, clock by clock: what `core_and_motor` does, its samples kept.

The same sequence as closed_loop.golden_run, which a test compares: a sample is taken at the trigger, CONVERSION clocks
later the core gets its codes; the motor makes a step every STEP clocks.  The shaft is held at a speed for each period.
A run goes on from where the last one ended, so that software may write settings, enable and a position in between.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fluxproof.commission.simulated_loop import LAST_ANGLE, SOURCE, forced_code
from fluxproof.cosim.golden_loop import mixed_kernel
from golden_model import clocked, fluxproof
from golden_model.motor import motor_bench, motor_bus, motor_heat, motor_model, motor_sensors, motor_shaft

CHAIN, SHAFT = 40, 53  # clocks from a tick to its currents, to its angle
CONVERSION = 13  # clocks from sample_trigger to sample_valid
STEP, DROP_THETA = motor_model.STEP, motor_shaft.DROP_THETA
core_step, bench_step, sensors_step = clocked.step, motor_bench.step, motor_sensors.step
sampled = motor_bench.sampled
MotorRegisters = motor_model.Registers
CoreInputs, MotorInputs, SensorInputs = clocked.Inputs, motor_model.Inputs, motor_sensors.Inputs
sample_step, Given, Sample = fluxproof.step_given, fluxproof.Given, fluxproof.Sample
DUE = {name: after for after, names in clocked.DUE.values() for name in names}
CHECKS, ZERO, MOTION, EMF = DUE["sample_faults"], DUE["current_offset"], DUE["motion_faults"], DUE["encoder_lost"]
LOAD, BRAKE, COMPARE = DUE["open_load"], DUE["brake_asked"], DUE["compare_a"]


COLD = motor_heat.Own(0, 0, 0, 0, 0, 0, 0)  # nothing depends on a temperature


class Hil(NamedTuple):
    """The registers of core, motor and sensors, the generics of the core and the code of the bus."""

    core: fluxproof.Registers
    config: fluxproof.Config
    motor: motor_model.Registers
    tables: motor_model.Tables
    sensors: motor_sensors.Registers
    u_dc: int  # of the source
    bus: motor_bus.Registers = motor_bus.Registers(0, 0, 0, 0)  # no capacitor
    k_filter: int = 0  # of the current sensors
    heat: motor_heat.Own = COLD


class Moving(NamedTuple):
    """The motor's registers that are written while it runs, a value a period."""

    omega_set: np.ndarray  # of a held shaft
    r_a: np.ndarray
    r_b: np.ndarray
    r_c: np.ndarray
    psi_m: np.ndarray


def constant(motor: motor_model.Registers, periods: int) -> Moving:
    """Registers that stay."""
    return Moving(*(np.full(periods, getattr(motor, name), np.int64) for name in Moving._fields))


@mixed_kernel
def written(r, moving, row):
    """The registers in a period."""
    return MotorRegisters(
        r.stiffness, r.v_switch, r.v_diode, moving.r_a[row], moving.r_b[row], moving.r_c[row], r.psi_start,
        moving.psi_m[row], r.inv_l_d, r.inv_l_q, r.k_j, r.viscous, r.coulomb, r.pole_pairs, r.hold,
        moving.omega_set[row],
    )  # fmt: skip


@mixed_kernel
def chosen(chains, behind):
    """The chain that stands at the outputs, so many steps behind."""
    if behind == 0:
        return chains[0]
    if behind == 1:
        return chains[1]
    if behind == 2:
        return chains[2]
    return chains[3]


class Host(NamedTuple):
    """What software has written beside the settings."""

    enable: int = 1
    clear_trip: int = 0  # at the first of the clocks
    write: int = 0  # anything, at the first of the clocks


class Carry(NamedTuple):
    """All that the next clock needs: models, what is between them, the outputs after the last clock."""

    core: clocked.State
    of_samples: fluxproof.State
    motor: motor_bench.State
    random: motor_sensors.State
    old: clocked.Inputs  # results of the sample before the last one
    new: clocked.Inputs
    entered_at: int
    valid_at: int
    clock: int
    word: int  # gates
    codes: tuple[int, ...]  # of the sensors
    counts: tuple[int, ...]  # clocks of each gate since the last tick
    fault_flags: int
    first_fault: int
    tripped: int


@mixed_kernel
def run_clocks(hil, asked, moving, host, forced, carry, samples, observed):
    """Fills a row of ``samples`` and ``observed`` in each period, the clock at which the last sample enters included.

    ``asked`` (n, 7): the fields of Sample after the codes, without run; ``moving``: see Moving; ``forced`` (6,): the
    position that the host gives, see commission.simulated_loop; ``carry``: of the last call.
    """
    regs, config, motor_regs = hil.core, hil.config, written(hil.motor, moving, 0)
    still = MotorInputs(hil.u_dc, 0, 0, 0, 0, 0, 0, 0, 0)
    core, of_samples, motor, random, old, new, entered_at, valid_at, clock, word, codes, of_gates, _, _, _ = carry
    fault_flags, first_fault, tripped = carry.fault_flags, carry.first_fault, carry.tripped
    counts, row, first = np.zeros(6, np.int64), 0, 1
    for k in range(6):
        counts[k] = of_gates[k]
    while row < len(samples):
        for k in range(6):
            counts[k] += word >> k & 1
        age = clock - entered_at
        inputs = CoreInputs(
            1 if clock == valid_at else 0, host.enable, 0, host.clear_trip * first, host.write * first,
            new.sample_faults if age >= CHECKS else old.sample_faults,
            new.sample_trip if age >= CHECKS else old.sample_trip,
            new.current_offset if age >= ZERO else old.current_offset,
            new.motion_faults if age >= MOTION else old.motion_faults,
            new.open_load if age >= LOAD else old.open_load,
            new.encoder_lost if age >= EMF else old.encoder_lost,
            0,
            new.brake_asked if age >= BRAKE else old.brake_asked,
            new.compare_a if age >= COMPARE else old.compare_a,
            new.compare_b if age >= COMPARE else old.compare_b,
            new.compare_c if age >= COMPARE else old.compare_c,
        )  # fmt: skip
        first = 0
        running = core.of_gate_generation.running
        core, entered, seen = core_step(core, inputs, regs, config.carrier_half)
        if entered:
            x = asked[row]
            code, jumped = forced_code(forced, codes[4], 0, config.position_bits)
            sample = Sample(
                codes[0], codes[1], codes[2], codes[3], code, x[0], x[1], x[2], x[3], x[4], x[5], x[6], running
            )
            by_code = 1 if forced[SOURCE] == 0 else 0
            given = Given(
                regs.speed_given * by_code, regs.omega_given, 1 if jumped else regs.position_restart,
                regs.emf_samples * by_code, regs.gear_code,
            )  # fmt: skip
            of_samples, o = sample_step(of_samples, sample, regs, config, given)
            for k, value in enumerate(sample):
                samples[row, k] = value
            for k, value in enumerate(o):
                observed[row, k] = value
            old = new
            new = CoreInputs(
                0, 1, 0, 0, 0, o.sample_faults, o.sample_trip, o.current_offset, o.motion_faults, o.open_load,
                o.encoder_lost, 0, o.brake_asked, o.compare_a, o.compare_b, o.compare_c,
            )  # fmt: skip
            entered_at, row = clock, row + 1
            if row < len(samples):
                motor_regs = written(hil.motor, moving, row)
        clock += 1
        if clock % STEP == 0:
            now = MotorInputs(hil.u_dc, 0, 0, counts[0], counts[3], counts[1], counts[4], counts[2], counts[5])
            motor, _ = bench_step(motor, now, seen.brake, motor_regs, hil.bus, hil.k_filter, hil.heat, hil.tables, STEP)
            counts[:] = 0
        word = seen.gate_high | seen.gate_low << 3
        fault_flags, first_fault, tripped = seen.fault_flags, seen.first_fault, seen.tripped
        if seen.sample_trigger:
            ticks = clock // STEP
            of_motor = motor.motor
            chains = (of_motor.chain_1, of_motor.chain_2, of_motor.chain_3, of_motor.chain_4)
            chain = chosen(chains, ticks - (clock - CHAIN) // STEP)
            theta = of_motor.of_shaft.theta >> DROP_THETA
            if ticks - (clock - SHAFT) // STEP == 3:  # the shaft's next step is done already
                _, ahead = bench_step(motor, still, 0, motor_regs, hil.bus, hil.k_filter, hil.heat, hil.tables, STEP)
                theta = ahead.theta_m
            i_a, i_b, i_c, u_dc, theta = sampled(motor, chain, theta, clock, hil.k_filter)
            at = SensorInputs(i_a, i_b, i_c, u_dc, theta)
            random, codes = sensors_step(random, at, hil.sensors, config.adc_bits, config.position_bits)
            valid_at = clock + CONVERSION
    of_gates = (counts[0], counts[1], counts[2], counts[3], counts[4], counts[5])
    return Carry(
        core, of_samples, motor, random, old, new, entered_at, valid_at, clock, word, codes, of_gates, fault_flags,
        first_fault, tripped,
    )  # fmt: skip


def start(hil: Hil, moving: Moving) -> Carry:
    """The carry of the first call: after the reset, the motor has made its first step."""
    still, regs = MotorInputs(u_dc=hil.u_dc), written(hil.motor, moving, 0)
    motor, _ = bench_step(motor_bench.State(), still, 0, regs, hil.bus, hil.k_filter, hil.heat, hil.tables, STEP)
    none = CoreInputs(enable=1)
    return Carry(
        core=clocked.State(), of_samples=fluxproof.State(), motor=motor, random=motor_sensors.State(), old=none,
        new=none, entered_at=-1, valid_at=-1, clock=0, word=0, codes=(0,) * 5, counts=(0,) * 6, fault_flags=0,
        first_fault=0, tripped=0,
    )  # fmt: skip


def record(hil: Hil, asked: np.ndarray, moving: Moving) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """(samples (n, 13), {name of Observed: (n,)}) from reset."""
    names = fluxproof.Observed._fields
    samples = np.zeros((len(asked), len(fluxproof.Sample._fields)), np.int64)
    observed = np.zeros((len(asked), len(names)), np.int64)
    run_clocks(hil, asked, moving, Host(), np.zeros(LAST_ANGLE + 1, np.int64), start(hil, moving), samples, observed)
    return samples, dict(zip(names, observed.T, strict=True))
