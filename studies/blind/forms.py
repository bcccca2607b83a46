"""All effects of the benchmark and how to put one into a drive."""

from __future__ import annotations

from studies.blind import forms_machine, forms_sensors
from studies.blind.build import Build
from studies.blind.registry import CATALOGUE, EFFECTS

__all__ = ["CATALOGUE", "EFFECTS", "apply", "forms_machine", "forms_sensors"]


def apply(name: str, build: Build, rng, size: float, form: str) -> dict[str, float]:
    """Put one effect into the drive; returns the true parameters."""
    return {key: float(value) for key, value in EFFECTS[name][0](build, rng, size, form).items()}
