# SPDX-License-Identifier: BSD-3-Clause
"""The golden model in compiled loops: open loop, and closed with the averaged or the switching plant."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fluxproof.cosim.closed_loop import Result
from fluxproof.cosim.driven_plant import Scenario, described_sensors, load_torque
from fluxproof.cosim.sensor_edges import HALL, Edges, edge_speed, hall_code, no_edges
from fluxproof.plant import (
    FREE,
    Bus,
    Inverter,
    Machine,
    advance_averaged,
    advance_bus,
    advance_switching,
    centred_gates,
    half_gates,
    initial_state,
    plant_params,
    sensor_params,
)
from fluxproof.plant import layout as L
from fluxproof.plant.jit import SOURCE_HASH
from fluxproof.plant.sensors import current_code, position_code, sensed_angle, u_dc_code
from golden_model import fluxproof
from golden_model.kernel import CACHE_DIR, kernel
from golden_model.units import TURN_RAD

BOTH = CACHE_DIR.parent / f"{CACHE_DIR.name}-{SOURCE_HASH}"


def mixed_kernel(function):
    """A kernel that calls the golden model and the plant."""
    return kernel(function, BOTH)


class Stimulus(NamedTuple):
    """What n periods are given."""

    samples: np.ndarray  # (n, 8) int64: the fields of fluxproof.Sample after the codes
    u_dc: np.ndarray  # (n,) V, of the source
    load: np.ndarray  # (n,) Nm; with an imposed speed rad/s
    brake: np.ndarray  # (n,) Nm, against the rotation


class Bench(NamedTuple):
    """The core's settings and the switching plant around it; the arrays change in place."""

    registers: fluxproof.Registers
    config: fluxproof.Config
    plant_state: np.ndarray  # as plant/layout.py
    plant_params: Any  # of plant_params()
    sensors: Any  # of sensor_params()
    dead_time_s: float  # s
    period_s: float  # s, of a sample
    levels: np.ndarray  # (3,) as half_gates
    waits: np.ndarray  # (3,) s, as half_gates
    free: bool  # False: the speed is imposed
    bus: Bus
    u_dc: np.ndarray  # (1,) V, of the bus
    edges: Edges  # of Hall sensors; of other encoders the position is a code
    table: np.ndarray  # words of the torque table, as RegisterSet


@kernel
def run_controller(state, samples, registers, config, observed):
    """``samples`` (n, 13) in, ``observed`` (n, len(Observed)) out, both int64; returns the last state."""
    for k in range(samples.shape[0]):
        state, out = fluxproof.step(state, fluxproof.sample_of(samples[k]), registers, config)
        for n, value in enumerate(out):
            observed[k, n] = value
    return state


@mixed_kernel
def run_averaged(state, references, u_dc, load, registers, config, plant_state, plant_params, sensors, period_s, out):
    """Closed loop over the averaged plant; the duties of a sample act in the next period of ``period_s``, which is half
    a PWM period with double_update.

    ``references`` (n, 4) int64: omega_ref, i_d_ref, i_q_ext, speed_mode; ``u_dc`` [V], ``load`` [Nm] (n,).
    ``out`` (n, 8) float64 receives i_d, i_q [A], lambda_d, lambda_q [Wb], omega_m [rad/s], torque [Nm] before the
    period, and u_alpha, u_beta [V] during it.  Returns the controller's last state.
    """
    duties = np.full(3, 0.5)
    for k in range(load.shape[0]):
        out[k, 0], out[k, 1] = plant_state[L.I_D], plant_state[L.I_Q]
        out[k, 2], out[k, 3] = plant_state[L.LAMBDA_D], plant_state[L.LAMBDA_Q]
        out[k, 4], out[k, 5] = plant_state[L.OMEGA_M], plant_state[L.TORQUE]
        sample = fluxproof.Sample(
            adc_a=current_code(sensors, 0, plant_state[L.I_A], k),
            adc_b=current_code(sensors, 1, plant_state[L.I_B], k),
            adc_c=current_code(sensors, 2, plant_state[L.I_C], k),
            adc_u_dc=u_dc_code(sensors, u_dc[k], k),
            position_code=position_code(sensors, plant_state[L.THETA_M], k),
            omega_ref=references[k, 0],
            i_d_ref=references[k, 1],
            i_q_ext=references[k, 2],
            speed_mode=references[k, 3],
            temp_winding=0,
            temp_valid=0,
            clear_faults=0,
            run=1,
        )
        state, seen = fluxproof.step(state, sample, registers, config)
        half = (1 - 2 * (k & 1)) * registers.double_update
        advance_averaged(plant_state, plant_params, duties, u_dc[k], load[k], period_s, half)
        out[k, 6], out[k, 7] = plant_state[L.U_ALPHA], plant_state[L.U_BETA]
        duties[0] = seen.compare_a / config.carrier_half
        duties[1] = seen.compare_b / config.carrier_half
        duties[2] = seen.compare_c / config.carrier_half
    return state


