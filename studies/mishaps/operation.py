# SPDX-License-Identifier: BSD-3-Clause
"""Mishaps of what the drive did: trips, enabling, power-up, standstill, one direction, one point."""

from __future__ import annotations

import numpy as np

from studies.mishaps.bases import POINTS, ROWS
from studies.mishaps.log import Log, Mishap
from studies.scored.truth import Cause

OFF = r"gates?|trip|switched off|enable|duties"
DUTIES, PHASES = ("d_a", "d_b", "d_c"), ("i_a", "i_b", "i_c")
HELD = 1.2
FEW = (Cause(("resistance",)), Cause(("magnet_flux",)))


def _off(first, last, duty, decay=6.0, fault=False):
    """The gates are off between two shares of the log: currents decay, duties are a value, or keep theirs (None)."""

    def change(log):
        c, n = {k: v.copy() for k, v in log.columns.items()}, len(log.columns["t"])
        a, b = int(first * n), int(last * n)
        fall = np.exp(-np.arange(b - a) / decay) if first > 0.0 else np.zeros(b - a)
        noise = 1e-3 * log.drive["machine"]["rated_current_a"]
        rng = np.random.default_rng(9)
        for name in PHASES:
            c[name][a:b] = c[name][max(a - 1, 0)] * fall + noise * rng.standard_normal(b - a)
        for name in DUTIES:
            c[name][a:b] = c[name][a] if duty is None else duty
        if fault:
            c["fault"] = (np.arange(n) >= a).astype(float) * 17
        return log.having(**c)

    return change


def _off_dq(log: Log):
    c, n = {k: v.copy() for k, v in log.columns.items()}, len(log.columns["t"])
    a = int(0.55 * n)
    for name in ("i_d", "i_q", "u_d_ref", "u_q_ref"):
        c[name][a:] = 0.0
    return log.having(**c)


def _power_up(log: Log):
    n = 250
    rated, k = log.drive["machine"]["rated_current_a"], np.arange(n)
    ring = 0.8 * rated * np.exp(-k / 60.0) * np.cos(2 * np.pi * k / 23.0)
    c = {name: log.columns[name].copy() for name in ("i_a", "i_b")}
    c["i_a"][:n] += ring
    c["i_b"][:n] -= ring
    return log.having(**c)


def _chosen(pick):
    """The rows whose speed and currents (i_d, i_q) a function picks; the time goes on."""
    return lambda log: log.rows(pick(log.columns["omega_e"], log.columns))


def _locked(log: Log):
    """Held by its load: currents without speed, the voltage of a resistance that is a fifth larger."""
    m = log.drive["machine"]
    true = HELD * m["resistance_ohm"]
    c, rng = log.columns, np.random.default_rng(10)
    noise = 1e-3 * true * m["rated_current_a"]
    u = {f"u_{x}_ref": true * c[f"i_{x}"] + noise * rng.standard_normal(len(c["t"])) for x in "dq"}
    nought = np.zeros(len(c["t"]))
    return log.having(omega_e=nought, theta_e=nought, **u)


def _dwell(log: Log):
    at = len(log.columns["t"]) - len(POINTS) * ROWS
    return log.rows(slice(at, at + ROWS))


def _short(log: Log):
    return log.rows(slice(0, 60))


def _twice(log: Log):
    c, t = log.columns, log.columns["t"]
    step = t[1] - t[0]
    return log.having(**{n: np.concatenate([v, v]) for n, v in c.items()} | {"t": np.arange(2 * len(t)) * step})


MISHAPS = (
    Mishap("trip with duties nought", "phases", _off(0.55, 1.0, 0.0), limit=OFF),
    Mishap("trip with duties at a half", "phases", _off(0.55, 1.0, 0.5), limit=OFF),
    Mishap("trip with frozen duties", "phases", _off(0.55, 1.0, None), limit=OFF),
    Mishap("trip with a fault column", "phases", _off(0.7, 1.0, 0.0, fault=True), limit=OFF),
    Mishap("trip and on again", "phases", _off(0.4, 0.6, 0.0), limit=OFF),
    Mishap("trip in dq", "dq", _off_dq, limit=rf"{OFF}|u_q_ref|voltage"),
    Mishap("log starts before enable", "phases", _off(0.0, 0.3, 0.5), limit=OFF),
    Mishap("log starts before enable duties nought", "phases", _off(0.0, 0.3, 0.0), limit=OFF),
    Mishap("currents ring at power-up", "phases", _power_up),
    Mishap("locked rotor", "slow", _locked, ignored=True, causes=(
        Cause(("resistance",), may=("current_scale", "udc_gain")),), limit=r"standstill|turn|stands"),
    Mishap("one direction only", "phases", _chosen(lambda w, c: w > 0.0), readings="gap"),
    Mishap("one speed only", "slow", _chosen(lambda w, c: np.abs(w) > 0.9 * np.abs(w).max())),
    Mishap("no load only", "slow", _chosen(lambda w, c: np.abs(c["i_q"]) < 0.05 * np.abs(c["i_q"]).max()),
           beside=FEW, limit=r"without (load|current)|no load|no-load"),
    Mishap("one dwell only", "phases", _dwell, limit=r"one operating point|short|steady|longer"),
    Mishap("sixty rows", "phases", _short, limit=r"short|rows|steady|longer"),
    Mishap("the same log twice", "phases", _twice),
)  # fmt: skip
