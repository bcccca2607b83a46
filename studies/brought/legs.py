# SPDX-License-Identifier: BSD-3-Clause
"""Inverters whose legs differ: in their voltages, or in the currents that low-side shunts have no time to sample."""

from __future__ import annotations

import numpy as np

from studies.mishaps.bases import BASES, DELAY, FORMS
from studies.mishaps.log import Log, Mishap
from studies.scored.truth import Case, Cause

UNEQUAL = {"one": (0.012, -0.004, -0.008), "two": (-0.01, 0.015, -0.005)}  # of the bus
PHASES, DUTIES = ("i_a", "i_b", "i_c"), ("d_a", "d_b", "d_c")
HIGHEST, USUAL = 0.985, 0.99  # duty that the recording reaches but in transients
WINDOW = (0.92, 0.95)  # duty from which on a shunt is not sampled in time
LEGS, SHUNT = r"legs of the inverter", r"shunt|no time to be sampled"


def _unequal(columns, shares):
    """The duties of a drive whose legs give more or less than what was asked for."""
    mean = np.mean(shares)
    return {name: columns[name] - (share - mean) for name, share in zip(DUTIES, shares, strict=True)}


def _near_the_bus(columns, drive):
    """(columns, drive file) with a bus so low that the duties reach HIGHEST."""
    duties = np.stack([columns[name] for name in DUTIES])
    gain = (HIGHEST - 0.5) / (np.quantile(duties.max(axis=0), USUAL) - 0.5)
    bus = {**drive["inverter"], "dc_bus_v": drive["inverter"]["dc_bus_v"] / gain}
    new = {name: np.clip(0.5 + gain * (columns[name] - 0.5), 0.0, 1.0) for name in DUTIES}
    return {**columns, **new, "u_dc": columns["u_dc"] / gain}, {**drive, "inverter": bus}


def _blind(columns, window, rng):
    """Currents of the legs whose duty leaves no time to sample: noise and part of the ripple instead."""
    out = dict(columns)
    rated = max(np.abs(columns[name]).max() for name in PHASES)
    for current, duty in zip(PHASES, DUTIES, strict=True):
        late = np.roll(columns[duty], DELAY) > window
        wrong = 0.3 * columns[current] + 0.15 * rated * (1.0 + 0.5 * rng.standard_normal(len(late)))
        out[current] = np.where(late, wrong, columns[current])
    return out


def _case(base: str, kind: str, name: str) -> Case:
    rng = np.random.default_rng(list(f"legs {base} {kind} {name}".encode()))
    columns, drive = dict(FORMS["phases"](base)), BASES[base].drive()
    if kind == "leg_volts":
        columns |= _unequal(columns, UNEQUAL[name])
        causes, readings = (Cause(reading=LEGS, words=LEGS),), ""
    else:
        columns, drive = _near_the_bus(columns, drive)
        if name != "healthy":
            columns = _blind(columns, float(name), rng)
        causes, readings = (), SHUNT
    mishap = Mishap(name, "phases", lambda log: log, causes, readings=readings)
    return Case(f"{kind}.{base}_{name}", mishap.truth(base, drive), Log(columns, drive).written)


def cases() -> list[Case]:
    names = {"leg_volts": (*UNEQUAL,), "leg_shunt": (*map(str, WINDOW), "healthy")}
    return [_case(base, kind, name) for base in BASES for kind, of in names.items() for name in of]
