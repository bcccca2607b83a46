# SPDX-License-Identifier: BSD-3-Clause
"""A step of a reference on a running drive, and what `simulate` makes of the same step: golden core, switching plant.

The current loop is predicted at the recorded speed, so that no inertia counts; the speed loop on a free shaft, with the
load that the current before the step stands for:

    T_load = 1.5*p*(psi + (L_d - L_q)*i_d)*i_q - B*omega_m - T_coulomb*sign(omega_m)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.step_response import LOOPS, Loop, Situation
from fluxproof.simulate.run import run
from fluxproof.simulate.scene import SETTLE, STEP_SAMPLES, Scene, Stage, crossover, torque_per_a
from golden_model.drive import Drive
from golden_model.registers import RegisterSet
from golden_model.scaling import speed_gains
from golden_model.units import from_si

MOST_SAMPLES = 100_000  # before or after a step: some seconds of computing


def loops_of(drive: Drive) -> tuple[Loop, ...]:
    """The loops that can be predicted: the speed loop where the file has its gain, a flux and an inertia."""
    m = drive.machine
    known = m.inertia_kgm2 > 0.0 and m.magnet_flux_wb > 0.0 and speed_gains(drive)[0] > 0.0
    return LOOPS if known else LOOPS[:1]


def length(drive: Drive, loop: Loop, change: float) -> int:
    """Samples that a step of this size [A or electrical rad/s] takes until its loop has settled."""
    if not loop.speed_mode:
        return STEP_SAMPLES
    m = drive.machine
    per_s = m.pole_pairs * torque_per_a(drive) * drive.current_limit_a / m.inertia_kgm2
    return min(round((SETTLE / crossover(drive) + 1.3 * abs(change) / per_s) / drive.sample_time_s), MOST_SAMPLES)


def load_nm(drive: Drive, at: Situation) -> float:
    """The load's torque before the step; at rest the friction holds what it can."""
    m = drive.machine
    omega_m = at.before / m.pole_pairs
    flux = m.magnet_flux_wb + (m.inductance_d_h - m.inductance_q_h) * at.i_d
    torque = 1.5 * m.pole_pairs * flux * at.i_q - m.viscous_friction_nms * omega_m
    if at.before == 0.0:
        return float(np.sign(torque) * max(abs(torque) - m.coulomb_friction_nm, 0.0))
    return float(torque - m.coulomb_friction_nm * np.sign(omega_m))


def predicted(drive: Drive, register_set: RegisterSet, at: Situation) -> np.ndarray:
    """The response [A or electrical rad/s] at the samples of ``at.omega``, on an ideal bus of the recorded voltage."""
    speed, n = bool(at.loop.speed_mode), len(at.omega)
    first = length(drive, at.loop, 0.0)
    zeros = np.zeros(first + n, np.int64)
    given = np.array([from_si(at.loop.reference, value, drive) for value in (at.before, at.after)], np.int64)
    steps, pairs = np.repeat(given, [first, n]), drive.machine.pole_pairs
    before = at.before / pairs if speed else at.omega[0] / pairs
    shaft = np.concatenate([np.full(first, at.omega[0]), at.omega]) / pairs
    scenario = Scenario(
        omega_ref=steps if speed else zeros,
        load=np.full(first + n, load_nm(drive, at)) if speed else shaft,
        u_dc=np.full(first + n, at.u_dc),
        i_d_ref=zeros + int(from_si("i_d_ref", at.i_d, drive)),
        i_q_ext=zeros if speed else steps,
        speed_mode=zeros + at.loop.speed_mode,
        enable=zeros + 1,
        omega_m=float(before),
        theta_m=float(at.theta / pairs - before * first * drive.sample_time_s),
    )
    stages = Stage("before", 0, first, at.before), Stage("step", first, first + n, at.after)
    changes = {"v_start": at.v_comp}
    if drive.encoder.kind != "hall":  # the board gives the speed of Hall sensors alone to a simulated core
        changes["speed_given"] = 0
    register_set = register_set._replace(values=register_set.values._replace(**changes))
    ideal = replace(drive, supply=replace(drive.supply, source="ideal"))
    done = run(ideal, register_set, Scene(scenario, stages, imposed=not speed))
    return done[at.loop.signal][first:]
