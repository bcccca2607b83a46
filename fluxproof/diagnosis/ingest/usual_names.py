# SPDX-License-Identifier: BSD-3-Clause
"""Usual names of the canonical columns, as test benches and controllers write them.

A name counts in lower case, with "_" for spaces and dashes, by the last part of a path in a model ("Model
Root/Current control/i_a").  Its unit may stand at its end ("id_mA", "n_rpm").  Where the name is that of a channel and
brackets hold the signal ("Channel A (U_U)"), the signal counts.  Names that may be of something else ("p", "i") count
only with a unit that tells what they are.  Names in words, and those of speed, torque and temperature: words.py.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from fluxproof.diagnosis.ingest.units import COMMANDED, FACTORS, OF_BUS, conversion, split_unit
from fluxproof.diagnosis.ingest.words import PHASES, in_words, is_unit

LINES = {"ab": ("ab", "uv"), "bc": ("bc", "vw"), "ca": ("ca", "wu")}
MEASURED = ("", "_meas", "_measured", "_act", "_actual", "_ist")
REFERENCE = ("_ref", "ref", "_reference", "_set", "_setpoint", "_soll", "_cmd", "_command")


def _written(letters: Iterable[str], parts: Iterable[str], endings: Iterable[str] = ("",)) -> tuple[str, ...]:
    """Names of a letter, a part and an ending, such as "i_u", "iu" and "id_ref"."""
    return tuple(f"{x}{gap}{p}{end}" for p in parts for x in letters for gap in ("_", "") for end in endings)


# The usual names of every column; of two columns with names of one signal, the one that stands first counts.
NAMES: dict[str, tuple[str, ...]] = {
    "t": (
        "t",
        "time",
        "timestamp",
        "time_stamp",
        "zeit",
        "datetime",
        "date_time",
        "elapsed",
        "elapsed_time",
        "x_value",
    ),
    "theta_e": ("theta_e", "theta_el", "theta_elec", "phi_el"),
    "omega_e": ("omega_e", "omega_el", "omega_elec"),
    "u_dc": ("u_dc", "udc", "v_dc", "vdc", *_written("uv", ("bus", "bat", "zk", "dclink")), "dc_bus", "bus_voltage"),
    "torque": ("torque",),
    "temp_winding": ("temp_winding",),
    "fault": ("fault", "fault_code", "faults", "error_code", "err_code"),
    "enable": ("enable", "enabled", "pwm_enable", "pwm_on", "gate_enable", "gates_on", "drive_enabled"),
}
for _phase, _marks in PHASES.items():
    NAMES[f"i_{_phase}"] = (*_written("i", _marks), *(f"current_{m}" for m in _marks))
    NAMES[f"d_{_phase}"] = (f"d_{_phase}", *(f"duty_{m}" for m in _marks), *(f"d_{m}" for m in _marks[1:]))
    NAMES[f"u_{_phase}"] = tuple(f"{x}_{m}" for m in _marks for x in "uv")
for _line, _marks in LINES.items():
    NAMES[f"u_{_line}"] = _written("uv", _marks)
for _axis in "dq":
    NAMES[f"i_{_axis}"] = _written("i", _axis, MEASURED)
    NAMES[f"i_{_axis}_ref"] = _written("i", _axis, REFERENCE)
    NAMES[f"u_{_axis}_ref"] = _written("uv", _axis, (*REFERENCE, ""))

# Names that count only with one of these units.
TOLD_BY_UNIT = {
    "t": (("x", "x_axis", "xaxis"), set(FACTORS["s"])),
    "omega_e": (("f_el", "f_elec", "fe", "elec_freq", "electrical_frequency"), {"Hz"}),
    "u_line": (("u_ll", "u1_ll", "u_ll_rms", "u_l_l", "urms_ll", "u_line"), {"V rms", "V_rms", "Vrms"}),
    "i_line": (("i", "i1", "i_rms", "irms", "i_line", "i_phase"), {"A rms", "A_rms", "Arms"}),
    "p_el": (("p_el", "p_elec", "p_electric", "p1", "p"), set(FACTORS["W"])),
}  # fmt: skip

KNOWN = {name: (canonical, rank) for canonical, names in NAMES.items() for rank, name in enumerate(names)}
TOLD = {
    name: (canonical, len(NAMES.get(canonical, ())) + rank)
    for canonical, (names, _) in TOLD_BY_UNIT.items()
    for rank, name in enumerate(names)
}


def usual(column: str, unit: str) -> tuple[str, str, int] | None:
    """(canonical column, unit as written or "", rank among its names) of a file's column, or None.

    unit: of a line of units or a field of the format, "" if there is none.
    """
    name, brackets = split_unit(column)
    found = _of(name, unit or brackets)
    if found is not None and is_of_another_quantity(found[0], unit or brackets):
        return None  # "DC bus [A]" is no voltage
    if found is None and brackets and brackets not in OF_BUS and not is_unit(brackets):
        found = _of(brackets, unit)
    return found or in_words(column, unit)


def is_of_another_quantity(canonical: str, unit: str) -> bool:
    """Whether a unit is none of a canonical column's, and one of something else."""
    known = conversion(canonical, unit, 1) is not None or (canonical in COMMANDED and unit in OF_BUS)
    return bool(unit) and not known and any(unit in units for of, units in FACTORS.items() if of != "1")


def _of(name: str, unit: str) -> tuple[str, str, int] | None:
    label = re.sub(r"[\s-]+", "_", re.split(r"[./]", name.strip(' ."'))[-1])
    key = label.lower()
    if key in KNOWN:
        canonical, rank = KNOWN[key]
        return canonical, unit, rank
    parts = label.split("_")
    if not unit and parts[0] and key not in TOLD:
        for last in (2, 1):  # "rad_s" before "s"
            stem, ending = "_".join(parts[:-last]).lower(), "_".join(parts[-last:])
            if stem in KNOWN and conversion(KNOWN[stem][0], ending, 1) is not None:
                return KNOWN[stem][0], ending, KNOWN[stem][1]
        key, unit = stem, ending
    if key not in TOLD:
        return None
    canonical, rank = TOLD[key]
    return (canonical, unit, rank) if _alike(unit, TOLD_BY_UNIT[canonical][1]) else None


def _alike(unit: str, units: set[str]) -> bool:
    """Whether a unit is one of ``units``, whose words may be in any case."""
    return unit.lower() in {u.lower() for u in units}
