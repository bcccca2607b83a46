# SPDX-License-Identifier: BSD-3-Clause
"""Step responses of both loops with the final registers, for who watches.

Snapshots are no consecutive samples, so the step of the current is made several times, of either sign in turn, and the
snapshots stand in the order of their time after the step.  A write acts from the next sample on, and a snapshot shows
the last one: on a board the time is known to a sample.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fluxproof.commission.motion import arrive, top_speed
from fluxproof.commission.session import Refusal, Session, Step
from fluxproof.cosim.step_response import LOOPS, Curve, Situation, told
from golden_model.drive import Drive
from golden_model.scaling import speed_gains
from golden_model.units import TURN_RAD, to_si

CURRENT_OF_LIMIT, REPEATS = 0.3, 8
TIME_CONSTANTS = 20.0  # of a loop, which its response lasts
OF_TOP = 0.25  # the speed before a step, and the largest step, of the speed that commissioning reaches
SPEED_OF_LIMIT = 0.4  # of the current limit: what the gain of the speed loop may ask for at a step
REST_S, ROWS = 0.02, 400


def step_responses(session: Session, found: Drive) -> Step:
    """Both loops of the drive ``found``; where it trips the step says so, and the commissioning goes on."""
    s, drive = session, replace(found, core=session.drive.core)
    s.progress("step responses")
    s.release()
    s.load_final()
    s.settle(0.1)  # the core looks at the sensors' zero again
    made, said = [], []
    try:
        made.append(current_response(s, drive))
        if drive.control.speed_bandwidth_hz is not None:
            made.append(speed_response(s, drive))
    except Refusal as refusal:
        said, warned = [str(refusal)], {"warned": True}
    else:
        warned = {}
    finally:
        s.gates_off()
    rpm = 30.0 / math.pi / drive.machine.pole_pairs
    for at, curve in made:
        scale, unit = (rpm, "rpm") if at.loop.speed_mode else (1.0, "A")
        rise, over = told(curve, at.before, at.after)
        said.append(
            f"{at.loop.name} {scale * at.before:.4g} to {scale * at.after:.4g} {unit} in {rise}, overshoot {over}"
        )
    return Step("step responses", {}, "; ".join(said), warned, tuple((drive, at, curve) for at, curve in made))


def current_response(s: Session, drive: Drive) -> tuple[Situation, Curve]:
    """Steps of i_q from zero near standstill."""
    size, m = CURRENT_OF_LIMIT * s.limit, drive.machine
    per_s = 1.5 * m.pole_pairs**2 * m.magnet_flux_wb / m.inertia_kgm2 * size
    seconds = min(TIME_CONSTANTS / TURN_RAD / drive.control.current_bandwidth_hz, OF_TOP * top_speed(s) / per_s)
    s.bus.write("speed_mode", 0)
    s.set(i_d_ref=0.0, i_q_ext=0.0)
    s.gates_on()
    times, values = [], []
    for n in range(REPEATS):
        sign = 1.0 if n % 2 == 0 else -1.0
        s.settle(REST_S)
        s.set(i_q_ext=sign * size)
        rows = _rows(s, seconds, "i_q")
        s.set(i_q_ext=0.0)
        times += [time for time, _ in rows]
        values += [sign * value for _, value in rows]
    order, row = np.argsort(times, kind="stable"), s.snapshot()
    s.gates_off()
    curve = Curve(np.array(times)[order], np.array(values)[order])
    return _situation(s, LOOPS[0], (0.0, size), curve, row, 0.0), curve


def speed_response(s: Session, drive: Drive) -> tuple[Situation, Curve]:
    """One step of the speed within the current limit."""
    m, top = drive.machine, top_speed(s)
    kp = speed_gains(drive)[0]
    before = OF_TOP * top
    after = before + min(OF_TOP * top, SPEED_OF_LIMIT * s.limit / kp)
    per_s = 1.5 * m.pole_pairs**2 * m.magnet_flux_wb / m.inertia_kgm2 * SPEED_OF_LIMIT * s.limit
    s.bus.write("speed_mode", 1)
    s.gates_on()
    ramp_s = max(0.2, before / per_s)
    s.ramp(ramp_s, 40, omega_ref=(0.0, before))
    arrive(s, before)
    held = s.look(50)
    s.set(omega_ref=after)
    seconds = TIME_CONSTANTS / TURN_RAD / float(drive.control.speed_bandwidth_hz or 1.0) + (after - before) / per_s
    rows = _rows(s, seconds, "omega_me")
    row = s.snapshot()
    s.ramp(2.0 * ramp_s, 40, omega_ref=(after, 0.0))
    curve = Curve(*(np.array(column) for column in zip(*rows, strict=True)))
    return _situation(s, LOOPS[1], (before, after), curve, row, float(held.i_q.mean())), curve


def _rows(s: Session, seconds: float, name: str) -> list[tuple[float, float]]:
    """(time from the step [s], value) of snapshots; the reference was written just now."""
    began, rows = s.bus.now(), []
    while not rows or rows[-1][0] < seconds:
        row = s.snapshot()
        rows.append((s.bus.now() - began - s.t_s, float(to_si(name, row[name], s.drive))))
        if seconds > ROWS * 3.0 * s.t_s:
            s.pause(seconds / ROWS)
    return rows


def _situation(s: Session, loop, ends: tuple[float, float], curve: Curve, row: dict, i_q: float) -> Situation:
    samples = math.ceil(curve.time[-1] / s.t_s) + 1
    omega = np.full(samples, ends[0] if loop.speed_mode else 0.0)
    u_dc, theta = (float(to_si(name, row[name], s.drive)) for name in ("u_dc", "theta_me"))
    return Situation(loop, *ends, omega, 0.0, i_q, u_dc, theta, s.bus.read("v_comp"))
