# SPDX-License-Identifier: BSD-3-Clause
"""A line of the result."""

from __future__ import annotations


def most(name: str, ours: float, target: float, unit: str) -> dict:
    """A figure that must not exceed its target."""
    shown = float(f"{ours:.3g}") if isinstance(ours, float) else ours
    return {"figure": name, "ours": shown, "target": target, "unit": unit, "pass": bool(ours <= target)}


def least(name: str, ours: float, target: float, unit: str) -> dict:
    """A figure that must reach its target."""
    return most(name, ours, target, unit) | {"pass": bool(ours >= target)}
