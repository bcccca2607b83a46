# SPDX-License-Identifier: BSD-3-Clause
"""Mishaps of angle, speed, phases and signs."""

from __future__ import annotations

import math

import numpy as np

from studies.mishaps.log import Log, Mishap, scaled, swapped, then
from studies.scored.truth import Cause

SPEED = r"rpm|omega_e|the speed (is|has|in)|unit of (the )?speed|angle against"
ANGLE = r"(in|as) (degrees|turns|codes|revolutions|counts)|theta_e|of the shaft|angle (stands|against|stuck)"
ORDER = r"\border\b|swapped|exchanged|rotates|sequence"
SIGN = r"\bsign\b|opposite|rotates|direction|angle_180|swapped|axes|\border\b"
OFFSET = {"offset_rad": (0.40, 0.47)}
TWO_PI = 2.0 * np.pi


def _pairs(log: Log):
    return log.drive["machine"]["pole_pairs"]


def _theta(change):
    return lambda log: log.having(theta_e=change(log.columns["theta_e"]))


def _rpm(log: Log):
    return log.having(omega_e=log.columns["omega_e"] * 30 / np.pi / _pairs(log))


def _shaft_speed(log: Log):
    return log.having(omega_e=log.columns["omega_e"] / _pairs(log))


def _shaft_angle(log: Log):
    return log.having(theta_e=np.mod(np.unwrap(log.columns["theta_e"]) / _pairs(log), TWO_PI))


def _stuck_angle(log: Log):
    theta, half = log.columns["theta_e"].copy(), len(log.columns["t"]) // 2
    theta[half:] = theta[half]
    return log.having(theta_e=theta)


def _late(name, rows):
    """A column that is ``rows`` rows late."""
    return lambda log: log.having(**{name: np.concatenate([np.full(rows, log.columns[name][0]),
                                                           log.columns[name][:-rows]])})  # fmt: skip


def _cyclic(log: Log):
    c = log.columns
    return log.having(i_a=c["i_b"], i_b=c["i_c"], i_c=c["i_a"])


MISHAPS = (
    Mishap("speed in rpm", "dq", _rpm, readings=SPEED, limit=r"rpm"),
    Mishap("speed in rpm no angle", "dq", then(_rpm, lambda log: log.without("theta_e")), readings=SPEED,
           limit=r"rpm|unit of", tells=SPEED),
    Mishap("speed in rpm of a slow log", "slow", _rpm, readings=SPEED, limit=r"rpm|unit of", tells=SPEED),
    Mishap("speed in rpm of a table", "table", _rpm, readings=SPEED, limit=r"rpm|unit of", tells=SPEED),
    Mishap("speed named n without unit", "slow", then(_rpm, lambda log: log.renamed(omega_e="n")), readings=SPEED,
           limit=r"rpm|unit", never=r"'n' for omega_e(?!.*unit)", tells=SPEED),
    Mishap("speed of the shaft", "dq", _shaft_speed, readings=SPEED, limit=SPEED),
    Mishap("speed of the shaft slow", "slow", _shaft_speed, readings=SPEED, limit=SPEED),
    Mishap("speed in hertz", "dq", scaled(1 / TWO_PI, "omega_e"), readings=SPEED, limit=SPEED),
    Mishap("speed with the wrong sign", "dq", scaled(-1.0, "omega_e"), readings=SIGN, limit=SIGN),
    Mishap("speed of another drive", "phases", lambda log: log.having(omega_e=np.full_like(log.columns["t"], 77.0)),
           readings=SPEED, limit=SPEED),
    Mishap("no speed", "phases", lambda log: log.without("omega_e")),
    Mishap("no angle", "dq", lambda log: log.without("theta_e")),
    Mishap("angle in degrees", "phases", _theta(np.degrees), readings=ANGLE, limit=ANGLE),
    Mishap("angle in turns", "phases", _theta(lambda x: np.mod(x, TWO_PI) / TWO_PI), readings=ANGLE, limit=ANGLE),
    Mishap("angle in codes", "phases", _theta(lambda x: np.round(np.mod(x, TWO_PI) / TWO_PI * 65536)), readings=ANGLE,
           limit=ANGLE),
    Mishap("angle of the shaft", "phases", _shaft_angle, readings=ANGLE, limit=ANGLE),
    Mishap("angle 25 degrees off", "phases", _theta(lambda x: np.mod(x + math.radians(25), TWO_PI)),
           causes=(Cause(("encoder_offset",), OFFSET),)),
    Mishap("angle of the q axis", "phases", _theta(lambda x: np.mod(x + np.pi / 2, TWO_PI)),
           causes=(Cause(("encoder_offset",), reading="angle_90"),)),
    Mishap("angle half a turn off", "phases", _theta(lambda x: np.mod(x + np.pi, TWO_PI)),
           causes=(Cause(("encoder_offset",), reading=f"angle_180|{SIGN}"),)),
    Mishap("angle backwards", "phases", _theta(lambda x: np.mod(-x, TWO_PI)),
           readings=f"{SIGN}|{ORDER}", limit=f"{SIGN}|{ANGLE}"),
    Mishap("angle one row late", "phases", _late("theta_e", 1),
           causes=(Cause(("sampling_skew", "delay"), may=("iron_loss",), words="late|instant|delay"),)),
    Mishap("angle stuck in the second half", "phases", _stuck_angle, readings=r"stuck|constant",
           limit=r"stuck|constant|stands"),
    Mishap("currents b and c swapped", "phases", swapped("i_b", "i_c"), readings=ORDER, limit=ORDER),
    Mishap("duties b and c swapped", "phases", swapped("d_b", "d_c"), readings=ORDER, limit=ORDER),
    Mishap("currents in the order b c a", "phases", _cyclic, readings=f"{ORDER}|angle_(minus_)?120", limit=ORDER),
    Mishap("currents with the wrong sign", "phases", scaled(-1.0, "i_a", "i_b", "i_c"), readings=SIGN, limit=SIGN),
    Mishap("one current with the wrong sign", "phases", then(scaled(-1.0, "i_b"), lambda log: log.without("i_c")),
           readings=SIGN, limit=SIGN),
    Mishap("i_q with the wrong sign", "dq", scaled(-1.0, "i_q"), readings=SIGN, limit=SIGN),
    Mishap("u_q with the wrong sign", "dq", scaled(-1.0, "u_q_ref"), readings=SIGN, limit=SIGN),
    Mishap("i_d and i_q swapped", "dq", swapped("i_d", "i_q"), readings="swap", limit="swap"),
    Mishap("u_d and u_q swapped slow", "slow", swapped("u_d_ref", "u_q_ref"), readings="swap|angle", limit="swap"),
    Mishap("i_q and u_q swapped", "dq", swapped("i_q", "u_q_ref"), readings="swap",
           limit=r"swap|rated|i_q|implausib|limit|A\b"),
)  # fmt: skip
