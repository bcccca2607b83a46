# SPDX-License-Identifier: BSD-3-Clause
"""Mishaps of units and conventions of currents, voltages and duties."""

from __future__ import annotations

import math

import numpy as np

from studies.mishaps.log import Log, Mishap, scaled, then
from studies.mishaps.nameplate import SCALES

ROOT2, ROOT3, POWER = math.sqrt(2.0), math.sqrt(3.0), math.sqrt(1.5)
PHASES, DUTIES, I_DQ, U_DQ = ("i_a", "i_b", "i_c"), ("d_a", "d_b", "d_c"), ("i_d", "i_q"), ("u_d_ref", "u_q_ref")
CURRENTS = r"currents_|rms|power_invariant|power-invariant"
VOLTAGES = r"voltages_|dq_|rms|line|power"
UNIT = r"unit|mA|rated|percent|range|codes|u_dc"


def _per_unit(log: Log):
    half = log.columns["u_dc"].mean() / 2
    return log.having(**{n: log.columns[n] / half for n in U_DQ})


MISHAPS = (
    Mishap("currents in rms", "phases", scaled(1 / ROOT2, *PHASES), readings=CURRENTS, may=SCALES),
    Mishap("currents in mA", "phases", scaled(1e3, *PHASES), readings=UNIT, limit=UNIT),
    Mishap("currents in mA slow", "slow", scaled(1e3, *I_DQ), readings=UNIT, limit=UNIT),
    Mishap("currents peak to peak", "phases", scaled(2.0, *PHASES), readings="currents_", may=SCALES),
    Mishap("currents as converter codes", "phases",
           lambda log: log.having(**{n: np.round(log.columns[n] / (2.5 * log.drive["machine"]["rated_current_a"])
                                                 * 2048 + 2048) for n in PHASES}), readings=UNIT, limit=UNIT),
    Mishap("dq currents power-invariant", "dq", scaled(POWER, *I_DQ), readings=CURRENTS, may=SCALES),
    Mishap("dq currents and voltages power-invariant", "dq", scaled(POWER, *I_DQ, *U_DQ), readings="power",
           may=SCALES),
    Mishap("dq currents in rms slow", "slow", scaled(1 / ROOT2, *I_DQ), readings=CURRENTS, may=SCALES),
    Mishap("dq voltages in rms", "dq", scaled(1 / ROOT2, *U_DQ), readings=VOLTAGES, may=SCALES),
    Mishap("dq voltages line to line", "dq", scaled(ROOT3, *U_DQ), readings=VOLTAGES, may=SCALES),
    Mishap("dq voltages line to line in rms slow", "slow", scaled(POWER, *U_DQ), readings=VOLTAGES, may=SCALES),
    Mishap("dq voltages in parts of half the bus", "dq", _per_unit, readings=r"u_dc/2|bus|modulation|unit",
           limit=r"u_dc/2|modulation|unit|u_d_ref|voltage"),
    Mishap("duties in percent", "phases", scaled(100.0, *DUTIES), readings="percent|unit", limit="percent|range|unit"),
    Mishap("duties from minus one to one", "phases",
           lambda log: log.having(**{n: 2 * log.columns[n] - 1 for n in DUTIES}), readings=r"dut|range|unit",
           limit=r"dut|range|d_a"),
    Mishap("duties as compare values", "phases",
           lambda log: log.having(**{n: np.round(5000 * log.columns[n]) for n in DUTIES}), readings=r"dut|unit|range",
           limit=r"dut|range|d_a|unit"),
    Mishap("bus in mV", "phases", scaled(1e3, "u_dc"), readings=r"mV|u_dc|unit", limit=r"mV|u_dc|unit"),
    Mishap("bus at half", "phases", scaled(0.5, "u_dc"), readings=r"bus|u_dc", limit=r"bus|u_dc", may=SCALES),
    Mishap("bus constant", "phases", lambda log: log.having(u_dc=np.full_like(
        log.columns["u_dc"], log.drive["inverter"]["dc_bus_v"])), readings="u_dc|bus|stuck"),
    Mishap("bus not recorded", "phases", lambda log: log.without("u_dc"), readings="u_dc|bus", limit="u_dc|bus"),
    Mishap("bus not recorded dq", "dq", lambda log: log.without("u_dc")),
    Mishap("currents in mA by their header", "dq", then(
        scaled(1e3, *I_DQ), lambda log: log.renamed(i_d="i_d [mA]", i_q="i_q [mA]"))),
)  # fmt: skip
