# SPDX-License-Identifier: BSD-3-Clause
"""A move of a drive with a position loop: there and back at the speed and acceleration of [position]."""

from __future__ import annotations

import numpy as np

from fluxproof.cosim.driven_plant import Scenario
from fluxproof.simulate.figures import of_stage, tail
from fluxproof.simulate.run import Run
from fluxproof.simulate.scene import LONGEST_S, Scene, Stage
from golden_model.drive import Drive
from golden_model.motion import count_turns, limits, to_position
from golden_model.units import TURN_RAD

START_SAMPLES = 50
REST_OF_LOOP = 8.0  # time constants of the position loop at the end of a move
HELD = 1.0 / 3.0  # of a move's time at full speed


def move_scene(drive: Drive) -> Scene:
    """There and back, a rest after each; a way within the soft end stops and LONGEST_S."""
    speed, acceleration, bits = limits(drive)
    p, t_s = drive.position, drive.sample_time_s
    speed = min(speed, acceleration * LONGEST_S * (1.0 - HELD) / 2.0)
    ramp = speed / acceleration
    way = speed * ramp * (1.0 + 2.0 * HELD / (1.0 - HELD))
    first = 0.0
    if p.stop_low_rad is not None and p.stop_high_rad is not None:
        first = p.stop_low_rad
        way = min(way, p.stop_high_rad - p.stop_low_rad)
    bandwidth = TURN_RAD * (p.bandwidth_hz or (drive.control.speed_bandwidth_hz or 1.0) / 4.0)
    length = round((2.0 * ramp + way / speed + REST_OF_LOOP / bandwidth) / t_s) + (32 << bits)
    plan = (("start", START_SAMPLES), ("to the start", length if first else 0), ("move", length), ("move back", length))
    targets = {"to the start": first, "move": first + way, "move back": first}
    stages, changes, now = [], {0: {"position_mode": 1}}, 0
    for name, samples in plan:
        if not samples:
            continue
        stages.append(Stage(name, now, now + samples, 0.0))
        if name in targets:
            changes[now] = {"position_target": to_position(targets[name])}
        now += samples
    zeros = np.zeros(now, np.int64)
    scenario = Scenario(
        omega_ref=zeros, load=np.zeros(now), u_dc=np.full(now, drive.inverter.dc_bus_v), i_d_ref=zeros, i_q_ext=zeros,
        speed_mode=zeros, enable=zeros + 1, changes=changes,
    )  # fmt: skip
    return Scene(scenario, tuple(stages))


def of_move(drive: Drive, run: Run) -> dict:
    """Way, time and following error of the move, in counts of the encoder."""
    stage, count = run.scene.stage("move"), count_turns(drive)
    part = slice(stage.first, stage.end)
    position, error = run["shaft_position"][part], run["position_error"][part] / count
    period = run.t[1] - run.t[0]
    outside = np.flatnonzero(np.abs(position - position[-1]) > 2.0 * count)
    return {
        "way_of_the_move": of_stage(run, stage, (position[-1] - position[0]) * 360.0, "degrees"),
        "time_of_the_move": of_stage(run, stage, (outside[-1] + 1) * period * 1e3 if len(outside) else 0.0, "ms"),
        "largest_speed": of_stage(run, stage, np.abs(run["true_omega_m"][part]).max() * 60.0 / TURN_RAD, "rpm"),
        "following_error_largest": of_stage(run, stage, np.abs(error).max(), "counts"),
        "following_error_rms": of_stage(run, stage, np.sqrt(np.mean(error**2)), "counts"),
        "position_error_at_the_end": of_stage(
            run, stage, np.mean(run["position_error"][tail(stage)]) / count, "counts"
        ),
    }
