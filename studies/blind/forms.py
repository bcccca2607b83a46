# SPDX-License-Identifier: BSD-3-Clause
"""All effects of the benchmark, and ``apply``, which adds one to a drive."""

from __future__ import annotations

from studies.blind import forms_machine, forms_sensors
from studies.blind.build import Build
from studies.blind.registry import CATALOGUE, EFFECTS

__all__ = ["CATALOGUE", "EFFECTS", "apply", "forms_machine", "forms_sensors"]


def apply(name: str, build: Build, rng, size: float, form: str) -> dict[str, float]:
    """Add one effect to the drive; returns the true parameters {name: value}."""
    return {key: float(value) for key, value in EFFECTS[name][0](build, rng, size, form).items()}
