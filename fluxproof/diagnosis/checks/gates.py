# SPDX-License-Identifier: BSD-3-Clause
"""Rows in which the gates of the inverter are off: before it is enabled, after a trip, while the drive coasts.

Their duties or voltage references are not at the machine.  The gates are off where no current flows and

    fault or enable says so, where one is recorded,
    the commands stay at one value, to the last bit, while the shaft turns, or
    the current references ask for a current.

Without a current alone nothing is wrong: a running control holds zero current with commands that turn or vary.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.runs import mark, runs_of_equal
from fluxproof.diagnosis.ground.quantities import counted
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "gates"
ZERO = 0.05  # of rated current, or of the recorded ones where their unit is not ampere
FOREIGN = 3.0  # times rated current, above which currents have another unit
ASKED = 0.2  # of the same: a reference that asks for a current
LEAST, LEAST_SLOW = 50, 3  # rows of a stretch with constant commands
LEAST_ASKED, LEAST_ASKED_SLOW = 200, 5  # rows of one without the current that is asked for: longer than a transient
LEAST_TURN = 1.0  # rad within a stretch
SLOW_SPEED = 0.05  # of the usual highest speed
COASTS = 0.02  # relative change of the speed, which a reference that is in force follows
LONGER = 10.0  # times the longest stretch of equal references while a current flows
MOST = 0.95  # share of rows: references that ask for a current throughout are of another unit
COMMANDS = (("d_a", "d_b", "d_c"), ("u_d_ref", "u_q_ref"))


def check(recording, nominal) -> None:
    if recording.points or len(recording) < LEAST_SLOW:
        return
    size, scale = _current(recording, nominal.machine.rated_current_a)
    if size is None:
        return
    no_current = size < ZERO * scale
    off, why = np.zeros(len(recording), bool), []
    for found, reason in (
        (_by_flag(recording, no_current), "by the recorded flag"),
        (_by_commands(recording, no_current), "no current flows and the commands are constant while it turns"),
        (_by_demand(recording, no_current, scale), "the current that is asked for does not flow"),
    ):
        if np.any(found & ~off):
            why.append(reason)
        off |= found
    if off.any():
        _set_aside(recording, off, "; ".join(why))


def _set_aside(recording, off, why) -> None:
    first, length = _stretches(off)
    rows = mark(recording.usable, first, length, 1, 1)
    t = recording["t"]
    last = min(first[0] + length[0], len(t) - 1)
    until = "" if last == len(t) - 1 else f" to {t[last]:.6g}"
    more = f", and in {counted(len(first) - 1, 'later part')}," if len(first) > 1 else ""
    fatal = not recording.usable.any()
    message = f"from {t[first[0]]:.6g}{until} s{more} the gates are off: {why}"
    recording.problems.append(
        Problem("gates_off", message, "", int(first[0]), rows, "" if fatal else "rows not used", fatal)
    )


def _current(recording, rated) -> tuple[np.ndarray | None, float]:
    """((n,) largest current of each row or None, what counts as a large one)."""
    names = [c for c in ("i_a", "i_b", "i_c", "i_d", "i_q") if c in recording.columns]
    if not names:
        return None, rated
    size = np.max([np.abs(recording[c]) for c in names], axis=0)
    usual = float(np.percentile(size, 98))
    return size, usual if usual > FOREIGN * rated else rated


def _stretches(rows) -> tuple[np.ndarray, np.ndarray]:
    """(first rows, lengths) of the runs of True in (n,) bool."""
    first, length = runs_of_equal(rows, 1)
    return first[rows[first]], length[rows[first]]


def _by_flag(recording, no_current) -> np.ndarray:
    """(n,) rows in which fault or enable says that the gates are off and no current contradicts it."""
    off = np.zeros(len(recording), bool)
    for name, when in (("fault", lambda x: x != 0.0), ("enable", lambda x: x == 0.0)):
        if name not in recording.columns:
            continue
        said = when(recording[name])
        agreed = np.zeros(len(off), bool)
        for a, n in zip(*_stretches(said), strict=True):
            if np.mean(no_current[a : a + n]) > 0.5:
                agreed[a : a + n] = True
        if np.any(said & ~agreed):
            recording.meta["notes"].append(f"{name} says that the gates are off in rows with current, and is not used")
        off |= agreed
    return off


def _by_commands(recording, no_current) -> np.ndarray:
    """(n,) rows of stretches without current whose commands stay at one value although the shaft turns."""
    off = np.zeros(len(recording), bool)
    names = next((c for c in COMMANDS if recording.has(*c)), None)
    if names is None:
        return off
    moves = np.any([np.diff(recording[c]) != 0.0 for c in names], axis=0)
    number = np.append(0, np.cumsum(moves))
    first, length = runs_of_equal(number, LEAST_SLOW if recording.slow else LEAST)
    live = _longest_live(number, no_current)
    turned, speed, slow = _turned(recording)
    for a, n in zip(first, length, strict=True):
        rows = slice(a, a + n)
        if np.mean(no_current[rows]) < 0.5 or turned[a + n - 1] - turned[a] < LEAST_TURN:
            continue
        if np.count_nonzero(speed[rows] > slow) < LEAST_SLOW:  # a shaft that coasts to rest turns only at first
            continue
        # References of the dq frame are constant at constant speed, if nothing is noisy.
        still = names[0] == "u_d_ref" and any(recording[c][a] != 0.0 for c in names)
        coasts = np.ptp(speed[rows]) > COASTS * np.max(speed[rows])
        if not still or coasts or (live is not None and n > LONGER * live):
            off[rows] = True
    return off


def _longest_live(number, no_current) -> int | None:
    """Rows of the longest stretch of equal commands while a current flows; None if hardly any flows."""
    flowing = number[~no_current]
    return int(np.bincount(flowing - flowing[0]).max()) if len(flowing) > LEAST_ASKED else None


def _turned(recording) -> tuple[np.ndarray, np.ndarray, float]:
    """((n,) angle that was turned through [rad], (n,) speed, the speed below which it stands), units as recorded."""
    step = np.diff(recording["t"], prepend=recording["t"][0])
    if "omega_e" in recording.columns:
        speed = np.abs(recording["omega_e"])
    else:
        turn = np.diff(recording["theta_e"], prepend=recording["theta_e"][0])
        usual = float(np.median(step[1:]))
        speed = np.abs(turn - 2 * np.pi * np.round(turn / (2 * np.pi))) / max(usual, 1e-12)
    return np.cumsum(speed * np.maximum(step, 0.0)), speed, SLOW_SPEED * float(np.percentile(speed, 98))


def _by_demand(recording, no_current, scale) -> np.ndarray:
    """(n,) rows of the stretches without current in which the references ask for one for long."""
    asked = [np.abs(recording[c]) for c in ("i_d_ref", "i_q_ref") if c in recording.columns]
    off = np.zeros(len(recording), bool)
    if not asked:
        return off
    lacking = no_current & (np.max(asked, axis=0) > ASKED * scale)
    first, length = _stretches(lacking)
    long = first[length >= (LEAST_ASKED_SLOW if recording.slow else LEAST_ASKED)]
    of, lasts = _stretches(no_current)
    for k in np.unique(np.searchsorted(of, long, side="right") - 1):
        off[of[k] : of[k] + lasts[k]] = True
    return off if np.mean(off) < MOST else np.zeros_like(off)