IDEAL = Bus()
PROGRESS_PERIODS = 5000  # a tenth of a second
# power into the motor, brake_power in the brake resistor: means of the period that follows
PLANT = ("i_d", "i_q", "lambda_d", "lambda_q", "omega_m", "torque", "u_dc", "power", "brake_power")


@mixed_kernel
def position(bench, number):
    """(position code, omega_given) at the sample of this number."""
    b, plant_state = bench, bench.plant_state
    if b.edges.speed[HALL] == 0.0:
        return position_code(b.sensors, plant_state[L.THETA_M], number), b.registers.omega_given
    turns = sensed_angle(b.sensors, plant_state[L.THETA_M]) / TURN_RAD
    turns_per_s, now = b.sensors.direction * plant_state[L.OMEGA_M] / TURN_RAD, number * b.period_s
    sense = -1 if b.registers.reverse else 1
    omega = sense * edge_speed(b.edges, turns, turns_per_s, now)
    return hall_code(b.edges, turns, turns_per_s, now, b.config.position_bits), omega


@mixed_kernel
def run_switching(state, stimulus, bench, first, out, observed):
    """Closed loop over the switching plant; returns the controller's state.

    ``stimulus``: Stimulus of n periods; ``bench``: Bench.  ``first``: number of the first period, for the sensors'
    noise, and with double_update for the half: even ones rise.
    ``out`` (n, 9) receives the signals of PLANT before each period, ``observed`` the core's.
    """
    b, plant_state, sensors = bench, bench.plant_state, bench.sensors
    duties = np.zeros(3)
    for k in range(stimulus.load.shape[0]):
        out[k, 0], out[k, 1] = plant_state[L.I_D], plant_state[L.I_Q]
        out[k, 2], out[k, 3] = plant_state[L.LAMBDA_D], plant_state[L.LAMBDA_Q]
        out[k, 4], out[k, 5] = plant_state[L.OMEGA_M], plant_state[L.TORQUE]
        given = stimulus.samples[k]
        u_dc = b.u_dc[0] if b.bus.capacitance > 0.0 else stimulus.u_dc[k]
        out[k, 6] = u_dc
        code, omega_given = position(b, first + k)
        of_speed = fluxproof.Given(
            speed_given=b.registers.speed_given,
            omega_given=omega_given,
            position_restart=b.registers.position_restart,
            emf_samples=b.registers.emf_samples,
            gear_code=b.registers.gear_code,
        )
        sample = fluxproof.Sample(
            adc_a=current_code(sensors, 0, plant_state[L.I_A], first + k),
            adc_b=current_code(sensors, 1, plant_state[L.I_B], first + k),
            adc_c=current_code(sensors, 2, plant_state[L.I_C], first + k),
            adc_u_dc=u_dc_code(sensors, u_dc, first + k),
            position_code=code,
            omega_ref=given[0],
            i_d_ref=given[1],
            i_q_ext=given[2],
            speed_mode=given[3],
            temp_winding=given[4],
            temp_valid=given[5],
            clear_faults=given[6],
            run=given[7],
        )
        duties[0] = state.compare_a / b.config.carrier_half
        duties[1] = state.compare_b / b.config.carrier_half
        duties[2] = state.compare_c / b.config.carrier_half
        state, seen = fluxproof.step_table(state, sample, b.registers, b.config, of_speed, b.table)
        for n, value in enumerate(seen):
            observed[k, n] = value
        if b.registers.double_update:
            half = 1 - 2 * ((first + k) & 1)
            times, words = half_gates(duties, half, b.levels, b.waits, b.dead_time_s, b.period_s)
        else:
            times, words = centred_gates(duties, b.dead_time_s, b.period_s)
        if not sample.run:
            words[:], b.levels[:], b.waits[:] = 0, 0.0, b.dead_time_s
        pull = stimulus.load[k]
        if b.free:
            pull = load_torque(pull, stimulus.brake[k], plant_state[L.OMEGA_M])
        advance_switching(plant_state, b.plant_params, times, words, u_dc, pull, b.period_s, -1.0)
        brake = state.of_brake_chopper.brake
        out[k, 7], out[k, 8] = plant_state[L.P_IN], brake * u_dc * u_dc / b.bus.brake_ohm
        b.u_dc[0] = advance_bus(u_dc, b.bus, stimulus.u_dc[k], plant_state[L.P_IN], brake, b.period_s)
    return state


