# SPDX-License-Identifier: BSD-3-Clause
"""EMF runs: terminal voltages of a driven machine without current (gates off), as rows of a control period.

An oscilloscope or a logger records three voltages against any common point, or two line-to-line voltages, at its own
rate.  Of fewer voltages, or fewer than LEAST_PER_TURN samples of a turn, ingest/emf_probe.py makes three dense ones.
Without current they are the EMF, the derivative of the magnets' flux linkage.  The mean voltage of every control period
follows from the integral of the samples, so that the balance is the same as for a running drive, with the measured
voltage in place of duties times bus voltage and a current of zero.

The angle, if it was not recorded, is that of the fundamental: its phase, averaged over one electrical turn, in which
harmonics cancel, less what a changing speed adds to that mean.  An angle error cannot be seen then.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import Problem, Recording, RecordingError
from fluxproof.diagnosis.ingest.demand import LINE_VOLTAGES, PHASE_VOLTAGES, has_terminal_voltages
from fluxproof.diagnosis.ingest.emf_probe import from_fit, probed
from fluxproof.plant.transforms import AXES, phase_values, space_vector

LEAST_PER_TURN = 10.0  # samples of an electrical turn that are integrated as they are
GAP = 1.5  # times the usual step of the time
LEAST_ROWS = 20  # of a stretch
LEAST_VOLTAGE = 0.05  # of the largest one: at a lower speed the fundamental's phase is noise
NO_CURRENT = 0.02  # of rated current
SLOW = ("temp_winding", "torque")  # further columns that are used
LACKS = frozenset({"inverter", "current"})


def emf_rows(path, columns: dict, nominal, meta: dict) -> Recording:
    """The recording of an EMF run; columns: canonical arrays (n,) at the rate of the instrument.

    Its rows are one control period apart; ``u_a u_b u_c`` are the means of the period that begins with the row.
    Raises RecordingError without a time, with currents, or with too few samples of an electrical turn.
    """
    t = _time(path, columns)
    _without_current(path, columns, nominal)
    for name in probed(columns):
        if not np.isfinite(columns[name]).all():
            row = int(np.argmin(np.isfinite(columns[name])))
            raise RecordingError(f"{path}: row {row}: the terminal voltage {name} must be a number")
    recorded, (columns, windows) = columns, _dense(path, columns)
    t, v = columns["t"], _space_vector(columns)
    problems = []
    if "theta_e" not in columns:
        v = _turning_as_recorded(v, t, columns, problems)
    period = nominal.sample_time_s
    parts = [_resampled(t[a:b], v[a:b], period) for a, b in _pieces(t)]
    parts = [part for part in parts if part is not None]
    if not parts:
        raise RecordingError(f"{path}: no part without a gap is longer than {4 * period:g} s")
    rows = [known for at, u in parts for known in _known(_rows(at, u, columns, t, nominal))]
    if not rows:
        raise RecordingError(f"{path}: no part without a gap contains a whole electrical turn: record longer")
    count = [len(r["t"]) for r in rows]
    arrays = {name: np.concatenate([r[name] for r in rows]) for name in rows[0]}
    usable = np.abs(_space_vector(arrays)) > LEAST_VOLTAGE * np.abs(v).max()
    joined = np.ones(len(usable), bool)
    joined[np.cumsum(count) - 1] = False
    lacks = LACKS if "theta_e" in columns else LACKS | {"angle"}
    meta["notes"] += _notes(recorded, columns is not recorded, period)
    if len(windows):
        meta["windows"] = windows
    if len(count) > 1:
        meta["run"] = np.repeat(np.arange(len(count)), count)
    return Recording(str(path), arrays, usable, joined, lacks=lacks, problems=problems, meta=meta)


def _time(path, columns) -> np.ndarray:
    if "t" not in columns:
        raise RecordingError(
            f"{path}: terminal voltages need a time column t; as the instrument does not sample with the control"
        )
    t = columns["t"]
    if len(t) < 4 or not np.isfinite(t).all() or not (np.diff(t) > 0).all():
        row = int(np.argmax(~(np.diff(t) > 0))) + 1 if len(t) >= 4 else 0
        raise RecordingError(f"{path}: row {row}: the time of terminal voltages must rise from row to row")
    return t


def _without_current(path, columns, nominal) -> None:
    limit = NO_CURRENT * nominal.machine.rated_current_a
    for name in ("i_a", "i_b", "i_c", "i_d", "i_q"):
        if name in columns:
            rms = float(np.sqrt(np.nanmean(np.square(columns[name]))))
            if rms > limit:
                raise RecordingError(
                    f"{path}: column {name} is {rms:.3g} A rms, but terminal voltages are used without current only "
                    f"(gates off, below {limit:.2g} A); with current record duties d_a, d_b, d_c or u_d_ref, u_q_ref"
                )


def _space_vector(columns) -> np.ndarray:
    """Complex voltage (n,) [V], amplitude-invariant; a common point of the three voltages cancels."""
    if all(name in columns for name in PHASE_VOLTAGES):
        return space_vector(np.stack([columns[name] for name in PHASE_VOLTAGES], axis=1))
    ab, bc, ca = (columns.get(name) for name in LINE_VOLTAGES)
    ab = -bc - ca if ab is None else ab
    bc = -ab - ca if bc is None else bc
    return (2 / 3) * (ab - bc * AXES[2])  # u_a + a u_b + a^2 u_c with u_b = u_a - ab, u_c = u_b - bc


def _speed_of(v, t) -> float:
    """Mean speed of the voltage over the usable rows [rad/s], weighted with its size."""
    turned = np.angle(v[1:] * np.conj(v[:-1])) / np.diff(t)
    weight = np.abs(v[1:] * v[:-1])
    return float(np.sum(turned * weight) / max(np.sum(weight), 1e-30))


def _turning_as_recorded(v, t, columns, problems):
    """The voltage, with two phases exchanged if it turns against the recorded speed."""
    if "omega_e" not in columns:
        return v
    usual, here = float(np.median(columns["omega_e"])), _speed_of(v, t)
    if usual * here >= 0.0:
        return v
    message = f"the voltages turn at {here:.4g} rad/s, the recorded speed is {usual:.4g} rad/s: the phase order differs"
    problems.append(Problem("swapped_phases", message, "u_b", 0, len(t), "u_b and u_c are exchanged"))
    return np.conj(v)


def _dense(path, columns) -> tuple[dict, np.ndarray]:
    """The columns as they are, or with voltages from fits of windows where a voltage or samples are too few.

    With the times at which the windows begin, none of columns as they are.
    """
    if has_terminal_voltages(columns) and _per_turn(_space_vector(columns)) >= LEAST_PER_TURN:
        return columns, np.zeros(0)
    return from_fit(path, columns, _pieces(columns["t"]))


def _per_turn(v) -> float:
    """Samples of an electrical turn of the voltage (n,) complex."""
    large = np.abs(v) > 0.5 * np.abs(v).max()
    turned = np.abs(np.angle(v[1:] * np.conj(v[:-1])))[large[1:] & large[:-1]]
    return 2 * np.pi / max(float(np.median(turned)) if len(turned) else np.pi, 1e-9)


def _pieces(t):
    """(begin, end) of the parts without a gap."""
    step = np.diff(t)
    ends = [*(np.flatnonzero(step > GAP * np.median(step)) + 1), len(t)]
    return [(a, b) for a, b in zip([0, *ends[:-1]], ends, strict=True) if b - a >= 4]


def _resampled(t, v, period):
    """(instants (m,), mean voltage (m,) complex of the periods that begin with them); None if too short."""
    from scipy.interpolate import CubicSpline  # takes a part of a second, and few recordings are EMF runs

    count = int(np.floor((t[-1] - t[0]) / period * (1.0 + 1e-12)))
    if count < 4:
        return None
    at = t[0] + period * np.arange(count + 1)
    at[-1] = min(at[-1], t[-1])
    parts = [CubicSpline(t, x).antiderivative()(at) for x in (v.real, v.imag)]
    return at[:-1], (np.diff(parts[0]) + 1j * np.diff(parts[1])) / period


def _rows(at, u, columns, t, nominal) -> dict:
    """Canonical arrays of a part; theta_e is nan at the ends if it is that of the fundamental."""
    legs = phase_values(u)
    out = {"t": at, "i_d": np.zeros(len(at)), "i_q": np.zeros(len(at))}
    out |= {name: legs[:, k] for k, name in enumerate(PHASE_VOLTAGES)}
    if "theta_e" in columns:
        out["theta_e"] = np.interp(at, t, np.unwrap(columns["theta_e"]))
    else:
        out["theta_e"] = angle_of(u, nominal.sample_time_s)
    if "omega_e" in columns:
        out["omega_e"] = np.interp(at, t, columns["omega_e"])
    return out | {name: np.interp(at, t, columns[name]) for name in SLOW if name in columns}


def _known(rows: dict) -> list[dict]:
    """The stretches whose angle is known; what is between them was recorded, so that they are runs and no gaps."""
    inside = np.concatenate([[False], np.isfinite(rows["theta_e"]), [False]])
    begins, ends = np.flatnonzero(inside[1:] & ~inside[:-1]), np.flatnonzero(~inside[1:] & inside[:-1])
    # Noise of the speed lets single rows near an end have a whole turn around them.
    kept = [slice(a, b) for a, b in zip(begins, ends, strict=True) if b - a >= LEAST_ROWS]
    return [{name: values[part] for name, values in rows.items()} for part in kept]


def angle_of(u, period) -> np.ndarray:
    """Angle of the d axis (m,) [rad] at the beginning of each interval with the mean EMF u (m,) complex.

    nan at both ends and around a reversal, where no whole turn in one direction is around.
    """
    phase = np.unwrap(np.angle(u))
    speed = np.gradient(_over_turns(phase, np.full(len(phase), _rough_turn(phase))), period)
    known = np.isfinite(speed)
    if not known.any():
        return np.full(len(u), np.nan)
    speed = _filled(speed, known)
    turn = 2 * np.pi / np.maximum(np.abs(speed) * period, 2 * np.pi / len(u))
    mean = _over_turns(phase, turn)
    middle = mean - _bend(mean, turn) - 0.5 * np.pi * np.sign(speed)
    middle[np.abs(_over_turns(np.sign(speed), turn)) < 1.0 - 1e-9] = np.nan
    return np.append(np.nan, 0.5 * (middle[1:] + middle[:-1]))


def _bend(mean, turn) -> np.ndarray:
    """What a steady acceleration adds to the mean of an angle over ``turn`` rows: d2 theta / dk2 turn^2 / 24.

    A mean of the means differs from them by the same.
    """
    rows, known = np.arange(len(mean)), np.isfinite(mean)
    if not known.any():
        return np.zeros(len(mean))
    again = _over_turns(_filled(mean, known), turn) - mean
    whole = np.isfinite(again) & (_over_turns(known.astype(float), turn) > 1.0 - 1e-9)
    change = np.where(whole, again / turn**2, np.nan)
    # The least of three turns: about a step of the speed or the noise of a constant one there is nothing to subtract.
    three = np.array([np.interp(rows + turn * side, rows, change, left=np.nan, right=np.nan) for side in (-1, 0, 1)])
    known = np.isfinite(three).all(axis=0)
    if not known.any():
        return np.zeros(len(mean))
    least = np.where(np.ptp(np.sign(three), axis=0) == 0, np.abs(three).min(axis=0), 0.0) * np.sign(three[1])
    return _filled(least, known) * turn**2


def _filled(x, known) -> np.ndarray:
    """x (m,) with what is not known from the nearest that is."""
    return np.interp(np.arange(len(x)), np.flatnonzero(known), x[known])


def _rough_turn(phase) -> float:
    """Rows of an electrical turn at the mean speed."""
    return 2 * np.pi * len(phase) / max(float(np.sum(np.abs(np.diff(phase)))), 2 * np.pi)


def _over_turns(x, turn) -> np.ndarray:
    """Mean of x (m,) over ``turn`` (m,) rows around each row, with fractional ends; nan where these are outside."""
    m = len(x)
    edges = np.arange(m + 1) - 0.5  # a row stands for the interval around it
    total = np.append(0.0, np.cumsum(x))
    low, high = np.arange(m) - 0.5 * turn, np.arange(m) + 0.5 * turn
    mean = (np.interp(high, edges, total) - np.interp(low, edges, total)) / turn
    return np.where((low >= -0.5) & (high <= m - 0.5), mean, np.nan)


def _notes(columns, fitted: bool, period) -> list[str]:
    step = float(np.median(np.diff(columns["t"])))
    notes = [
        f"EMF run: terminal voltages, a sample every {step:.3g} s, as means over control "
        f"periods of {period:g} s; the current is zero, so resistance, inductances, inverter and current sensors "
        "cannot be diagnosed"
    ]
    if fitted:
        orders = "the fundamental and orders 5, 7, 11 and 13 are fitted to the samples of several turns"
        alike = "" if has_terminal_voltages(columns) else "; the phases that were not recorded are taken to be alike"
        notes.append(f"{orders}{alike}")
    if "theta_e" not in columns:
        notes.append("the angle is that of the fundamental of the voltages: an angle offset cannot be diagnosed")
    if "omega_e" not in columns:
        notes.append("the speed is that of the voltages: its scale is not checked against the pole pairs")
    return notes
