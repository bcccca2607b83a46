# SPDX-License-Identifier: BSD-3-Clause
"""Operating points as a recording: every row is one steady point, with or without a time.

Without a time, rows are consecutive samples of a fast log or points of a table.  A table has no angle and no phase
quantities that need one, and its rows jump: current or speed change by more than any drive could between two samples.
A locked rotor without a time or a stated sample time is a table too.
With a time, rows half a second apart or more are points that were held one after another, unless the log holds values
until the next message: then voltage and current do not change in the same row.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.machine import steady_voltage
from fluxproof.diagnosis.ground.recording import Problem, Recording

LEAST_ROWS = 400  # a fast log needs more rows (checks/enough.py)
STEP_S = 0.5  # of the time: a slower log has no rows between two operating points
SPEED_STEP = 0.05  # of the largest speed, within a sample time
JUMPS = 0.02  # share of the rows that no fast log exceeds, even if it is made of many pieces
LARGE = 0.05  # of the largest voltage: a change of the operating point
MOSTLY = 0.7  # share of the changes
HELD = 1.5  # rows: a signal that is constant for longer is a message that was held


def is_table(columns: dict, nominal) -> bool:
    """Whether rows without a time are operating points; columns: canonical arrays (n,)."""
    if not {"i_d", "i_q", "omega_e", "u_q_ref"} <= set(columns) or {"d_a", "d_b", "d_c"} <= set(columns):
        return False
    n = len(columns["i_q"])
    if n < LEAST_ROWS or _rests_at_no_time(columns, nominal):
        return True
    m, bus = nominal.machine, nominal.inverter.dc_bus_v
    reach = bus * nominal.sample_time_s / min(m.inductance_d_h, m.inductance_q_h)
    current = np.abs(np.diff(columns["i_d"] + 1j * columns["i_q"]))
    speed = np.abs(np.diff(columns["omega_e"]))
    top = SPEED_STEP * np.nanmax(np.abs(columns["omega_e"]))
    return bool(np.mean((current > max(reach, 0.02 * m.rated_current_a)) | (speed > max(top, 1e-9))) > JUMPS)


def _rests_at_no_time(columns, nominal) -> bool:
    """Whether the rows of a rotor at rest cannot be placed in time, as nothing states how far apart they are."""
    rests = not np.any(columns["omega_e"]) and np.ptp(columns.get("theta_e", np.zeros(1))) == 0.0
    return rests and nominal.control.sample_time_s is None


def as_table(path, columns: dict, meta: dict, problems, lacks=frozenset()) -> Recording:
    """The Recording of a table; ``t`` is the number of the row; lacks: what else it does not show."""
    n = len(columns["i_q"])
    meta["notes"].append(
        f"no time column, and the rows do not follow each other: each of the {n} rows is one operating point; a drift "
        "over time cannot be diagnosed from them"
    )
    lacks = lacks | {"harmonics", "samples", "time"}
    recording = Recording(str(path), columns | {"t": np.arange(n, dtype=float)}, np.ones(n, bool), np.zeros(n, bool),
                          slow=True, points=True, lacks=lacks, meta=meta)  # fmt: skip
    recording.problems += problems
    return recording


def held_one_after_another(recording, usual: float, nominal) -> bool:
    """Whether the rows of a log, ``usual`` [s] apart, are operating points: no message is held over several rows."""
    if usual < STEP_S or recording.has("d_a", "d_b", "d_c"):
        return False
    signals = [recording[n] for n in ("i_d", "i_q", "u_d_ref", "u_q_ref") if n in recording.columns]
    moving = [x for x in signals if np.ptp(x) > 1e-3 * np.abs(x).max()]
    return all(np.mean(np.diff(x) != 0) > 1.0 / HELD for x in moving) or _together(recording, nominal)


def _together(recording, nominal) -> bool:
    """Whether the voltage changes in the rows in which current and speed do, by about what the nominal drive needs."""
    if not recording.has("i_d", "i_q", "u_q_ref", "omega_e"):
        return False
    r = recording
    i, u = r["i_d"] + 1j * r["i_q"], r["u_q_ref"]
    needed = steady_voltage(nominal.machine, i, r["omega_e"]).imag
    steps, seen = np.diff(needed), np.diff(u)
    large = (np.abs(steps) > LARGE * np.abs(u).max()) | (np.abs(seen) > LARGE * np.abs(u).max())
    return not large.any() or bool(np.mean(np.abs(seen - steps)[large] < 0.5 * np.abs(steps)[large]) > MOSTLY)


def mark_points(recording, usual: float, period: float) -> None:
    """Mark the rows of a slow log as operating points, with a finding."""
    recording.slow = recording.points = True
    recording.lacks |= {"harmonics", "samples"}
    message = f"a row every {usual:g} s, the control samples every {period:g} s: every row is one operating point"
    action = "each must be steady"
    recording.problems.append(Problem("slow_sampling", message, "t", 0, len(recording), action))
