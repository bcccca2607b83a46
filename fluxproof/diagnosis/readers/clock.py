# SPDX-License-Identifier: BSD-3-Clause
"""Dates, clock times and durations as seconds from the first one, so that no digit of a small step is lost in a date.

Of a date with the day or the month first only the clock time is used, as nothing tells which of the two it is.
"""

from __future__ import annotations

import re

import numpy as np

DAY = 86400.0
CLOCK = r"\d{1,2}:\d{2}:\d{2}([.,]\d+)?"
HALVES = rf"(\d{{1,2}}/\d{{1,2}}/\d{{4}} )?{CLOCK}(\s?[AaPp][Mm])?"
DURATION = r"([+-]?\d+\.?\d*(?:[eE][+-]?\d+)?)\s?(sec|s|ms|us|min|hr|h)"  # as MATLAB writes a timetable
LENGTHS = {"sec": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "hr": 3600.0, "h": 3600.0}
ISO = rf"\d{{4}}[-/]\d{{2}}[-/]\d{{2}}[T ]{CLOCK}\s*(Z|[+-]\d{{2}}:?\d{{2}}|[A-Z]{{3,5}})?"
ZONE = r"\s*([A-Z]{3,5})$"  # the name of a time zone
DOTTED = rf"\d{{1,2}}\.\d{{1,2}}\.\d{{4}} {CLOCK}"
MOMENT = re.compile(rf"{HALVES}|{ISO}|{DOTTED}|{DURATION}", re.ASCII)


def moments(values, pd) -> np.ndarray | None:
    """Seconds (n,) of a column of texts, NaN where one is no time; None if its first value is no date or clock time."""
    given = values.dropna()
    first = str(given.iloc[0]).strip() if len(given) else ""
    if not MOMENT.fullmatch(first):
        return None
    texts = values.astype("string").str.strip().str.replace(",", ".", regex=False)
    if re.fullmatch(DURATION, first):
        parts = texts.str.extract(rf"^{DURATION}$")
        return parts[0].astype(float).to_numpy(float, na_value=np.nan) * parts[1].map(LENGTHS).to_numpy(float)
    if re.fullmatch(HALVES, first):
        return _past_midnight(_of_day(texts, pd))
    if re.fullmatch(DOTTED, first):
        texts = texts.where(texts.str.contains(r":\d{2}\.", regex=True), texts + ".0")
        stamps = pd.to_datetime(texts, format="%d.%m.%Y %H:%M:%S.%f", errors="coerce")
    else:
        texts = texts.str.replace("/", "-", regex=False)
        zones = texts.str.extract(ZONE, expand=False)
        if zones.nunique() > 1:  # summer time began or ended: only an offset in numbers tells by how much
            return None
        if zones.notna().any():
            texts = texts.str.replace(ZONE, "", regex=True)
        stamps = pd.to_datetime(texts, format="ISO8601", errors="coerce", utc=True).dt.tz_localize(None)
    return seconds(stamps.to_numpy("M8[ns]"))


def _of_day(texts, pd) -> np.ndarray:
    """Seconds (n,) from the first of clock times, of which "1:00:00 PM" is thirteen o'clock; a date is left out."""
    half = texts.str.extract(r"([AaPp])[Mm]$", expand=False).str.upper()
    clock = texts.str.extract(rf"({CLOCK})", expand=False)[0]
    day = pd.to_timedelta(clock, errors="coerce").to_numpy("m8[ns]")
    hours = day / np.timedelta64(1, "h")
    noon = np.timedelta64(12, "h") * ((half == "P").fillna(False).to_numpy(bool) & (hours < 12.0))
    night = np.timedelta64(12, "h") * ((half == "A").fillna(False).to_numpy(bool) & (hours >= 12.0))
    return seconds(day + noon - night)


def seconds(stamps) -> np.ndarray:
    """(n,) from the first valid one of an array of datetime64 or timedelta64."""
    valid = stamps[~np.isnat(stamps)]
    if not len(valid):
        return np.full(len(stamps), np.nan)
    return (stamps - valid[0]) / np.timedelta64(1, "s")


def _past_midnight(times) -> np.ndarray:
    """Clock times that go on with the next day: a step back by more than half a day is midnight."""
    known = np.isfinite(times)
    at = times[known]
    times[known] = at + DAY * np.cumsum(np.diff(at, prepend=at[:1]) < -DAY / 2)
    return times
