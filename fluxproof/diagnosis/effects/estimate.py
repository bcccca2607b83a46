# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of an effect, their estimates, and whether a usual drive can have them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.ground.result import Estimate

DOUBT = 2.0  # standard deviations by which a value must violate a limit to be rejected


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect in the report."""

    name: str
    unit: str
    meaning: str
    title: str = ""  # as a headline calls it, "dead-time voltage"; empty: the meaning
    negative: str = ""  # as a headline calls a negative one, whose sign it then leaves out: "earlier by"
    periods: str = ""  # key of [control] that counts it, if it is a whole number of control periods

    @property
    def called(self) -> str:
        return self.title or self.meaning


def sigma(covariance, k=0) -> float:
    """Standard deviation of coefficient k."""
    return float(np.sqrt(max(covariance[k, k], 0.0)))


def one(name, unit, value, spread) -> dict[str, Estimate]:
    """{name: Estimate} of a single parameter."""
    return {name: Estimate(float(value), float(spread), unit)}


def plausible_range(limits, nominal) -> tuple[float, float]:
    """(least, largest) value of a usual drive; limits: an entry of ``Effect.plausible``."""
    reference = 1.0
    if len(limits) > 2:
        section, key = limits[2].split(".")
        reference = float(getattr(getattr(nominal, section), key))
    return limits[0] * reference, limits[1] * reference


def is_usual(parameters: dict[str, Estimate], plausible: dict, nominal) -> bool:
    """Whether all parameters of an effect are believable; plausible: ``Effect.plausible``."""
    return all(believable(parameters[key], limits, nominal) for key, limits in plausible.items() if key in parameters)


def believable(estimate, limits, nominal) -> bool:
    """Whether an estimate is within what its effect declares as plausible, or doubtfully beyond it."""
    low, high = plausible_range(limits, nominal)
    doubt = DOUBT * estimate.sigma if np.isfinite(estimate.sigma) else 0.0
    return low - doubt <= estimate.value <= high + doubt
