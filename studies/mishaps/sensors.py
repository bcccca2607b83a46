# SPDX-License-Identifier: BSD-3-Clause
"""Mishaps of sensors and channels: clipped, dead, stuck, coarse, late, without a sensor."""

from __future__ import annotations

import numpy as np

from studies.mishaps.axes import _late
from studies.mishaps.log import Log, Mishap, then
from studies.mishaps.scales import I_DQ, PHASES, U_DQ
from studies.scored.truth import Cause

CHANNEL = r"stuck|constant|dead|i_a|nought|zero|sum|frozen|clip"
SENSORS = (Cause(("current_gain",)), Cause(("current_offset",)), Cause(("current_scale",)), Cause(("udc_gain",)))
LATE, LAG = (Cause(("sampling_skew",)), Cause(("delay",))), r"\blate\b|\blag|delay"
WARM = r"temp|winding|sensor"


def _rated(log: Log):
    return log.drive["machine"]["rated_current_a"]


def _clipped(log: Log):
    most = 0.55 * _rated(log)
    return log.having(**{n: np.clip(log.columns[n], -most, most) for n in PHASES})


def _from(share, name, value=None):
    """A column that keeps one value from a share of the log on; None: the last one before."""

    def change(log):
        x = log.columns[name].copy()
        at = int(share * len(x))
        x[at:] = x[at] if value is None else value
        return log.having(**{name: x})

    return change


def _holes(log: Log):
    x, rng = log.columns["i_b"].copy(), np.random.default_rng(6)
    for at in rng.integers(0, len(x) - 60, 8):
        x[at : at + 50] = np.nan
    return log.having(i_b=x)


def _coarse(names, bits):
    def change(log):
        step = 5.0 * _rated(log) / 2**bits
        return log.having(**{n: np.round(log.columns[n] / step) * step for n in names})

    return change


def _spikes(log: Log):
    rng, out = np.random.default_rng(7), {}
    for n in I_DQ:
        x = log.columns[n].copy()
        at = rng.integers(0, len(x), len(x) // 200)
        x[at] += _rated(log) * rng.choice((-1.0, 1.0), len(at))
        out[n] = x
    return log.having(**out)


def _ordinary(log: Log):
    """Gains of one in a thousand and offsets of a thousandth of the rated current."""
    parts = zip(PHASES, (1.001, 0.9993, 1.0), (1.0, -0.6, 0.3), strict=True)
    return log.having(u_dc=log.columns["u_dc"] * 1.001,
                      **{n: log.columns[n] * g + 1e-3 * _rated(log) * o for n, g, o in parts})  # fmt: skip


def _warm(value):
    return lambda log: log.having(temp_winding=np.full_like(log.columns["omega_e"], value))


def _nothing(name):
    return lambda log: log.having(**{name: np.full_like(log.columns["t"], np.nan)})


MISHAPS = (
    Mishap("currents clipped", "phases", _clipped, readings=r"clip|satur", limit=r"clip|satur"),
    Mishap("channel i_a dead", "phases", _from(0.0, "i_a", 0.0), readings=CHANNEL, limit=CHANNEL),
    Mishap("channel i_a stuck from the middle on", "phases", _from(0.5, "i_a"), readings=CHANNEL, limit=CHANNEL),
    Mishap("channel i_q stuck from the middle on", "dq", _from(0.5, "i_q"), readings=CHANNEL,
           limit=r"stuck|constant|frozen|i_q"),
    Mishap("speed stuck from the middle on", "dq", _from(0.5, "omega_e"), readings=r"stuck|speed|omega",
           limit=r"stuck|speed|omega"),
    Mishap("bus nought from the middle on", "phases", _from(0.5, "u_dc", 0.0), readings=r"u_dc|bus",
           limit=r"u_dc|bus"),
    Mishap("two currents only", "phases", lambda log: log.without("i_c")),
    Mishap("holes in i_b", "phases", _holes, readings=r"finite|missing|number|i_b"),
    Mishap("i_q without numbers", "dq", _nothing("i_q"), limit=r"i_q"),
    Mishap("angle without numbers", "phases", _nothing("theta_e"), limit=r"theta_e|angle"),
    Mishap("currents of seven bits", "phases", _coarse(PHASES, 7), beside=SENSORS),
    Mishap("table of two digits", "table", lambda log: Log(log.columns, log.drive, digits="%.2f")),
    Mishap("log of three digits", "dq", lambda log: Log(log.columns, log.drive, digits="%.3f"), readings="time|row",
           limit="time"),
    Mishap("spikes", "dq", _spikes, readings=r"spike|outlier|beyond"),
    Mishap("ordinary sensors", "phases", _ordinary, beside=SENSORS),
    Mishap("i_q three rows late", "dq", _late("i_q", 3), beside=LATE, limit=LAG),
    Mishap("u_q two rows late", "dq", _late("u_q_ref", 2), beside=LATE, limit=LAG),
    Mishap("voltages of the message before", "slow", then(*(_late(n, 2) for n in U_DQ))),
    Mishap("temperature sensor open", "slow", _warm(-273.1), readings=WARM, limit=WARM, never=r"from [-−]\d\d"),
    Mishap("temperature sensor at nought", "slow", _warm(0.0), readings=WARM),
    Mishap("temperature sensor open in a fast log", "phases", _warm(-40.0), readings=WARM, never=r"from [-−]\d\d"),
    Mishap("temperature in tenths", "slow", _warm(250.0), readings=WARM, limit=WARM),
)  # fmt: skip