def simulate(
    drive, register_set, scenario: Scenario, machine=None, sensors=None, dead_time_s=0.0, mode=FREE, state=None,
    inverter=None, progress=None, bus=IDEAL, edges=None,
) -> Result:  # fmt: skip
    """``scenario`` with the golden model and the switching plant, compiled; as cosim.cosimulate, but faster.

    The inverter follows the compare values in force with a dead time of ``dead_time_s``; zero is the ideal inverter
    that paper 001 assumes; ``inverter`` adds device drops.  ``state`` is the controller's initial state; the result has
    the last one.  ``mode`` IMPOSED_SPEED: the scenario's load is the mechanical speed [rad/s].
    ``bus``: what is between the source, whose voltage is the scenario's u_dc, and the inverter.  ``edges``: of Hall
    sensors, whose angle is then that of the board; the registers must be those of such a code.
    ``progress``, if given, is called with the periods done and their number, every PROGRESS_PERIODS.
    """
    machine = machine or Machine.from_mapping(vars(drive.machine))
    params = plant_params(machine, inverter or Inverter(), mode=mode)
    n = len(scenario)
    inputs = np.zeros((n, 8), np.int64)
    columns = (
        scenario.omega_ref,
        scenario.i_d_ref,
        scenario.i_q_ext,
        scenario.speed_mode,
        *scenario.slow_inputs(),
        scenario.enable,
    )
    for column, values in enumerate(columns):
        inputs[:, column] = values
    brake = np.zeros(n) if scenario.brake is None else scenario.brake
    out, observed = np.zeros((n, len(PLANT))), np.zeros((n, len(fluxproof.Observed._fields)), np.int64)
    state, values = state or fluxproof.State(), register_set.values
    bench = Bench(
        registers=values,
        config=register_set.config,
        plant_state=initial_state(machine, params, omega_m=scenario.omega_m, theta_m=scenario.theta_m),
        plant_params=params,
        sensors=sensor_params(sensors or described_sensors(drive)),
        dead_time_s=float(dead_time_s),
        period_s=drive.sample_time_s,
        levels=np.zeros(3),
        waits=np.full(3, float(dead_time_s)),
        free=mode == FREE,
        bus=bus,
        u_dc=np.array([float(scenario.u_dc[0])]),
        edges=edges or no_edges(),
        table=register_set.table,
    )
    shown = set() if progress is None else set(range(0, n, PROGRESS_PERIODS))
    ends = [*sorted((set(scenario.changes) | shown) - {0}), n]
    for start, end in zip([0, *ends[:-1]], ends, strict=True):
        values = values._replace(**scenario.changes.get(start, {}))
        part = slice(start, end)
        stimulus = Stimulus(inputs[part], scenario.u_dc[part], scenario.load[part], brake[part])
        bench = bench._replace(registers=values)
        state = run_switching(state, stimulus, bench, start, out[part], observed[part])
        if progress is not None:
            progress(end, n)
    names = fluxproof.Observed._fields
    return Result(
        observed=dict(zip(names, observed.T, strict=True)),
        plant=dict(zip(PLANT, out.T, strict=True)),
        periods_compared=n,
        state=state,
    )
