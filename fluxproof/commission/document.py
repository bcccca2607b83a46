# SPDX-License-Identifier: BSD-3-Clause
"""drive.toml with the measured values in place, and commission.json."""

from __future__ import annotations

import math

import tomlkit
import tomlkit.items

from fluxproof.commission.session import Step, Value
from fluxproof.quote import toml_comment
from golden_model.drive import Drive

SCHEMA = 1
# section, key, value of a step; what is not among the steps' values has no uncertainty
KEYS = (
    ("machine", "resistance_ohm", "resistance"),
    ("machine", "inductance_d_h", "inductance_d"),
    ("machine", "inductance_q_h", "inductance_q"),
    ("machine", "magnet_flux_wb", "magnet_flux"),
    ("machine", "inertia_kgm2", "inertia"),
    ("machine", "viscous_friction_nms", "viscous_friction"),
    ("machine", "coulomb_friction_nm", "coulomb_friction"),
    ("sensors", "current_offset_code", "offset_b"),
    ("sensors", "position_reverse", ""),
    ("sensors", "theta_offset_rad", "theta_offset"),
)
# Gains that were given for other values: the bandwidths and the measured values give new ones.
STALE = (
    "current_kp_d_v_per_a", "current_kp_q_v_per_a", "current_ki_d_v_per_as", "current_ki_q_v_per_as",
    "speed_kp_as_per_rad", "speed_ki_a_per_rad", "flux_kp", "flux_ki_per_s",
)  # fmt: skip


def all_values(steps: list[Step]) -> dict[str, Value]:
    """The values of all steps; of two with one name the later."""
    return {name: value for step in steps for name, value in step.values.items()}


def document(text: str, drive: Drive, steps: list[Step]) -> str:
    """The drive file's text with the measured values; each line says the uncertainty and the old value."""
    file, values = tomlkit.parse(text), all_values(steps)
    for section, key, name in KEYS:
        table = file.setdefault(section, tomlkit.table())
        value, found = getattr(getattr(drive, section), key), values.get(name)
        why = "measured" if found is None else f"measured, +-{found.sigma:.2g} {found.unit} (1 sigma)"
        if isinstance(value, tuple):
            new = [float(f"{v:.7g}") for v in value]
        else:
            new = value if isinstance(value, bool) else float(f"{_digits(value, found)}")
        _put(table, key, new, why)
    for key in STALE:
        if key in file.get("control", {}):
            old = file["control"].pop(key)
            file["control"].add(tomlkit.comment(f"{key} was {old}: now from the bandwidth and the measured values"))
    for step in steps:
        if step.name == "current scale":
            file["sensors"].add(tomlkit.comment(toml_comment(f"scale of the currents: {step.said}")))
    loss = values.get("v_dead")
    if loss is not None:
        text = f"measured: each leg loses {loss.value:.4g} +-{loss.sigma:.2g} V (dead time and devices)"
        file["inverter"].add(tomlkit.comment(text))
    return tomlkit.dumps(file)


def _digits(value: float, found: Value | None) -> str:
    """Two digits more than the uncertainty has, at least four, at most nine."""
    if found is None or not found.sigma > 0.0 or value == 0.0:
        return f"{value:.6g}"
    return f"{value:.{min(max(math.ceil(math.log10(abs(value) / found.sigma)) + 2, 4), 9)}g}"


def _put(table, key: str, value, why: str) -> None:
    """One key with a comment; the comment that was there stays behind it."""
    old, note = table.get(key), ""
    if hasattr(old, "trivia"):
        note = old.trivia.comment.lstrip("# ")
    item = tomlkit.item(value)
    words = [why] if old is None else [why, f"was {' '.join(old.as_string().split())}"]
    item.comment(toml_comment("; ".join([*words, *([note] if note else [])])))
    table[key] = item


def data(name: str, status: str, reason: str, steps: list[Step], seconds: float) -> dict:
    """commission.json: status accepted or refused, the reason, each step with its values."""
    return {
        "schema": SCHEMA,
        "drive": name,
        "status": status,
        "reason": reason,
        "seconds": round(seconds, 3),
        "steps": [
            {
                "name": step.name,
                "said": step.said,
                "values": {
                    key: {"value": _number(v.value), "sigma": _number(v.sigma), "unit": v.unit}
                    for key, v in step.values.items()
                },
                "notes": {key: _plain(note) for key, note in step.notes.items()},
            }
            for step in steps
        ],
    }


def _number(value: float) -> float:
    return float(f"{float(value):.8g}")


def _plain(note):
    if isinstance(note, dict):
        return {key: _plain(part) for key, part in note.items()}
    if isinstance(note, (list, tuple)):
        return [_plain(part) for part in note]
    return note if isinstance(note, (bool, str)) else _number(note)
