# SPDX-License-Identifier: BSD-3-Clause
"""Single rows that a logger lost, so many that hardly a block is whole: filled between their neighbours.

Currents and duties are interpolated in the frame of the rotor, in which they are steady; in a transient the filled rows
are wrong, but blocks of transients are not used.  A recording with enough whole stretches stays as it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.quantities import counted
from fluxproof.diagnosis.ground.recording import Problem
from fluxproof.plant.transforms import phase_values, space_vector

STAGE = "signals"
MOST_LOST = 2  # rows between two neighbours
MOST_SHARE = 0.2  # of the rows
WHOLE = 80  # rows of a stretch that holds a block (balance/blocks.py)
ENOUGH = 0.5  # share of the rows in such stretches
EVEN = 0.1  # of a step: how near the gap is to whole steps
PHASES, DUTIES, FLAGS = ("i_a", "i_b", "i_c"), ("d_a", "d_b", "d_c"), ("fault", "enable")


def check(recording, nominal) -> None:
    if recording.slow or recording.points or not recording.has("theta_e") or len(recording) < WHOLE:
        return
    whole = np.bincount(np.cumsum(np.append(0, ~recording.joined[:-1])))
    if whole[whole >= WHOLE].sum() > ENOUGH * len(recording):
        return
    steps = np.diff(recording["t"]) / nominal.sample_time_s
    lost = np.round(steps).astype(int) - 1
    lost[(lost < 1) | (lost > MOST_LOST) | (np.abs(steps - np.round(steps)) > EVEN)] = 0
    if not lost.any() or lost.sum() > MOST_SHARE * len(recording):
        return
    _fill(recording, lost)
    gaps = [k for k, p in enumerate(recording.problems) if p.code == "gap"]
    for k in gaps:  # found before
        recording.problems[k] = replace(recording.problems[k], action=f"those of up to {MOST_LOST} rows are filled")
    most = "alone" if lost.max() == 1 else f"at most {lost.max()} in a row"
    message = f"{counted(int(lost.sum()), 'row')} are missing, {most}, and leave hardly a whole stretch"
    recording.problems.append(
        Problem("lost_rows", message, "t", int(np.argmax(lost > 0)) + 1, int(lost.sum()), "filled between neighbours")
    )


def _fill(recording, lost) -> None:
    """Insert ``lost`` (n - 1,) rows behind each row."""
    n = len(recording)
    place = np.arange(n) + np.append(0, np.cumsum(lost))
    at = np.interp(np.arange(place[-1] + 1), place, np.arange(n))  # of the new rows among the old ones
    before, near = np.floor(at).astype(int), np.round(at).astype(int)
    after = np.ceil(at).astype(int)
    between = lambda x: x[before] + (at - before) * (x[after] - x[before])  # noqa: E731
    old = recording.columns
    theta = np.unwrap(old["theta_e"])
    turned = between(theta)
    new = {name: x[near] if name in FLAGS else between(x) for name, x in old.items()}
    kept = before == after
    new["theta_e"] = np.where(kept, old["theta_e"][near], np.mod(turned, 2 * np.pi))
    for names in (PHASES, DUTIES):
        if recording.has(*names[:2]):
            new |= _in_rotor_frame(old, names, theta, turned, between, kept, near)
    recording.columns = new
    recording.usable = recording.usable[before] & recording.usable[after]
    ends = np.append(lost > 0, False)
    recording.joined = np.where(kept, (recording.joined | ends)[near], True)
    if "run" in recording.meta:
        recording.meta["run"] = recording.meta["run"][near]


def _in_rotor_frame(old, names, theta, turned, between, kept, near) -> dict[str, np.ndarray]:
    """Phase values, interpolated as a vector that turns with the rotor beside their mean."""
    have = [name for name in names if name in old]
    third = old[names[2]] if len(have) == 3 else -old[names[0]] - old[names[1]]
    values = np.stack([old[names[0]], old[names[1]], third], axis=1)
    vector: Complex = space_vector(values) * np.exp(-1j * theta)
    filled = phase_values(between(vector) * np.exp(1j * turned)) + between(values.mean(axis=1))[:, None]
    return {name: np.where(kept, old[name][near], filled[:, k]) for k, name in enumerate(have)}
