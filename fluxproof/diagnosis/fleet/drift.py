# SPDX-License-Identifier: BSD-3-Clause
"""Change of a parameter over the recordings of one serial number: rate, when it was noticed, when it reaches a limit.

    x_k = a + b t_k + e_k,   e_k ~ N(0, (g s_k)^2),   g >= 1

weighted least squares; g^2 is the reduced chi^2, as recordings of one drive differ by more than their own sigma where
temperature or mounting does.  The rate is reported if b is significant among all rates (Benjamini-Hochberg).
It is noticed at the first recording k at which the test of the first k ones has a probability below

    DRIFT_ALARM (6 / pi^2) / (k - DRIFT_RECORDINGS + 1)^2

whose sum over all k is DRIFT_ALARM: looking after each recording does not raise the share of false alarms.  The limit L
is reached where a + b t = L; its interval is Fieller's: all t at which L is within DRIFT_CONFIDENCE of the line.
"""

from __future__ import annotations

import datetime
from dataclasses import dataclass

import numpy as np
from scipy import stats

from fluxproof.diagnosis.ground import constants

DAY_S = 86400.0
FAR_DAYS = 36500.0  # a limit beyond a century is not reported
LIMITS = {"magnet_flux_wb": "95%", "resistance_ohm": "130%"}  # of the first value; --limit sets others


@dataclass(frozen=True)
class Line:
    """A weighted line over time [days since the first recording]: value and rate, covariance (2, 2), freedom."""

    a: float
    b: float
    covariance: np.ndarray
    freedom: int

    @property
    def sigma(self) -> float:
        return float(np.sqrt(self.covariance[1, 1]))

    @property
    def p(self) -> float:
        """Two-sided probability of such a rate without a drift."""
        return float(2.0 * stats.t.sf(abs(self.b) / max(self.sigma, 1e-300), self.freedom))


@dataclass(frozen=True)
class Drift:
    """A significant rate of one drive; times: of its recordings; x, s: (n,) values.  rate, rate_sigma: per day.

    noticed: index of the recording after which it was; change: of the value until then, relative.
    reaches, earliest, latest: when the limit is met; None where it is not, or not within FAR_DAYS.
    """

    serial: str
    effect: str
    parameter: str
    unit: str
    times: tuple[datetime.datetime, ...]
    x: np.ndarray
    s: np.ndarray
    line: Line
    doubt: float
    noticed: int | None
    change: float
    limit: float | None
    reaches: datetime.datetime | None = None
    earliest: datetime.datetime | None = None
    latest: datetime.datetime | None = None


def line_of(t, x, s) -> Line:
    """The weighted line of values x (n,) with sigmas s (n,) at times t (n,)."""
    t, x, s = (np.asarray(v, float) for v in (t, x, s))
    design = np.stack([np.ones_like(t), t], axis=1) / s[:, None]
    covariance = np.linalg.inv(design.T @ design)
    a, b = covariance @ (design.T @ (x / s))
    freedom = max(len(t) - 2, 1)
    chi2 = float(np.sum(((x - a - b * t) / s) ** 2))
    return Line(float(a), float(b), covariance * max(1.0, chi2 / freedom), freedom)


def noticed_at(t, x, s) -> int | None:
    """Index of the recording after which the drift was noticed for the first time."""
    for k in range(constants.DRIFT_RECORDINGS, len(t) + 1):
        alarm = constants.DRIFT_ALARM * 6.0 / np.pi**2 / (k - constants.DRIFT_RECORDINGS + 1) ** 2
        if np.ptp(t[:k]) > 0.0 and line_of(t[:k], x[:k], s[:k]).p < alarm:
            return k - 1
    return None


def reached(line: Line, limit: float) -> tuple[float, float, float] | None:
    """(time, earliest, latest) [days] at which the line meets the limit; None if it moves away from it."""
    if line.b == 0.0 or (at := (limit - line.a) / line.b) < 0.0:
        return None
    q2 = stats.t.ppf(0.5 + 0.5 * constants.DRIFT_CONFIDENCE, line.freedom) ** 2
    c, d = line.covariance, line.a - limit
    # (d + b t)^2 = q^2 (c00 + 2 c01 t + c11 t^2)
    roots = np.roots([line.b**2 - q2 * c[1, 1], 2.0 * (d * line.b - q2 * c[0, 1]), d**2 - q2 * c[0, 0]])
    real = sorted(float(r.real) for r in roots if abs(r.imag) < 1e-9 * max(abs(r), 1.0))
    bounded = line.b**2 > q2 * c[1, 1] and len(real) == 2
    if bounded:
        return float(at), real[0], real[1]
    return float(at), real[-1] if real else 0.0, np.inf


def drifts(series: dict, limits: dict[str, str] | None = None) -> list[Drift]:
    """All significant drifts, the surest first; series: {(serial, effect, parameter, unit): [(time, value, sigma)]}.

    limits: {parameter: value in its unit, or "95%" of the value at the first recording}.
    """
    limits = {**LIMITS, **(limits or {})}
    ready: list[tuple[tuple, list[datetime.datetime], np.ndarray, np.ndarray, np.ndarray, Line]] = []
    for key, points in sorted(series.items()):
        points = sorted(points)
        days = np.array([(p[0] - points[0][0]).total_seconds() / DAY_S for p in points])
        if len(points) >= constants.DRIFT_RECORDINGS and np.ptp(days) > 0.0:
            x, s = np.array([p[1] for p in points]), np.array([p[2] for p in points])
            ready.append((key, [p[0] for p in points], days, x, s, line_of(days, x, s)))
    if not ready:
        return []
    doubts = stats.false_discovery_control([line.p for *_, line in ready])
    found = [
        _drift(*entry, float(q), limits) for entry, q in zip(ready, doubts, strict=True) if q <= constants.FLEET_FALSE
    ]
    return sorted(found, key=lambda d: (d.doubt, d.serial, d.parameter))


def _drift(key, times, days, x, s, line, doubt, limits) -> Drift:
    serial, effect, parameter, unit = key
    seen = noticed_at(days, x, s)
    change = line.b * days[seen] / line.a if seen is not None and line.a else float("nan")
    limit = limit_of(limits.get(parameter), line.a)
    met = reached(line, limit) if limit is not None else None
    dates = [_date(times[0], d) for d in met] if met else [None] * 3
    args = (serial, effect, parameter, unit, tuple(times), x, s, line, doubt, seen, float(change), limit, *dates)
    return Drift(*args)


def limit_of(text: str | None, first: float) -> float | None:
    """A limit in the parameter's unit from '0.13' or '95%'; ValueError if it is neither."""
    if text is None:
        return None
    text = str(text).strip()
    return first * float(text[:-1]) / 100.0 if text.endswith("%") else float(text)


def _date(start, days) -> datetime.datetime | None:
    return start + datetime.timedelta(days=days) if -FAR_DAYS < days < FAR_DAYS else None
