# SPDX-License-Identifier: BSD-3-Clause
"""Whether the size of a named effect is that of the truth."""

from __future__ import annotations

from fluxproof.diagnosis.catalogue import CATALOGUE

SIGMAS = 2.0
MOST = 0.25  # of the true change: a wide standard deviation excuses no wrong size
INVERSE = {"iron_resistance_ohm": 0.5}  # zero effect is an infinite value: most relative standard deviation
NO_SIZE = ("cogging_order",)


def size_fault(effect: dict, accepted: list[dict], machine: dict) -> str:
    """Why the size of an effect of diagnosis.json is wrong; "" if it is right.

    accepted: intervals {parameter: (low, high)}, of which one must hold; machine: [machine] of the drive file.
    """
    name, values = effect["name"], effect["parameters"]
    if all(_zero(k, e, machine) for k, e in values.items() if k not in NO_SIZE):
        return f"{name}: its size is compatible with zero ({_shown(values)})"
    if not any(all(_within(k, values[k], span, machine) for k, span in s.items() if k in values) for s in accepted):
        return f"{name}: {_shown(values)} is not the true size"
    if not any(accepted) and (out := _implausible(name, values, machine)):
        return f"{name}: {out} is implausible"
    return ""


def _shown(values) -> str:
    return ", ".join(f"{k} {e['value']:.4g} ± {e['sigma'] or 0.0:.2g} {e['unit']}" for k, e in values.items())


def _change(key, value, machine) -> float:
    """A value less the one that the drive file has for it."""
    return value - float(machine.get(key, 0.0))


def _zero(key, estimate, machine) -> bool:
    value, sigma = estimate["value"], estimate["sigma"]
    if sigma is None:
        return True
    if key in INVERSE:
        return sigma > INVERSE[key] * abs(value)
    return abs(_change(key, value, machine)) < SIGMAS * sigma


def _within(key, estimate, span, machine) -> bool:
    low, high = span
    room = SIGMAS * (estimate["sigma"] or 0.0)
    room = min(room, MOST * max(abs(_change(key, low, machine)), abs(_change(key, high, machine))))
    return low - room <= estimate["value"] <= high + room


def _implausible(name, values, machine) -> str:
    """The first parameter outside of the range that the catalogue calls plausible."""
    for key, span in getattr(CATALOGUE[name], "plausible", {}).items():
        scale = 1.0
        if len(span) == 3:
            section, _, own = span[2].partition(".")
            if section != "machine" or own not in machine:
                continue
            scale = float(machine[own])
        if key in values and not span[0] * scale <= values[key]["value"] <= span[1] * scale:
            return f"{key} {values[key]['value']:.4g}"
    return ""
