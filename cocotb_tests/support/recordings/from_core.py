# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of the project's own drive for the tests of the diagnosis: the golden core on the switching plant.

The core runs in torque mode through a plan of operating points while a test bench imposes the speed.  Machine,
inverter, sensors and their errors are the plant's, so nothing here knows how the diagnosis models an effect.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from cocotb_tests.support.drives import PAPER
from fluxproof.cosim.driven_plant import Scenario, described_sensors
from fluxproof.cosim.golden_loop import simulate
from fluxproof.diagnosis.ground.recording import Recording, from_columns
from fluxproof.diagnosis.replay.capture import capture
from fluxproof.plant import IMPOSED_SPEED, Inverter, Machine
from golden_model import drive as drives
from golden_model.registers import registers
from golden_model.units import from_si, si_per_lsb

DRIVE = drives.load(PAPER)
SET = registers(DRIVE)
MACHINE = Machine.from_mapping(vars(DRIVE.machine))
SENSORS = dataclasses.replace(described_sensors(DRIVE), current_noise_a=0.004, u_dc_noise_v=0.2)
RAMP = 150  # rows from one operating point to the next
DWELL = 650  # rows at an operating point
# Mechanical speed [rad/s] with i_d, i_q [A], in an order that does not tie current to time.
GRID = tuple(
    (speed, i_d, i_q)
    for speed, shift in ((12.0, 0), (160.0, 1), (-60.0, 2), (80.0, 3), (-160.0, 1), (30.0, 2))
    for i_d, i_q in np.roll([(0.0, 0.0), (0.0, 5.0), (-2.5, 2.0), (0.0, -5.0), (-2.5, -2.0), (2.0, 1.0)], shift, axis=0)
)  # fmt: skip
POINT = ((80.0, 0.0, 3.0),) * 20


def scenario(plan) -> Scenario:
    """The plan as staircases with ramps between; one column of rows for each operating point."""
    rows = RAMP + DWELL
    before = np.concatenate([[(0.0, 0.0, 0.0)], plan[:-1]])
    rise = np.minimum((np.arange(rows) + 1) / RAMP, 1.0)[None, :, None]
    course = np.concatenate(before[:, None, :] + rise * (np.array(plan) - before)[:, None, :])
    n = len(course)

    def integers(name, values):
        lsb = si_per_lsb(name, DRIVE)
        assert from_si(name, float(values.max()), DRIVE) == round(float(values.max()) / lsb)
        return np.round(values / lsb).astype(np.int64)

    zeros = np.zeros(n, np.int64)
    return Scenario(
        omega_ref=zeros, load=course[:, 0].copy(), u_dc=np.full(n, DRIVE.inverter.dc_bus_v),
        i_d_ref=integers("i_d_ref", course[:, 1]), i_q_ext=integers("i_q_ext", course[:, 2]), speed_mode=zeros,
        enable=np.ones(n, np.int64),
    )  # fmt: skip


@functools.lru_cache
def columns(plan=GRID, machine=(), inverter=(), sensors=(), dead_time_s=0.0) -> dict[str, np.ndarray]:
    """Canonical columns (n,) of a run; machine, inverter and sensors: ((key, value), ...) replace the nominal."""
    result = simulate(
        DRIVE, SET, scenario(plan), machine=dataclasses.replace(MACHINE, **dict(machine)),
        sensors=dataclasses.replace(SENSORS, **dict(sensors)), inverter=Inverter(**dict(inverter)),
        dead_time_s=dead_time_s, mode=IMPOSED_SPEED,
    )  # fmt: skip
    seen = result.observed
    names = {
        "i_a": "i_a",
        "i_b": "i_b",
        "i_c": "i_c",
        "theta_e": "theta_me",
        "omega_e": "omega_me",
        "u_dc": "u_dc",
    }
    table = {name: seen[signal] * si_per_lsb(signal, DRIVE) for name, signal in names.items()}
    table |= {f"d_{x}": seen[f"compare_{x}"] / SET.config.carrier_half for x in "abc"}
    return {"t": np.arange(len(seen["i_a"])) * DRIVE.sample_time_s} | table


def recorded(plan=GRID, machine=None, inverter=None, sensors=None, dead_time_s=0.0) -> Recording:
    """A recording with the named deviations from the nominal drive, {key of the plant's dataclass: value}."""
    parts = [tuple((part or {}).items()) for part in (machine, inverter, sensors)]
    return from_columns(columns(plan, *parts, dead_time_s), DRIVE.sample_time_s, "test bench")


def dumped(plan=GRID, machine=None):
    """(samples, observed) of the averaged plant for a telemetry dump."""
    changed = dataclasses.replace(MACHINE, **(machine or {}))
    samples, observed, _ = capture(DRIVE, SET, scenario(plan), machine=changed, sensors=SENSORS, mode=IMPOSED_SPEED)
    return samples, observed
