# SPDX-License-Identifier: BSD-3-Clause
"""Mishaps of units and conventions of currents, voltages and duties."""

from __future__ import annotations

import math

import numpy as np

from studies.mishaps.log import Log, Mishap, scaled, then
from studies.mishaps.nameplate import SCALES
from studies.scored.truth import Cause

ROOT2, ROOT3, POWER = math.sqrt(2.0), math.sqrt(3.0), math.sqrt(1.5)
PHASES, DUTIES, I_DQ, U_DQ = ("i_a", "i_b", "i_c"), ("d_a", "d_b", "d_c"), ("i_d", "i_q"), ("u_d_ref", "u_q_ref")
DUTY = r"dut(y|ies) .*(range|unit|between|beyond|from 0)|d_a .*(range|unit|beyond|negative)"
UNIT = r"\bunit|in mA|\bmA\b|percent|codes"


def _codes(log: Log):
    """Twelve bits around the middle, with a range of 2.5 times the rated current."""
    full = 2.5 * log.drive["machine"]["rated_current_a"]
    return log.having(**{n: np.round(log.columns[n] / full * 2048 + 2048) for n in PHASES})


def _per_unit(log: Log):
    half = log.columns["u_dc"].mean() / 2
    return log.having(**{n: log.columns[n] / half for n in U_DQ})


def _read(pattern) -> tuple[Cause, ...]:
    """A scale that is a convention; scales of sensors leave the same, and are right beside it only."""
    return (Cause(reading=pattern, may=SCALES),)


MISHAPS = (
    Mishap("currents in rms", "phases", scaled(1 / ROOT2, *PHASES), causes=_read("currents_rms")),
    Mishap("currents in mA", "phases", scaled(1e3, *PHASES), readings=UNIT, limit=UNIT),
    Mishap("currents in mA slow", "slow", scaled(1e3, *I_DQ), readings=UNIT, limit=UNIT),
    Mishap("currents peak to peak", "phases", scaled(2.0, *PHASES), causes=_read("currents_double")),
    Mishap("currents as converter codes", "phases", _codes, readings=UNIT, limit=UNIT),
    Mishap("dq currents power-invariant", "dq", scaled(POWER, *I_DQ), causes=_read("currents_power_invariant")),
    Mishap("dq currents and voltages power-invariant", "dq", scaled(POWER, *I_DQ, *U_DQ),
           causes=_read("dq_power_invariant")),
    Mishap("dq currents in rms slow", "slow", scaled(1 / ROOT2, *I_DQ), causes=_read("currents_rms")),
    Mishap("dq voltages in rms", "dq", scaled(1 / ROOT2, *U_DQ), causes=_read("voltages_rms")),
    Mishap("dq voltages line to line", "dq", scaled(ROOT3, *U_DQ), causes=_read(r"voltages_line\b")),
    Mishap("dq voltages line to line in rms slow", "slow", scaled(POWER, *U_DQ),
           causes=_read("voltages_line_rms|voltages_power_invariant")),
    Mishap("dq voltages in parts of half the bus", "dq", _per_unit, readings=r"u_dc/2|modulation|u_d_ref|unit",
           limit=r"u_dc/2|modulation|\bunit"),
    Mishap("duties in percent", "phases", scaled(100.0, *DUTIES), readings="percent", limit="percent"),
    Mishap("duties from minus one to one", "phases",
           lambda log: log.having(**{n: 2 * log.columns[n] - 1 for n in DUTIES}), readings=DUTY, limit=DUTY),
    Mishap("duties as compare values", "phases",
           lambda log: log.having(**{n: np.round(5000 * log.columns[n]) for n in DUTIES}), readings=DUTY, limit=DUTY),
    Mishap("bus in mV", "phases", scaled(1e3, "u_dc"), readings=r"\bmV\b|u_dc", limit=r"\bmV\b|u_dc"),
    Mishap("bus at half", "phases", scaled(0.5, "u_dc"), causes=_read("bus_half|u_dc")),
    Mishap("bus constant", "phases", lambda log: log.having(u_dc=np.full_like(
        log.columns["u_dc"], log.drive["inverter"]["dc_bus_v"])), readings="u_dc|stuck"),
    Mishap("bus not recorded", "phases", lambda log: log.without("u_dc"), readings="u_dc", limit="u_dc"),
    Mishap("bus not recorded dq", "dq", lambda log: log.without("u_dc")),
    Mishap("currents in mA by their header", "dq", then(
        scaled(1e3, *I_DQ), lambda log: log.renamed(i_d="i_d [mA]", i_q="i_q [mA]"))),
)  # fmt: skip
