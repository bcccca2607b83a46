# SPDX-License-Identifier: BSD-3-Clause
"""Logs of the control whose angle sensor fails in steps: counts, index, magnet, Hall sectors, a late observer.

The windings do not know the sensor: phase currents and duties are those of the machine, and only the recorded angle,
or the dq values that are turned by it, are wrong.
"""

from __future__ import annotations

import numpy as np

from studies.mishaps.bases import BASES, FORMS, segments
from studies.mishaps.log import Log, Mishap
from studies.scored.truth import Case, Cause

DEGREE = np.pi / 180.0
AT = 13  # dwell in whose middle a magnet slips
SLIP = (8.0, 25.0, -15.0)  # degrees electrical
LOST = (-0.6, 1.5)  # degrees electrical a turn of the shaft
SECTORS = 6.0  # degrees: rms of the misplaced edges of Hall sensors
LATE = 0.06  # rad at rated speed
STEP = r"angle_step|slipped"
DRIFT = r"angle_drift|counts"
HALL = r"uneven|Hall"


def turned(base: str, form: str, error) -> Log:
    """The log of a base whose angle is wrong by error (n,) [rad]."""
    columns = dict(FORMS[form](base))
    columns["theta_e"] = columns["theta_e"] + error
    for real, imaginary in (("i_d", "i_q"), ("u_d_ref", "u_q_ref")):
        if real in columns:
            seen = (columns[real] + 1j * columns[imaginary]) * np.exp(-1j * error)
            columns[real], columns[imaginary] = seen.real, seen.imag
    return Log(columns, BASES[base].drive())


def _slip(columns, base, degrees, rng):
    rows = np.cumsum([dwell[3] for dwell in segments(base)])
    at = rows[AT + rng.integers(0, 4)] - rng.integers(90, 150)
    return np.where(np.arange(len(columns["t"])) < at, 0.0, degrees * DEGREE)


def _counts(columns, base, degrees):
    """Counts that are missing or too many a turn: in both directions."""
    turns = np.unwrap(columns["theta_e"]) / (2 * np.pi * base.machine["pole_pairs"])
    return degrees * DEGREE * (turns - turns[0])


def _hall(columns, rng):
    """The angle between six edges that are not where they should be, interpolated."""
    edges = rng.standard_normal(6)
    edges = SECTORS * DEGREE * (edges - edges.mean()) / edges.std()
    at = np.mod(columns["theta_e"], 2 * np.pi)
    return np.interp(at, np.arange(7) * np.pi / 3, np.append(edges, edges[0]))


def _error(name: str, base, columns, rng):
    kind, _, size = name.partition("_")
    if kind == "slip":
        return _slip(columns, base, float(size), rng)
    if kind == "counts":
        return _counts(columns, base, float(size))
    if kind == "hall":
        return _hall(columns, rng)
    return -LATE * columns["omega_e"] / base.omega if kind == "lag" else 0.0 * columns["t"]


CAUSES = {
    "slip": Cause(reading=STEP, words=STEP),
    "counts": Cause(reading=DRIFT, words=DRIFT),
    "hall": Cause(("encoder_eccentricity",), reading=HALL, words=HALL),
}


def _case(base: str, form: str, name: str) -> Case:
    def make(rng):
        columns = FORMS[form](base)
        return turned(base, form, _error(name, BASES[base], columns, rng))

    kind, causes = name.partition("_")[0], [cause for key, cause in CAUSES.items() if name.startswith(key)]
    if kind == "lag":
        late = LATE / BASES[base].omega
        sizes = {"skew_s": (0.95 * late, 1.05 * late)}
        causes = [Cause(("sampling_skew",), sizes, ("delay", "iron_loss"))]
    rng = np.random.default_rng(list(f"angle {base} {form} {name}".encode()))
    log = make(rng)
    mishap = Mishap(name, form, lambda log: log, tuple(causes))
    truth = mishap.truth(base, log.drive)
    return Case(f"angle_{kind}.{base}_{form}_{name}", truth, log.written)


def cases() -> list[Case]:
    names = [*(f"slip_{s:g}" for s in SLIP), *(f"counts_{s:g}" for s in LOST), "hall", "lag", "healthy"]
    return [_case(base, form, name) for base in BASES for form in ("phases", "dq") for name in names]
