# SPDX-License-Identifier: BSD-3-Clause
"""Texts of the report: the meaning of a verdict, formatted numbers and units, the description of an effect."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace

from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.effects import ShaftTorque
from fluxproof.diagnosis.ground.quantities import measured, number, quantity, unit_text
from fluxproof.diagnosis.suspects import SUSPECTS

__all__ = ["brief", "effect_text", "explained", "measured", "number", "percent", "quantity", "span", "unit_text"]

# verdict: (mood, meaning); the mood selects the colour of the badge.
VERDICTS = {
    "explained": (
        "good",
        "Known physics accounts for the difference, also at held-out operating points.",
    ),
    "partly_explained": (
        "good",
        "Known physics accounts for most of the difference; the residual is located, but its cause is not known.",
    ),
    "ambiguous": ("open", "Several causes fit this recording equally well."),
    "unexplained": ("open", "No effect of the catalogue explains half of the difference."),
    "no_mismatch": ("good", "Recording and simulation agree."),
    "digital_mismatch": (
        "bad",
        "The controller's outputs differ from those of its golden model. Correct that first.",
    ),
    "bad_recording": ("bad", "The recording cannot be diagnosed. Nothing was compared."),
}
LEAST_SHARE = 0.005  # a smaller share would be printed as 0 %
SMALL = 0.5  # where shares sum up to more, one without any is small and not taken over
VARIABLES = {
    "t": ("time", "s"),
    "theta_e": ("electrical angle", "rad"),
    "omega_e": ("electrical speed", "rad/s"),
    "i_d": ("current i_d", "A"),
    "i_q": ("current i_q", "A"),
    "u_dc": ("bus voltage", "V"),
    "temp_winding": ("winding temperature", "°C"),
}


def percent(share: float) -> str:
    """A fraction in percent; values from 0.995 to below 1 are written "> 99 %"."""
    if share is None or not math.isfinite(share):
        return "–"
    return "> 99 %" if 0.995 <= share < 1.0 else f"{100 * share:.0f} %".replace("-", "−")


def explained(effect, effects) -> str:
    """The share that a NamedEffect explains; where it counts none, where it shows instead.

    The share is what is left without the effect alone: none of a torque if the voltage counts, and none of two effects
    that take each other's part.
    """
    if not math.isfinite(effect.explains) or effect.explains > LEAST_SHARE:
        return percent(effect.explains)
    entry = CATALOGUE.get(effect.name)
    if isinstance(entry, ShaftTorque):
        return "in the torque"
    if sum(e.explains for e in effects) > SMALL:
        return "< 1 %"
    return "shared (see total)" if len(effects) > 1 else "–"


def span(low, high, unit: str) -> str:
    """The range from low to high as text; None or infinity is an open end."""
    low_open, high_open = low is None or not math.isfinite(low), high is None or not math.isfinite(high)
    if low_open and high_open:
        return "everywhere"
    if low_open or high_open:
        return f"{'below' if low_open else 'above'} {quantity(high if low_open else low, unit)}"
    return f"{number(low)} to {number(high)} {unit_text(unit)}"


def brief(value) -> str:
    """A value in the notation of drive.toml; a long array by its shape and range."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = dataclasses.asdict(value)
    elif (listed := getattr(value, "tolist", None)) is not None:
        value = listed()
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "–"}[value]
    if isinstance(value, int | float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return "; ".join(f"{key}: {brief(item)}" for key, item in value.items())
    if not isinstance(value, list | tuple):
        return str(value)
    shape, flat = [len(value)], list(value)
    while flat and all(isinstance(item, list | tuple) for item in flat):
        shape.append(max(len(item) for item in flat))
        flat = [item for part in flat for item in part]
    if not all(isinstance(item, int | float) for item in flat):
        return " | ".join(brief(item) for item in flat) or "none"
    if len(flat) <= 4 and len(shape) == 1:
        return ", ".join(brief(item) for item in flat)
    return f"{' × '.join(map(str, shape))} values from {brief(min(flat))} to {brief(max(flat))}"


def effect_text(name: str) -> SimpleNamespace:
    """title, equation, signature, separated_by and meanings {parameter: text} of a catalogue entry.

    A name without an entry is its own title; the other texts are then empty.
    """
    entry = CATALOGUE.get(name) or SUSPECTS.get(name)

    def of(key: str):
        return getattr(entry, key, "") or ""

    separated_by = of("separated_by")
    return SimpleNamespace(
        name=name,
        title=of("title") or name.replace("_", " "),
        equation=of("equation"),
        signature=of("signature"),
        separated_by=separated_by if isinstance(separated_by, str) else "; ".join(map(str, separated_by)),
        meanings={parameter.name: parameter.meaning for parameter in getattr(entry, "parameters", ())},
    )
