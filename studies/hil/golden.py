# SPDX-License-Identifier: BSD-3-Clause
"""Core and motor as models in one compiled loop, clock by clock: what `core_and_motor` does, its samples kept.

The same sequence as closed_loop.golden_run, which a test compares: a sample is taken at the trigger, CONVERSION clocks
later the core gets its codes; the motor makes a step every STEP clocks.  The shaft is held at a speed for each period.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fluxproof.cosim.golden_loop import mixed_kernel
from golden_model import clocked, fluxproof
from golden_model.motor import motor_model, motor_sensors, motor_shaft

CHAIN, SHAFT = 40, 53  # clocks from a tick to its currents, to its angle
CONVERSION = 13  # clocks from sample_trigger to sample_valid
STEP, DROP_THETA = motor_model.STEP, motor_shaft.DROP_THETA
core_step, motor_step, sensors_step = clocked.step, motor_model.step, motor_sensors.step
MotorRegisters = motor_model.Registers
CoreInputs, MotorInputs, SensorInputs = clocked.Inputs, motor_model.Inputs, motor_sensors.Inputs
sample_step, given_by_registers, Sample = fluxproof.step_given, fluxproof.given_by_registers, fluxproof.Sample
DUE = {name: after for after, names in clocked.DUE.values() for name in names}
CHECKS, ZERO, MOTION, EMF = DUE["sample_faults"], DUE["current_offset"], DUE["motion_faults"], DUE["encoder_lost"]
LOAD, BRAKE, COMPARE = DUE["open_load"], DUE["brake_asked"], DUE["compare_a"]


class Hil(NamedTuple):
    """The registers of core, motor and sensors, the generics of the core and the code of the bus."""

    core: fluxproof.Registers
    config: fluxproof.Config
    motor: motor_model.Registers
    tables: motor_model.Tables
    sensors: motor_sensors.Registers
    u_dc: int


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


@mixed_kernel
def run_clocks(hil, asked, moving, states, samples, observed):
    """Fills a row of ``samples`` and ``observed`` in each period.

    ``asked`` (n, 7): the fields of Sample after the codes, without run; ``moving``: see Moving.
    ``states``: of core, its samples, motor and sensors.
    """
    core, of_samples, motor, random = states
    regs, config, motor_regs = hil.core, hil.config, written(hil.motor, moving, 0)
    still = MotorInputs(hil.u_dc, 0, 0, 0, 0, 0, 0, 0, 0)
    motor, _ = motor_step(motor, still, motor_regs, hil.tables, STEP)
    nothing = CoreInputs(0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    old, new, entered_at, valid_at, clock, word, row = nothing, nothing, -1, -1, 0, 0, 0
    codes = (0, 0, 0, 0, 0)
    counts = np.zeros(6, np.int64)
    while row < len(samples):
        for k in range(6):
            counts[k] += word >> k & 1
        age = clock - entered_at
        inputs = CoreInputs(
            1 if clock == valid_at else 0, 1, 0, 0, 0,
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
        running = core.of_gate_generation.running
        core, entered, seen = core_step(core, inputs, regs, config.carrier_half)
        if entered:
            x = asked[row]
            sample = Sample(
                codes[0], codes[1], codes[2], codes[3], codes[4], x[0], x[1], x[2], x[3], x[4], x[5], x[6], running
            )
            of_samples, o = sample_step(of_samples, sample, regs, config, given_by_registers(regs))
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
            motor, _ = motor_step(motor, now, motor_regs, hil.tables, STEP)
            counts[:] = 0
        word = seen.gate_high | seen.gate_low << 3
        if seen.sample_trigger:
            ticks = clock // STEP
            chains = (motor.chain_1, motor.chain_2, motor.chain_3, motor.chain_4)
            chain = chosen(chains, ticks - (clock - CHAIN) // STEP)
            theta = motor.of_shaft.theta >> DROP_THETA
            if ticks - (clock - SHAFT) // STEP == 3:  # the shaft's next step is done already
                _, ahead = motor_step(motor, still, motor_regs, hil.tables, STEP)
                theta = ahead.theta_m
            at = SensorInputs(chain.i_a, chain.i_b, chain.i_c, hil.u_dc, theta)
            random, codes = sensors_step(random, at, hil.sensors, config.adc_bits, config.position_bits)
            valid_at = clock + CONVERSION
    return clock


def record(hil: Hil, asked: np.ndarray, moving: Moving) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """(samples (n, 13), {name of Observed: (n,)}) from reset."""
    names = fluxproof.Observed._fields
    samples = np.zeros((len(asked), len(fluxproof.Sample._fields)), np.int64)
    observed = np.zeros((len(asked), len(names)), np.int64)
    states = (clocked.State(), fluxproof.State(), motor_model.State(), motor_sensors.State())
    run_clocks(hil, asked, moving, states, samples, observed)
    return samples, dict(zip(names, observed.T, strict=True))
