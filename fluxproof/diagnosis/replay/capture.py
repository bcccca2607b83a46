# SPDX-License-Identifier: BSD-3-Clause
"""Telemetry of a simulation: the golden model in closed loop with the averaged plant, all signals recorded.

The same data as a test bench receives from the core over AXI4-Stream.
"""

from __future__ import annotations

import numpy as np

from fluxproof.cosim.driven_plant import Scenario, described_sensors
from fluxproof.cosim.golden_loop import mixed_kernel
from fluxproof.plant import (
    Inverter,
    Machine,
    Sensors,
    advance_averaged,
    current_code,
    initial_state,
    plant_params,
    position_code,
    sensor_params,
    u_dc_code,
)
from fluxproof.plant import layout as L
from golden_model import fluxproof
from golden_model.io.telemetry_words import COUNT, COUNTER, HEADER, HEADER_WORD, LAYOUT, PACKET


def capture(drive, register_set, scenario: Scenario, machine=None, inverter=None, sensors: Sensors | None = None,
            mode=0, state=None):  # fmt: skip
    """(samples (n, 13) int64, {name of Observed: (n,) int64}, final state of the core) of a closed loop.

    ``scenario.load`` is a torque [Nm], with ``mode`` IMPOSED_SPEED the mechanical speed [rad/s].
    """
    machine = machine or Machine.from_mapping(vars(drive.machine))
    params = plant_params(machine, inverter or Inverter(), mode=mode)
    plant_state = initial_state(machine, params, omega_m=scenario.omega_m, theta_m=scenario.theta_m)
    samples = np.zeros((len(scenario), len(fluxproof.Sample._fields)), np.int64)
    references = (scenario.omega_ref, scenario.i_d_ref, scenario.i_q_ext, scenario.speed_mode)
    for column, values in enumerate((*references, *scenario.slow_inputs(), scenario.enable)):
        samples[:, 5 + column] = values
    observed = np.zeros((len(scenario), len(fluxproof.Observed._fields)), np.int64)
    state = _capture(
        state or fluxproof.State(), samples, np.asarray(scenario.u_dc, float), np.asarray(scenario.load, float),
        register_set.values, register_set.config, plant_state, params,
        sensor_params(sensors or described_sensors(drive)), drive.sample_time_s, observed, register_set.table,
    )  # fmt: skip
    names = fluxproof.Observed._fields
    return samples, {name: observed[:, n].copy() for n, name in enumerate(names)}, state


@mixed_kernel
def _capture(
    state, samples, u_dc, load, registers, config, plant_state, params, sensors, period_s, observed, table
):  # fmt: skip
    """Fill ``samples`` and ``observed`` with codes; the duties of a sample act in the next period."""
    duties = np.full(3, 0.5)
    for k in range(load.shape[0]):
        x = samples[k]
        x[0] = current_code(sensors, 0, plant_state[L.I_A], k)
        x[1] = current_code(sensors, 1, plant_state[L.I_B], k)
        x[2] = current_code(sensors, 2, plant_state[L.I_C], k)
        x[3] = u_dc_code(sensors, u_dc[k], k)
        x[4] = position_code(sensors, plant_state[L.THETA_M], k)
        sample = fluxproof.Sample(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12])
        of_speed = fluxproof.given_by_registers(registers)
        state, seen = fluxproof.step_table(state, sample, registers, config, of_speed, table)
        for n, value in enumerate(seen):
            observed[k, n] = value
        half = (1 - 2 * (k & 1)) * registers.double_update
        advance_averaged(plant_state, params, duties, u_dc[k], load[k], period_s, half)
        duties[0] = seen.compare_a / config.carrier_half
        duties[1] = seen.compare_b / config.carrier_half
        duties[2] = seen.compare_c / config.carrier_half
    return state


def packets(samples, observed, first: int = 0) -> np.ndarray:
    """The telemetry of a capture as the core sends it, (n, COUNT) uint32, numbered from ``first`` on."""
    fields = dict(zip(fluxproof.Sample._fields, samples.T, strict=True)) | {name: observed[name] for name in PACKET}
    fields |= {HEADER: np.full(len(samples), HEADER_WORD), COUNTER: first + np.arange(len(samples))}
    words = np.zeros((len(samples), COUNT), np.uint32)
    for name, field in LAYOUT.items():
        words[:, field.word] |= ((fields[name] & ((1 << field.width) - 1)) << field.lsb).astype(np.uint32)
    return words
