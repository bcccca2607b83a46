# SPDX-License-Identifier: BSD-3-Clause
"""Rows that are operating points, as stretches; rows of a long operating point are averaged.

If most rows of a log resemble a neighbour, the others are transients and are left out.

At standstill the inverter loss depends on the angle of the rotor.  A row with current at an unknown angle is not used.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.slow_columns import known_angle, known_voltage, operating_columns, torque_at_shaft
from fluxproof.diagnosis.balance.slow_stretches import AT_REST, STANDING, STILL, Stretches
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.machine import steady_voltage
from fluxproof.diagnosis.ground.nominal import flux_level
from fluxproof.diagnosis.ground.recording import RecordingError

MEANS = 64  # number of means of a long operating point, fine enough for its drift
SAME_SPEED = 0.02  # relative
NO_LOSS = 0.005  # of rated current: a smaller one has no loss that could be noticed
STANDSTILL = 1e-3  # of the speed at which the EMF takes the bus voltage


def point_rows(recording, nominal) -> Stretches:
    """The operating points of a recording with one row each; adjacent rows at the same point are joined to means.

    Raises RecordingError if no row can be used.
    """
    r, m = recording, nominal.machine
    i, u, omega, u_dc = operating_columns(recording, nominal)
    nominal_u = steady_voltage(m, i, omega)
    u, both_axes = known_voltage(u, nominal_u)
    good = r.usable & np.isfinite(u) & np.isfinite(nominal_u)
    at_rest = np.abs(omega) < STANDSTILL * nominal.inverter.dc_bus_v / flux_level(m)
    rest = np.where(at_rest, known_angle(recording), np.nan)
    lost = good & at_rest & ~np.isfinite(rest) & (np.abs(i) > NO_LOSS * m.rated_current_a)
    good &= ~lost
    if "time" not in r.lacks:
        good &= _verified(omega, nominal_u, u, good)
    if not good.any() or (lost.any() and np.abs(i[good]).max() < NO_LOSS * m.rated_current_a):
        raise RecordingError(f"{r.source}: no row with current can be used{STANDING if lost.any() else ''}")
    notes = (f"{int(lost.sum())} rows at standstill are not used{STANDING}",) if lost.any() else ()
    t = np.zeros(len(r)) if "time" in r.lacks else r["t"] - r["t"][0]
    temp = r["temp_winding"] if r.has("temp_winding") else np.full(len(t), np.nan)
    groups = _groups(t, (omega, nominal_u, u), good, float(t[-1]) / MEANS)
    first, end = np.array([g[0] for g in groups]), np.array([g[-1] + 1 for g in groups])
    torque = torque_at_shaft(r, nominal, i, omega)
    i, u, omega, u_dc, temp, t, torque = (
        np.array([np.mean(x[g]) for g in groups]) for x in (i, u, omega, u_dc, temp, t, torque)
    )
    unsteady = np.zeros(len(groups))
    return Stretches(i, u, omega, u_dc, temp, t, first, end, unsteady, rest[first], 0.0, both_axes, notes, torque)


def block_points(recording, nominal, catalogue: dict | None = None) -> Stretches:
    """The steady blocks of a recording with a row per control period, as operating points.

    Neighbours are averaged until they cover an electrical turn, over which the loss of the inverter is a mean there.
    Raises RecordingError if there is no steady block.
    """
    view = view_of(recording, nominal, catalogue)
    u, i, omega = view.to_dq(view.u[:, 1:-1]).mean(axis=1), view.i.mean(axis=1), view.omega.mean(axis=1)
    span = np.abs(view.theta[:, -1] - view.theta[:, 0])
    rest = np.where(span < AT_REST, view.theta[:, 0], np.nan)
    turns = whole_turns(view.run, np.where(np.isfinite(rest), 2.0 * np.pi, span))
    i, u, omega, u_dc, temp, t = (
        np.array([np.mean(x[g]) for g in turns]) for x in (i, u, omega, view.u_dc.mean(axis=1), view.temp, view.t)
    )
    first, end = np.array([view.rows[g[0]] for g in turns]), np.array([view.rows[g[-1]] for g in turns])
    unsteady, rest = np.zeros(len(turns)), np.array([rest[g[0]] for g in turns])
    return Stretches(i, u, omega, u_dc, temp, t, first, end + view.u_dc.shape[1], unsteady, rest, 0.0)


def whole_turns(run, span) -> list[np.ndarray]:
    """Groups of neighbouring blocks of a dwell that cover a turn together; every block alone if none do.

    run: (b,) number of the dwell; span: (b,) angle that each block covers [rad].
    """
    groups, start, covered = [], 0, 0.0
    for n in range(len(run)):
        if run[n] != run[start]:
            start, covered = n, 0.0
        covered += span[n]
        if covered >= 2.0 * np.pi * k.WHOLE_TURN:
            groups.append(np.arange(start, n + 1))
            start, covered = min(n + 1, len(run) - 1), 0.0
    return groups or [np.array([n]) for n in range(len(run))]


def _verified(omega, nominal_u, u, good) -> np.ndarray:
    """(n,) bool: rows that resemble a neighbour, and are thus steady; all rows if most points have one row only."""
    if np.count_nonzero(good) < 2:
        return np.ones(len(good), bool)
    limit = _limit(nominal_u, u, good)
    step = np.maximum(np.abs(np.diff(nominal_u)), np.abs(np.diff(u)))
    same = (step < limit) & (np.abs(np.diff(omega)) <= SAME_SPEED * np.abs(omega[1:])) & good[1:] & good[:-1]
    beside = np.append(same, False) | np.append(False, same)
    return beside if np.mean(beside[good]) > 0.5 else np.ones(len(good), bool)


def _limit(nominal_u, u, good) -> float:
    """Change of the voltage [V] up to which it is steady."""
    return STILL * max(float(np.abs(nominal_u[good]).max()), float(np.abs(u[good]).max()), 1e-9)


def _groups(t, signals, good, span) -> list[np.ndarray]:
    """Consecutive rows at one operating point, within ``span`` [s], as arrays of row numbers."""
    omega, nominal_u, u = signals
    limit = _limit(nominal_u, u, good)
    out, begin = [], None
    for n in np.flatnonzero(good):
        near = begin is not None and t[n] - t[begin] < span
        near = near and abs(omega[n] - omega[begin]) <= SAME_SPEED * abs(omega[begin])
        if near and max(abs(nominal_u[n] - nominal_u[begin]), abs(u[n] - u[begin])) < limit:
            out[-1].append(n)
        else:
            out.append([n])
            begin = n
    return [np.array(g) for g in out]
