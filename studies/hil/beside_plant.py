# SPDX-License-Identifier: BSD-3-Clause
"""The motor of the FPGA beside the double-precision plant, with the same load, seen at the same times.

    HELD   the same gates, clock by clock; the motor's shaft is turned as the plant's: what differs is electrical alone
    OWN    a control of its own for each, of the same gains and references: the whole drive

A free shaft with the plant's gates would be a synchronous machine at the mains: lightly loaded it hunts, and a
difference grows however small it was.  The control is field-oriented, in floating point, with an angle led along
the reference, so that neither drifts.  A PWM period is a whole number of the motor's steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
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

HELD, OWN = 0, 1
motor_step, Registers, SET_SHIFT = motor_model.step, motor_model.Registers, motor_shaft.SET_SHIFT
MotorInputs, STEP = motor_model.Inputs, motor_model.STEP
SETTLING = 2000  # steps with all gates off before the ride, in which no current is left
COLUMNS = ("i_a", "i_b", "i_c", "i_d", "i_q", "torque", "omega", "theta")


class Control(NamedTuple):
    """Gains of the control, and what it knows of the drive."""

    current_p: float
    current_i: float  # per period
    speed_p: float
    speed_i: float  # per period
    angle_p: float  # speed per angle
    limit_a: float
    u_dc: float
    pole_pairs: float
    l_d: float
    l_q: float
    psi_m: float


class Ride(NamedTuple):
    """What both go through, a value a period."""

    speed_rad_s: np.ndarray
    angle_rad: np.ndarray
    load_nm: np.ndarray


@mixed_kernel
def duties(control, memory, seen, speed, angle):
    """Duties of the three legs from ``seen`` = (i_d, i_q, omega, theta); ``memory``: integrals, changed in place."""
    c = control
    i_d, i_q, omega, theta = seen
    error = speed + c.angle_p * (angle - theta) - omega
    i_q_ref = c.speed_p * error + memory[2]
    if abs(i_q_ref) > c.limit_a:
        i_q_ref = math.copysign(c.limit_a, i_q_ref)
    else:
        memory[2] += c.speed_i * error
    e_d, e_q = -i_d, i_q_ref - i_q
    memory[0] += c.current_i * e_d
    memory[1] += c.current_i * e_q
    w = c.pole_pairs * omega
    u_d = c.current_p * e_d + memory[0] - w * c.l_q * i_q
    u_q = c.current_p * e_q + memory[1] + w * (c.psi_m + c.l_d * i_d)
    size, most = math.hypot(u_d, u_q), c.u_dc / math.sqrt(3.0)
    if size > most:
        u_d, u_q = u_d * most / size, u_q * most / size
    cos, sin = math.cos(c.pole_pairs * theta), math.sin(c.pole_pairs * theta)
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
def period_edges(duty, period, dead, word, times, words):
    """All edges of a period in their order, in place; how many."""
    count = 0
    for leg in range(3):
        count = edges(duty[leg], period, dead, leg, word, times, words, count)
    sorted_events(times, words, count)
    return count


@mixed_kernel
def held(r, omega_set):
    """The registers with another held speed."""
    return Registers(
        r.stiffness, r.v_switch, r.v_diode, r.r_a, r.r_b, r.r_c, r.psi_start, r.psi_m, r.inv_l_d, r.inv_l_q,
        r.k_j, r.viscous, r.coulomb, r.pole_pairs, r.hold, omega_set,
    )  # fmt: skip


@mixed_kernel
def ride_both(how, plant, params, control, motor, bus, ride, registers, tables, steps, dead, rows):
    """Both through a ride.

    ``bus`` = (clock_hz, code of the bus, load codes, units); ``rows``: COLUMNS of plant, then motor, in ``units``.
    """
    clock_hz, u_dc_code, load_codes, units = bus
    period = steps * STEP
    memory, own_memory, word, own_word = np.zeros(3), np.zeros(3), 0, 0
    times, words = np.zeros(3 * 6, np.int64), np.zeros(3 * 6, np.int64)
    own_times, own_words = np.zeros(3 * 6, np.int64), np.zeros(3 * 6, np.int64)
    at_s, gates = np.zeros(3 * 6), np.zeros(3 * 6, np.int64)
    turns, last = 0, 0
    for n in range(len(rows)):
        seen = (plant[L.I_D], plant[L.I_Q], plant[L.OMEGA_M], plant[L.THETA_M])
        duty = duties(control, memory, seen, ride.speed_rad_s[n], ride.angle_rad[n])
        count = period_edges(duty, period, dead, word, times, words)
        before = word
        for k in range(count):
            word = (word | words[k] >> 6) & ~(words[k] & 63)
            at_s[k], gates[k] = times[k] / clock_hz, word
        advance_switching(
            plant, params, at_s[:count], gates[:count], control.u_dc, ride.load_nm[n], period / clock_hz, -1.0
        )
        if how == OWN:
            chain = motor.chain_1
            theta = rows[n - 1, 15] if n else 0.0
            own = (chain.i_d * units[3], chain.i_q * units[4], motor.of_shaft.omega * units[6], theta)
            duty = duties(control, own_memory, own, ride.speed_rad_s[n], ride.angle_rad[n])
            own_count = period_edges(duty, period, dead, own_word, own_times, own_words)
            events = (own_times, own_words, own_count)
        else:
            own_word, events = before, (times, words, count)
        if how == HELD:
            left = plant[L.THETA_M] / units[7] - turns * 2.0**56 - motor.of_shaft.theta
            now = held(registers, int(round(left / steps / 2**SET_SHIFT)))
        else:
            now = registers
        motor, own_word = follow(motor, own_word, events, steps, u_dc_code, load_codes[n], now, tables)
        chain, shaft = motor.chain_1, motor.of_shaft
        turns += (shaft.theta - last < -(1 << 55)) - (shaft.theta - last > (1 << 55))
        last = shaft.theta
        for k in range(5):
            rows[n, k] = plant[L.I_A + k]
        rows[n, 5], rows[n, 6], rows[n, 7] = plant[L.TORQUE], plant[L.OMEGA_M], plant[L.THETA_M]
        rows[n, 8], rows[n, 9], rows[n, 10] = chain.i_a * units[0], chain.i_b * units[1], chain.i_c * units[2]
        rows[n, 11], rows[n, 12] = chain.i_d * units[3], chain.i_q * units[4]
        rows[n, 13] = (chain.turn_d * chain.i_q - chain.turn_q * chain.i_d) * units[5]
        rows[n, 14], rows[n, 15] = shaft.omega * units[6], (shaft.theta + turns * 2.0**56) * units[7]


class Both(NamedTuple):
    """Columns of plant and motor at the end of each period, in SI units; torque without cogging."""

    plant: np.ndarray
    motor: np.ndarray


@dataclass(frozen=True)
class Drive:
    """A drive on both sides."""

    scale: Scale
    machine: Machine
    inverter: Inverter
    control: Control
    period_s: float


def beside_plant(drive: Drive, ride: Ride, how: int) -> Both:
    """Both through a ride; the plant has the machine that the motor's rounded registers describe."""
    scale, machine, inverter, control = drive.scale, drive.machine, drive.inverter, drive.control
    registers = motor_registers(scale, machine, inverter, 0.0 if how == HELD else None)
    tables, rounded = motor_tables(scale, machine), machine_of(scale, registers, machine, inverter)
    steps, dead = round(drive.period_s / scale.step_s), round(inverter.dead_time_s * scale.clock_hz)
    params = plant_params(rounded, inverter, max_step_s=20e-6)
    plant = initial_state(rounded, params)
    u_dc = scale.u_dc(control.u_dc)
    exact = control._replace(u_dc=u_dc * MOTOR_VOLTAGE.lsb * scale.voltage_v)
    loads = np.array([scale.load(torque) for torque in ride.load_nm], np.int64)
    motor = motor_model.State()
    for _ in range(SETTLING):
        motor, _ = motor_step(motor, motor_model.Inputs(u_dc=u_dc), registers, tables, STEP)
    units = [scale.current_a * PU.lsb] * 5 + [scale.torque_nm * FLUX.lsb * PU.lsb]
    units += [2 * math.pi / scale.step_s * motor_shaft.OMEGA.lsb, 2 * math.pi * motor_shaft.THETA.lsb]
    rows = np.zeros((len(ride.load_nm), 2 * len(COLUMNS)))
    bus = (scale.clock_hz, u_dc, loads, np.array(units))
    same = ride._replace(load_nm=loads * FLUX.lsb * scale.torque_nm)
    ride_both(how, plant, params, exact, motor, bus, same, registers, tables, steps, dead, rows)
    cogging = rounded.cogging_order * rows[:, 7] + rounded.cogging_phase_rad
    rows[:, 5] -= rounded.cogging_amplitude_nm * np.sin(cogging)
    return Both(rows[:, : len(COLUMNS)], rows[:, len(COLUMNS) :])
