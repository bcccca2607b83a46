# SPDX-License-Identifier: BSD-3-Clause
"""Steady stretches of a slow log, for which a voltage balance can be made although samples are far apart.

The messages of a slow log (messages.py) are not synchronous, so that a row combines values of different instants.  This
is harmless in a steady state: over two messages of the slowest signal, nominal and recorded voltage are constant within
a small share of the largest voltage, every signal that is not at rest has been updated, and the rotor turns.  Changes
shortly before and after a stretch bound the error due to values of different age: ``unsteady``.

A rotor at rest is steady too, if its angle is known: the inverter loss depends on it.

A log that is seldom steady but has a new value in every row is cut into moving stretches (moving_stretches.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fluxproof.diagnosis.balance.messages import message_period, restless, updates
from fluxproof.diagnosis.balance.moving_stretches import moving_log, moving_stretches
from fluxproof.diagnosis.balance.slow_columns import known_angle, known_voltage, operating_columns, torque_at_shaft
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.machine import steady_voltage
from fluxproof.diagnosis.ground.recording import Recording, RecordingError

SIGNALS = ("i_d", "i_q", "u_d", "u_q", "omega")
STILL = 0.015  # of the largest voltage: largest change of nominal and recorded voltage
LEAST_S = (0.5, 0.2, 0.1, 0.05)  # the shorter ones only if the longer ones find too few operating points
ENOUGH = 8  # operating points
MESSAGES = 2.0  # number of messages of the slowest signal in a stretch
AROUND, LOOSE = 0.5, 8.0  # margin before and after a window, as a share of it; factor of the change allowed there
FEW_TURNS = 1.5  # the same in a log without messages, whose stretches are shorter
TURNS = 4.0  # electrical turns within a stretch: the inverter loss depends on the angle, its mean over turns does not
CONTROL = 2e-3  # s: a control samples as often
MESSAGE_ROWS = 3.0  # rows; a signal that changes as often has no messages
PARTS = 4  # of a stretch without messages
NOISE = 3.0  # standard deviations: usual range of PARTS means
SELDOM = 0.4  # share of the rows in steady stretches of a log that is seldom steady
AT_REST = 0.05  # rad within a stretch: the rotor does not turn


@dataclass
class Stretches:
    """Means over each stretch, all (b,): dq current and voltage complex [A], [V], electrical speed [rad/s],
    bus [V], winding [degC] or nan, time of the middle since the first row [s], first row and end (exclusive), and the
    change of the voltage from shortly before to shortly after the stretch [V].  rest: angle of a rotor at rest [rad],
    nan if it turns; both_axes: whether u_d is known, otherwise it is that of the nominal drive; torque: measured at the
    shaft [Nm], None or nan without a transducer; aged: (b, 2) error that the ages of current and speed leave in common
    [V], None where no age was fitted."""

    i: Complex
    u: Complex
    omega: np.ndarray
    u_dc: np.ndarray
    temp: np.ndarray
    t: np.ndarray
    first: np.ndarray
    end: np.ndarray
    unsteady: np.ndarray
    rest: np.ndarray
    window_s: float
    both_axes: bool = True
    notes: tuple[str, ...] = ()
    torque: np.ndarray | None = None
    aged: Complex | None = None

    def __len__(self):
        return len(self.t)

    def averaged(self, most: int):
        """At most ``most`` stretches: means over consecutive ones."""
        if len(self) <= most:
            return self
        parts = np.array_split(np.arange(len(self)), most)
        names = ("i", "u", "omega", "u_dc", "temp", "t")
        names += tuple(name for name in ("torque", "aged") if getattr(self, name) is not None)
        mean = {name: np.array([getattr(self, name)[k].mean(axis=0) for k in parts]) for name in names}
        largest = np.array([self.unsteady[k].max() for k in parts])
        begin, last = (np.array([k[edge] for k in parts]) for edge in (0, -1))
        return replace(
            self, **mean, first=self.first[begin], end=self.end[last], unsteady=largest, rest=self.rest[begin]
        )


def stretches(recording: Recording, nominal) -> Stretches:
    """The steady stretches of a slow recording, without overlap.

    Raises RecordingError if signals are missing or no stretch is steady.
    """
    refused, best = None, None
    for least_s in LEAST_S:
        try:
            found = stretches_of(recording, nominal, least_s)
        except RecordingError as error:
            refused = refused or error
            continue
        points = _operating_points(found, nominal)
        if best is None or points > best[0]:
            best = points, found
        if points >= ENOUGH:
            break
    if best is None or np.sum(best[1].end - best[1].first) < SELDOM * len(recording):
        moving = stretches_in_motion(recording, nominal)
        if moving is not None:
            return moving
    if best is None:
        raise refused or RecordingError(f"{recording.source}: no steady stretch")
    return best[1]


def stretches_in_motion(recording, nominal) -> Stretches | None:
    """The stretches of a log that is seldom steady; None if its rows hold messages or do not balance in motion."""
    r = recording
    i, u, omega, u_dc = operating_columns(r, nominal)
    t = r["t"] - r["t"][0]
    longest = max(message_period(t, x) for x in (i.real, i.imag, u.real, u.imag, omega))
    if longest >= MESSAGE_ROWS * np.median(np.diff(t)):
        return None
    nominal_u = steady_voltage(nominal.machine, i, omega)
    u, both_axes = known_voltage(u, nominal_u)
    log = moving_log(t, i, u, omega, r.usable & np.isfinite(nominal_u) & np.isfinite(u), nominal.machine, both_axes)
    if log is None:
        return None
    rated, top_u = nominal.machine.rated_current_a, max(np.nanmax(np.abs(nominal_u)), np.nanmax(np.abs(u)), 1e-9)
    tries = ((least_s, moving_stretches(log, least_s, FEW_TURNS, rated, top_u)) for least_s in LEAST_S)
    least_s, found = next(((s, parts) for s, parts in tries if len(parts) >= ENOUGH), (0.0, []))
    if not found:
        return None
    first, end, unsteady = (np.array(x) for x in zip(*found, strict=True))
    mean = lambda x: np.array([np.mean(x[a:b]) for a, b, _ in found])  # noqa: E731
    current, speed = mean(log.i), mean(log.omega)
    beyond = mean(log.nominal_u) - steady_voltage(nominal.machine, current, speed)
    temp = r["temp_winding"] if r.has("temp_winding") else np.full(len(t), np.nan)
    return Stretches(
        current, mean(u) - beyond, speed, mean(u_dc), mean(temp), mean(t), first, end, unsteady,
        np.full(len(first), np.nan), least_s, both_axes, (log.note(),),
        aged=np.array([np.mean(log.aged[a:b], axis=0) for a, b, _ in found]) * log.doubt(),
    )  # fmt: skip


def _operating_points(found, nominal) -> int:
    """Number of clearly different operating points."""
    top = max(float(np.abs(found.omega).max()), 1e-9)
    steps = (found.i.real / nominal.machine.rated_current_a, found.i.imag / nominal.machine.rated_current_a)
    return len(np.unique(np.round(np.stack([*steps, found.omega / top], axis=1) / 0.05), axis=0))


def stretches_of(recording, nominal, least_s) -> Stretches:
    """The stretches of at least ``least_s`` [s]."""
    r = recording
    i, u, omega, u_dc = operating_columns(recording, nominal)
    t = r["t"] - r["t"][0]
    parts = dict(zip(SIGNALS, (i.real, i.imag, u.real, u.imag, omega), strict=True))
    periods = {name: message_period(t, x) for name, x in parts.items()}
    fresh = [updates(x) for x in parts.values() if restless(t, x)]
    window = max(least_s, MESSAGES * max(periods.values()))
    change, turns = _change, TURNS
    if max(periods.values()) < MESSAGE_ROWS * np.median(np.diff(t)):  # no messages: every row has its own noise
        change, turns = _drift, FEW_TURNS
    nominal_u = steady_voltage(nominal.machine, i, omega)
    u, both_axes = known_voltage(u, nominal_u)
    angle = known_angle(recording)
    limit = STILL * max(np.nanmax(np.abs(nominal_u)), np.nanmax(np.abs(u)), 1e-9)
    good = r.usable & np.isfinite(nominal_u) & np.isfinite(u)
    step = np.diff(t)
    broken = np.append(step > max(window / 4, 3.0 * np.median(step)), True)
    gaps, bad = np.cumsum(np.append(0, broken[:-1])), np.cumsum(np.append(0, ~good))
    found, k = [], 0
    ends = np.searchsorted(t, t + window)
    before, behind = np.searchsorted(t, t - AROUND * window), np.searchsorted(t, t + (1.0 + AROUND) * window)
    while k < len(t) and behind[k] < len(t):
        inner, outer = slice(k, ends[k]), slice(before[k], behind[k])
        whole = gaps[before[k]] == gaps[behind[k] - 1] and bad[behind[k]] == bad[before[k]] and ends[k] - k >= 3
        whole = whole and all(f[ends[k] - 1] > f[k] for f in fresh)
        resting = np.isfinite(angle[k]) and abs(omega[inner].mean()) * window < AT_REST
        whole = whole and (resting or np.abs(omega[inner]).min() * window > 2 * np.pi * turns)
        if whole and all(change(x[inner]) < limit and change(x[outer]) < LOOSE * limit for x in (nominal_u, u)):
            found.append((k, ends[k], max(change(nominal_u[outer]), change(u[outer]))))
            k = ends[k]
        else:
            k += 1
    if not found:
        why = ", two messages of the slowest signal," if window > least_s else ""
        if t[-1] < window:  # not a row was judged
            raise RecordingError(
                f"{r.source}: it lasts {t[-1]:.2g} s, and with a row every {np.median(step):.3g} s a steady operating "
                f"point takes {window:.2g} s{why.rstrip(',')}: record longer{_unstated(nominal, t)}"
            )
        raise RecordingError(
            f"{r.source}: in no stretch of {window:.2g} s{why} are current, speed and voltage steady"
            f"{_unmet(omega, angle, window, turns)}: record longer operating points, or log faster"
            f"{_unstated(nominal, t)}"
        )
    mean = lambda x: np.array([np.mean(x[a:b]) for a, b, _ in found])  # noqa: E731
    temp = r["temp_winding"] if r.has("temp_winding") else np.full(len(t), np.nan)
    first, end, unsteady = (np.array(x) for x in zip(*found, strict=True))
    speed = mean(omega)
    rest = np.where(np.abs(speed) * window < AT_REST, angle[first], np.nan)
    return Stretches(
        mean(i), mean(u), speed, mean(u_dc), mean(temp), mean(t), first, end, unsteady, rest, float(window), both_axes,
        torque=mean(torque_at_shaft(r, nominal, i, omega)),
    )  # fmt: skip


def _unstated(nominal, t) -> str:
    """What the drive file leaves open about a log that may be one of the control; "" for others."""
    step = float(np.median(np.diff(t)))
    if nominal.control.sample_time_s is not None or step > CONTROL:
        return ""
    return f"; if the control samples every {step:.6g} s, state it as [control] sample_time_s"


def _unmet(omega, angle, window, turns) -> str:
    """A condition other than steadiness that no row meets, as the end of a sentence; "" if there is none."""
    usual, most = (float(f(np.abs(omega))) * window for f in (np.nanmedian, np.nanmax))
    if usual < AT_REST and not np.isfinite(angle).any():
        return STANDING
    if usual >= AT_REST and most <= 2 * np.pi * turns:
        return f" over {turns:g} electrical turns (the fastest one makes {most / (2 * np.pi):.2g})"
    return ""


STANDING = "; at standstill record theta_e, or add it to [constants]: the inverter loss depends on the angle"


def _change(x) -> float:
    return float(max(np.ptp(x.real), np.ptp(x.imag)))


def _drift(x) -> float:
    """The change of a signal of which every row has its own noise: of means over parts of it, beyond that noise."""
    parts = min(PARTS, len(x) // 4)
    if parts < 2:
        return _change(x)
    means = np.array([p.mean() for p in np.array_split(x, parts)])
    noise = np.sqrt(np.mean(np.abs(np.diff(x)) ** 2) / 2.0 * parts / len(x))
    return max(_change(means) - NOISE * float(noise), 0.0)
