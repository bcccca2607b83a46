# SPDX-License-Identifier: BSD-3-Clause
"""Mishaps of the time column and of the rows."""

from __future__ import annotations

import numpy as np
import pandas as pd

from studies.mishaps.log import Log, Mishap, scaled, then
from studies.mishaps.nameplate import TIMES

UNIT = r"unit of t\b|time (unit|column)|no time|in (ms|us)\b|milliseconds|sample_time_s|rows are assumed"
TIME = r"time|\bt is\b|sample_time"  # of corrections
ORDER = r"time (stamp|runs|does not|goes|jumps|wraps|restarts)|backwards|duplicate|order of"
LOST = r"gaps? (at|of|from)|rows? (are |were )?(missing|lost)|lost rows|dropped"
ROWS = r"time|rows?\b|repeat|held|duplicate|gap"  # of corrections
START = pd.Timestamp("2026-11-20 10:00:00")


def _t(log: Log):
    return np.asarray(log.columns["t"], float)


def _stamps(log: Log):
    return START + pd.to_timedelta(_t(log), unit="s")


def _keep(share, seed=5):
    return lambda log: log.rows(np.random.default_rng(seed).random(len(_t(log))) > share)


def _every(log: Log):
    return log.rows(np.arange(len(_t(log))) % 7 != 3)


def _coarse(log: Log):
    return log.having(t=np.round(_t(log), 3))


def _restarted(log: Log):
    t, half = _t(log), len(_t(log)) // 2
    return log.having(t=np.where(np.arange(len(t)) < half, t, t - t[half]))


def _wrapped(log: Log):
    return log.having(t=np.mod(np.round(_t(log) * 1e6) + 2**32 - 2e5, 2**32)).renamed(t="t [us]")


def _swapped_rows(log: Log):
    order = np.arange(len(_t(log)))
    for at in range(100, len(order) - 10, 500):
        order[at], order[at + 1] = order[at + 1], order[at]
    return log.rows(order)


def _unnamed(log: Log):
    return Log(log.without("t").columns, log.drive, index=pd.Index(_stamps(log)))


def _held(count):
    """Every value is held for ``count`` rows, as a logger does that is faster than its messages."""

    def change(log):
        at = np.arange(len(_t(log))) // count * count
        return log.having(**{n: v[at] for n, v in log.columns.items() if n != "t"})

    return change


MISHAPS = (
    Mishap("time in ms without unit", "phases", scaled(1e3, "t"), readings=TIME, limit=UNIT),
    Mishap("time in us without unit", "phases", scaled(1e6, "t"), readings=TIME, limit=UNIT),
    Mishap("time in ms of a slow log", "slow", scaled(1e3, "t"), readings=TIME, limit=UNIT),
    Mishap("time named time_ms", "dq", then(scaled(1e3, "t"), lambda log: log.renamed(t="time_ms"))),
    Mishap("time in us wraps", "dq", _wrapped, readings=ROWS, limit=ORDER),
    Mishap("no time", "phases", lambda log: log.without("t"), readings=TIME, limit=UNIT),
    Mishap("no time in a slow log", "slow", lambda log: log.without("t"), readings=TIME, limit=UNIT,
           tells=UNIT),
    Mishap("no time and no sample time", "dq", then(lambda log: log.without("t"),
           lambda log: log.driven("control", sample_time_s=None)), readings=TIME, limit=TIMES,
           tells=TIMES),
    Mishap("time index without a name", "slow", _unnamed, readings=TIME, limit=UNIT, tells=UNIT,
           guess="rows are assumed"),
    Mishap("time index without a name fast", "dq", _unnamed, readings=TIME, limit=UNIT),
    Mishap("time as dates", "slow", lambda log: log.having(t=_stamps(log).astype(str))),
    Mishap("time since 1970", "slow", lambda log: log.having(t=_t(log) + 1.7e9)),
    Mishap("time since 1970 in single precision", "slow",
           lambda log: log.having(t=(_t(log) + 1.7e9).astype(np.float32).astype(float)), readings=ROWS, limit=ORDER),
    Mishap("time rounded to ms", "phases", _coarse, readings=ROWS, limit=ORDER),
    Mishap("clock restarts in the middle", "phases", _restarted, readings=ROWS, limit=ORDER),
    Mishap("rows twice", "phases", lambda log: log.rows(np.repeat(np.arange(len(_t(log))), 2)), readings=ROWS,
           limit=r"twice|repeat|duplicate"),
    Mishap("rows twice in a slow log", "slow", lambda log: log.rows(np.repeat(np.arange(len(_t(log))), 2)),
           readings=ROWS, limit=r"twice|repeat|duplicate"),
    Mishap("one row in twenty lost", "phases", _keep(0.05), readings=ROWS, limit=LOST),
    Mishap("every seventh row lost", "dq", _every, readings=ROWS, limit=LOST),
    Mishap("rows in the wrong order", "phases", _swapped_rows, readings=ROWS, limit=ORDER),
    Mishap("values held for five rows", "dq", _held(5), readings=r"held|repeat", limit=r"held|repeat"),
    Mishap("every tenth row", "dq", lambda log: log.rows(slice(None, None, 10)), readings=r"sample|slow",
           limit=r"sample|slow|steady|short"),
    Mishap("noughts after the end", "phases",
           lambda log: log.having(**{n: np.append(v, np.zeros(800)) for n, v in log.columns.items()}),
           readings=ROWS, limit=ORDER),
)  # fmt: skip
