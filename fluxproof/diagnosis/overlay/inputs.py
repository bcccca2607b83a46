# SPDX-License-Identifier: BSD-3-Clause
"""Inputs of the overlay simulation: stretches of a recording with the signals that drive the simulation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fluxproof.diagnosis.ground.nominal import Nominal
from fluxproof.diagnosis.ground.recording import Recording, RecordingError
from fluxproof.plant.transforms import space_vector

MOST_ROWS = 20_000  # simulated rows
WINDOW_ROWS = 2_000
LEAST_ROWS = 400  # a shorter stretch would consist of the run-in only
SETTLING_ROWS = 300  # per operating point of a slow recording; the last third is evaluated
SMOOTH_ROWS = 41  # window for angle and references: removes quantisation and keeps the motion of shaft and load


class Stretch(NamedTuple):
    """n rows that are simulated together; ``rows`` (n,) are indices in the recording, all equal in a slow one."""

    rows: np.ndarray
    theta: np.ndarray  # (n + 1,) electrical, unwrapped [rad]
    omega: np.ndarray  # [rad/s]
    i_ref: np.ndarray  # (n, 2) [A]
    u_dc: np.ndarray  # [V]
    temperature: np.ndarray  # [deg C], NaN where unknown


def dq_currents(recording: Recording) -> np.ndarray:
    """(n, 2) measured dq currents [A]; RecordingError if the recording has none."""
    if recording.has("i_d", "i_q"):
        return np.stack([recording["i_d"], recording["i_q"]], axis=1)
    if recording.has("i_a", "i_b", "i_c", "theta_e"):
        return dq(*(recording[f"i_{x}"] for x in "abc"), theta=recording["theta_e"])
    raise RecordingError(f"{recording.source}: i_d, i_q or i_a, i_b, i_c with theta_e are needed to simulate it")


def dq(a, b, c, theta) -> np.ndarray:
    """(n, 2) dq values of three phase values, amplitude-invariant Clarke, d axis at theta."""
    x = space_vector(np.stack([a, b, c], axis=1)) * np.exp(-1j * theta)
    return np.stack([x.real, x.imag], axis=1)


def stretches(recording: Recording, nominal: Nominal) -> list[Stretch]:
    """At most MOST_ROWS representative rows; RecordingError names missing columns."""
    currents, t_s = dq_currents(recording), nominal.sample_time_s
    if not recording.has("omega_e") and not recording.has("theta_e"):
        raise RecordingError(f"{recording.source}: theta_e or omega_e is needed to simulate it")
    if recording.slow:
        if not recording.has("omega_e"):
            raise RecordingError(f"{recording.source}: a slow recording needs omega_e to be simulated")
        return _points(recording, nominal, currents, t_s)
    found = []
    for start, stop in _windows(recording):
        part = slice(start, stop)
        theta = _angle(recording, part, t_s)
        i_ref = np.stack([_reference(recording, part, currents, k) for k in (0, 1)], axis=1)
        rows = np.arange(start, stop)
        found.append(Stretch(rows, theta, np.diff(theta) / t_s, i_ref, *_slow(recording, nominal, rows)))
    if not found:
        raise RecordingError(f"{recording.source}: no {LEAST_ROWS} consecutive rows without a gap")
    return found


def _windows(recording):
    """(start, stop) of stretches without gaps, evenly reduced to MOST_ROWS rows."""
    ends = np.flatnonzero(~recording.joined) + 1
    runs = list(zip([0, *ends[:-1]], ends, strict=True))
    pieces = []
    for start, stop in runs:
        count = max(1, (stop - start) // WINDOW_ROWS)
        edges = np.linspace(start, stop, count + 1).astype(int)
        pieces += [(int(a), int(b)) for a, b in zip(edges[:-1], edges[1:], strict=True) if b - a >= LEAST_ROWS]
    pieces = [(a, b) for a, b in pieces if recording.usable[a:b].mean() > 0.9]
    keep = max(1, MOST_ROWS // WINDOW_ROWS)
    if sum(b - a for a, b in pieces) > MOST_ROWS:
        pieces = [pieces[k] for k in np.unique(np.linspace(0, len(pieces) - 1, keep).astype(int))]
    return pieces


def _angle(recording, part, t_s):
    """(n + 1,) smoothed angle of the rows and the following one; integrated if only the speed is recorded."""
    if recording.has("theta_e"):
        theta = smooth(filled(np.unwrap(filled(recording["theta_e"][part]))))
    else:
        theta = np.concatenate(([0.0], np.cumsum(smooth(filled(recording["omega_e"][part]))[:-1] * t_s)))
    return np.append(theta, 2.0 * theta[-1] - theta[-2])


def _reference(recording, part, currents, k):
    """The recorded current reference, or else the smoothed currents."""
    name = ("i_d_ref", "i_q_ref")[k]
    return filled(recording[name][part]) if recording.has(name) else smooth(filled(currents[part, k]))


def filled(values: np.ndarray) -> np.ndarray:
    """Replace values that are not finite by the last finite one, as a controller would; zero if there is none."""
    good = np.isfinite(values)
    if good.all():
        return values
    last = np.maximum.accumulate(np.where(good, np.arange(len(values)), 0))
    return np.nan_to_num(values[np.maximum(last, int(np.argmax(good)))])


def smooth(values: np.ndarray) -> np.ndarray:
    """Local parabola over SMOOTH_ROWS rows around each row, or at that end; shorter columns are unchanged."""
    if len(values) < SMOOTH_ROWS:
        return values
    half = SMOOTH_ROWS // 2
    basis, _ = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, SMOOTH_ROWS), 3))
    local = basis @ basis.T  # the values of a parabola at all rows of a window
    first, last = local @ values[:SMOOTH_ROWS], local @ values[-SMOOTH_ROWS:]
    return np.concatenate([first[:half], np.correlate(values, local[half], "valid"), last[half + 1 :]])


def _slow(recording, nominal, rows):
    """Bus voltage and temperature of rows."""
    count = len(rows)
    u_dc = filled(recording["u_dc"][rows]) if recording.has("u_dc") else np.full(count, nominal.inverter.dc_bus_v)
    hot = recording["temp_winding"][rows] if recording.has("temp_winding") else np.full(count, np.nan)
    return u_dc, hot


def _points(recording, nominal, currents, t_s):
    """Operating points of a slow recording, each held until the current loop has settled."""
    rows = np.flatnonzero(recording.usable & np.isfinite(currents).all(axis=1) & np.isfinite(recording["omega_e"]))
    if not len(rows):
        raise RecordingError(f"{recording.source}: no usable row to simulate")
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, MOST_ROWS // SETTLING_ROWS).astype(int))] if len(rows) else rows
    found = []
    for row in rows:
        at = np.full(SETTLING_ROWS, row)
        omega = recording["omega_e"][at]
        theta = np.concatenate(([0.0], np.cumsum(omega) * t_s))
        refs = [recording[n][at] if recording.has(n) else currents[at, k] for k, n in enumerate(("i_d_ref", "i_q_ref"))]
        found.append(Stretch(at, theta, omega, np.stack(refs, axis=1), *_slow(recording, nominal, at)))
    return found
