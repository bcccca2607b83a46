# SPDX-License-Identifier: BSD-3-Clause
"""The motor of the FPGA beside the double-precision plant: both get the same gates, clock by clock, and the same load.

A field-oriented speed control in floating point drives the plant; the motor follows nothing but the gates, so its rotor is
held by the plant's voltage only.  A PWM period is a whole number of the motor's steps, so both are seen at the same time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fluxproof.cosim.golden_loop import mixed_kernel
from fluxproof.hil.registers import Scale, machine_of, motor_registers, motor_tables
from fluxproof.plant import layout as L
from fluxproof.plant.drive_plant import initial_state, plant_params
from fluxproof.plant.inverter import Inverter
from fluxproof.plant.pmsm import Machine
from fluxproof.plant.switching import advance_switching
from golden_model.formats import FLUX, MOTOR_VOLTAGE, PU
from golden_model.motor import motor_model, motor_shaft

motor_step, MotorInputs, STEP = motor_model.step, motor_model.Inputs, motor_model.STEP
COLUMNS = ("i_a", "i_b", "i_c", "i_d", "i_q", "torque", "omega", "theta")


class Control(NamedTuple):
    """Gains of the speed control of the plant, and its limit."""

    current_p: float
    current_i: float  # per period
    speed_p: float
    speed_i: float
    limit_a: float
    u_dc: float
    pole_pairs: float


class Ride(NamedTuple):
    """What both go through, a value a period."""

    speed_rad_s: np.ndarray
    load_nm: np.ndarray


@mixed_kernel
def duties(control, memory, state, speed):
    """Duties of the three legs; ``memory``: integrals of both axes and of the speed, changed in place."""
    c = control
    error = speed - state[L.OMEGA_M]
    i_q_ref = c.speed_p * error + memory[2]
    if abs(i_q_ref) > c.limit_a:
        i_q_ref = math.copysign(c.limit_a, i_q_ref)
    else:
        memory[2] += c.speed_i * error
    e_d, e_q = -state[L.I_D], i_q_ref - state[L.I_Q]
    memory[0] += c.current_i * e_d
    memory[1] += c.current_i * e_q
    w = c.pole_pairs * state[L.OMEGA_M]
    u_d = c.current_p * e_d + memory[0] - w * state[L.LAMBDA_Q]
    u_q = c.current_p * e_q + memory[1] + w * state[L.LAMBDA_D]
    size, most = math.hypot(u_d, u_q), c.u_dc / math.sqrt(3.0)
    if size > most:
        u_d, u_q = u_d * most / size, u_q * most / size
    cos, sin = math.cos(state[L.THETA_E]), math.sin(state[L.THETA_E])
    alpha, beta = u_d * cos - u_q * sin, u_d * sin + u_q * cos
    half = math.sqrt(3.0) / 2 * beta
    a, b, c_ = alpha, half - alpha / 2, -half - alpha / 2
    middle = (max(a, b, c_) + min(a, b, c_)) / 2
    return 0.5 + (a - middle) / c.u_dc, 0.5 + (b - middle) / c.u_dc, 0.5 + (c_ - middle) / c.u_dc


@mixed_kernel
def edges(duty, period, dead, leg, before, times, words, count):
    """Adds a leg's edges of a period to the events; word: bits to set << 6 | bits to clear.  Returns the new count."""
    on = int(round(duty * period / 2.0)) * 2  # an even number of clocks around the middle
    start, end = (period - on) // 2, (period + on) // 2
    high, low = 1 << leg, 8 << leg
    if on <= dead or on >= period - dead:  # the leg keeps its lower or its upper gate for the whole period
        wanted = low if on <= dead else high
        if not before & wanted:
            times[count], words[count] = 0, (high | low)
            times[count + 1], words[count + 1] = dead, wanted << 6
            count += 2
        return count
    if before & high:  # the last period ended with the upper gate on
        times[count], words[count] = 0, high
        times[count + 1], words[count + 1] = dead, low << 6
        count += 2
    at = (start, start + dead, end, end + dead)
    for k in range(4):
        if at[k] < period:
            times[count] = at[k]
            words[count] = (low, high << 6, high, low << 6)[k]
            count += 1
    return count


@mixed_kernel
def sorted_events(times, words, count):
    """Insertion sort by time: the events are few."""
    for k in range(1, count):
        t, w, j = times[k], words[k], k - 1
        while j >= 0 and times[j] > t:
            times[j + 1], words[j + 1] = times[j], words[j]
            j -= 1
        times[j + 1], words[j + 1] = t, w


@mixed_kernel
def on_clocks(counts, word, clocks):
    """Adds ``clocks`` to the counts of the gates that are on."""
    for k in range(6):
        if word >> k & 1:
            counts[k] += clocks


