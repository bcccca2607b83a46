# SPDX-License-Identifier: BSD-3-Clause
"""Dates and clock times as seconds from the first one, so that no digit of a small step is lost in a large date."""

from __future__ import annotations

import re

import numpy as np

DAY = 86400.0
CLOCK = r"\d{1,2}:\d{2}:\d{2}([.,]\d+)?"
ISO = rf"\d{{4}}-\d{{2}}-\d{{2}}[T ]{CLOCK}\s*(Z|[+-]\d{{2}}:?\d{{2}}|[A-Z]{{3,5}})?"
ZONE = r"\s*([A-Z]{3,5})$"  # the name of a time zone
DOTTED = rf"\d{{1,2}}\.\d{{1,2}}\.\d{{4}} {CLOCK}"
MOMENT = re.compile(rf"{CLOCK}|{ISO}|{DOTTED}", re.ASCII)


def moments(values, pd) -> np.ndarray | None:
    """Seconds (n,) of a column of texts, NaN where one is no time; None if its first value is no date or clock time."""
    given = values.dropna()
    first = str(given.iloc[0]).strip() if len(given) else ""
    if not MOMENT.fullmatch(first):
        return None
    texts = values.astype("string").str.strip().str.replace(",", ".", regex=False)
    if re.fullmatch(CLOCK, first):
        return _past_midnight(seconds(pd.to_timedelta(texts, errors="coerce").to_numpy("m8[ns]")))
    if re.fullmatch(DOTTED, first):
        texts = texts.where(texts.str.contains(r":\d{2}\.", regex=True), texts + ".0")
        stamps = pd.to_datetime(texts, format="%d.%m.%Y %H:%M:%S.%f", errors="coerce")
    else:
        zones = texts.str.extract(ZONE, expand=False)
        if zones.nunique() > 1:  # summer time began or ended: only an offset in numbers tells by how much
            return None
        if zones.notna().any():
            texts = texts.str.replace(ZONE, "", regex=True)
        stamps = pd.to_datetime(texts, format="ISO8601", errors="coerce", utc=True).dt.tz_localize(None)
    return seconds(stamps.to_numpy("M8[ns]"))


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
