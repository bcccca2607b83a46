# SPDX-License-Identifier: BSD-3-Clause
"""A step of a loop's reference, what it was made at, and the two numbers that a response is judged by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True)
class Loop:
    """``reference`` is the input that steps in ``speed_mode``, ``signal`` what follows it."""

    name: str
    reference: str
    signal: str
    speed_mode: int


LOOPS = Loop("current loop", "i_q_ext", "i_q", 0), Loop("speed loop", "omega_ref", "omega_me", 1)


@dataclass(frozen=True)
class Situation:
    """A step from ``before`` to ``after`` [A or electrical rad/s] and what it was made at.

    ``omega``: the shaft's speed [electrical rad/s] at each sample from the step on; its length is that of the response.
    """

    loop: Loop
    before: float
    after: float
    omega: np.ndarray
    i_d: float  # A, of the reference
    i_q: float  # A, before the step
    u_dc: float  # V
    theta: float = 0.0  # electrical rad, at the step: the inverter's loss depends on it
    v_comp: int = 0  # of a leg, as the register shows it: what the core has learnt to compensate


class Curve(NamedTuple):
    """Values [A or electrical rad/s] at times [s] from the step on."""

    time: np.ndarray
    values: np.ndarray


def rise_and_overshoot(curve: np.ndarray, before: float, after: float) -> tuple[int | None, float]:
    """(first sample at 90 % of the step or None, the largest value beyond its end as a share of the step)."""
    made = (curve - before) / (after - before)
    reached = np.flatnonzero(made >= 0.9)
    return int(reached[0]) if len(reached) else None, max(float(made.max()) - 1.0, 0.0)


def told(curve: Curve, before: float, after: float) -> tuple[str, str]:
    """(rise to 90 % of the step, overshoot) in words."""
    begin = int(np.searchsorted(curve.time, 0.0))
    reached, over = rise_and_overshoot(curve.values[begin:], before, after)
    rise = "not reached" if reached is None else f"{1e3 * curve.time[begin + reached]:.3g} ms"
    return rise, f"{100.0 * over:.1f} %"