@mixed_kernel
def follow(motor, word, events, steps, u_dc, load, registers, tables):
    """The motor through the steps of a period with ``events`` = (times, words, count): (state, word after it)."""
    times, words, count = events
    at, event = 0, 0
    counts = np.zeros(6, np.int64)
    for _ in range(steps):
        counts[:] = 0
        end = at + STEP
        while event < count and times[event] < end:
            on_clocks(counts, word, times[event] - at)
            at = times[event]
            word = (word | words[event] >> 6) & ~(words[event] & 63)
            event += 1
        on_clocks(counts, word, end - at)
        at = end
        inputs = MotorInputs(u_dc, load, 0, counts[0], counts[3], counts[1], counts[4], counts[2], counts[5])
        motor, _ = motor_step(motor, inputs, registers, tables, STEP)
    return motor, word


@mixed_kernel
def ride_both(plant, params, control, motor, bus, ride, registers, tables, steps, dead, rows):
    """Both through a ride; ``bus`` = (clock_hz, load codes, code of the bus); ``rows``: COLUMNS of plant, then motor."""
    clock_hz, load_codes, u_dc_code = bus
    period = steps * STEP
    memory, word = np.zeros(3), 0
    times, words = np.zeros(3 * 6, np.int64), np.zeros(3 * 6, np.int64)
    at_s, gates = np.zeros(3 * 6), np.zeros(3 * 6, np.int64)
    for n in range(len(rows)):
        duty = duties(control, memory, plant, ride.speed_rad_s[n])
        count = 0
        for leg in range(3):
            count = edges(duty[leg], period, dead, leg, word, times, words, count)
        sorted_events(times, words, count)
        plant_word = word
        for k in range(count):
            plant_word = (plant_word | words[k] >> 6) & ~(words[k] & 63)
            at_s[k], gates[k] = times[k] / clock_hz, plant_word
        advance_switching(
            plant, params, at_s[:count], gates[:count], control.u_dc, ride.load_nm[n], period / clock_hz, -1.0
        )
        motor, word = follow(motor, word, (times, words, count), steps, u_dc_code, load_codes[n], registers, tables)
        seen, shaft = motor.chain_1, motor.of_shaft
        for k in range(5):
            rows[n, k] = plant[L.I_A + k]
        rows[n, 5], rows[n, 6], rows[n, 7] = plant[L.TORQUE], plant[L.OMEGA_M], plant[L.THETA_M]
        rows[n, 8], rows[n, 9], rows[n, 10] = seen.i_a, seen.i_b, seen.i_c
        rows[n, 11], rows[n, 12] = seen.i_d, seen.i_q
        rows[n, 13] = seen.turn_d * seen.i_q - seen.turn_q * seen.i_d
        rows[n, 14], rows[n, 15] = shaft.omega, shaft.theta
    return motor


class Both(NamedTuple):
    """Columns of plant and motor at the end of each period, in SI units; torque without cogging."""

    plant: np.ndarray
    motor: np.ndarray


def beside_plant(scale: Scale, machine: Machine, inverter: Inverter, control: Control, ride: Ride, period_s: float) -> Both:
    """Both through a ride; the plant has the machine that the motor's rounded registers describe."""
    registers, tables = motor_registers(scale, machine, inverter), motor_tables(scale, machine)
    rounded = machine_of(scale, registers, machine, inverter)
    steps = round(period_s / scale.step_s)
    dead = round(inverter.dead_time_s * scale.clock_hz)
    params = plant_params(rounded, inverter, max_step_s=20e-6)
    plant = initial_state(rounded, params)
    u_dc = scale.u_dc(control.u_dc)
    exact = control._replace(u_dc=u_dc * MOTOR_VOLTAGE.lsb * scale.voltage_v)
    loads = np.array([scale.load(torque) for torque in ride.load_nm], np.int64)
    motor = motor_model.State()
    for _ in range(2 * motor_model.STARTING):
        motor, _ = motor_step(motor, motor_model.Inputs(u_dc=u_dc), registers, tables, STEP)
    rows = np.zeros((len(ride.load_nm), 2 * len(COLUMNS)))
    true_ride = Ride(ride.speed_rad_s, loads * FLUX.lsb * scale.torque_nm)
    ride_both(plant, params, exact, motor, (scale.clock_hz, loads, u_dc), true_ride, registers, tables, steps, dead, rows)
    units = [scale.current_a * PU.lsb] * 5 + [scale.torque_nm * FLUX.lsb * PU.lsb]
    units += [2 * math.pi / scale.step_s * motor_shaft.OMEGA.lsb, 2 * math.pi * motor_shaft.THETA.lsb]
    return Both(rows[:, : len(COLUMNS)], rows[:, len(COLUMNS) :] * units)
