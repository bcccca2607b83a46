# SPDX-License-Identifier: BSD-3-Clause
"""Which instance of rtl/fluxproof.vhd belongs to which row of the report; every one to exactly one.

The rows are those of paper 001, Table 1, and three of our own.  What a block is there for decides, not the
folder it is in: chord_speed serves the decoupling, dead_time_compensation the inverter estimators.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from fluxproof.checkout import RTL

CORE = "fluxproof"
AXI_TOP = "fluxproof_axi"

GROUPS: dict[str, tuple[str, ...]] = {
    # paper 001: voltage and current model merged, delta_lambda and its PI; torque from the estimated flux
    "flux_estimator": (
        "resistance",
        "period_voltage",
        "magnetic_model",
        "model_flux",
        "merge",
        "merged_flux",
        "models",
        "flux",
        "speed_inverse",
        "flux_error",
        "compensation",
        "torque_estimate",
        "monitor",
        "residual",
    ),
    # transforms, speed and current regulators, decoupling, limit of the voltage, delay compensation
    "field_oriented_control": (
        "speed_measurement",
        "stator_frame",
        "trig",
        "rotor_frame",
        "current_circle",
        "flux_circle",
        "voltage_regulator",
        "ramp",
        "references",
        "map_correction",
        "table_current",
        "position_regulator",
        "trajectory",
        "master_gear",
        "modes",
        "beginnings",
        "ripple_answer",
        "ripple",
        "hexagon",
        "speed_regulator",
        "regeneration",
        "current_regulators",
        "chord",
        "cross_coupling",
        "delay",
        "circle",
        "stator_voltage",
    ),
    # raw codes to per unit, U_dc without a division, modulation, compare values, gates
    "io_svm": (
        "latch",
        "conditioning",
        "angle",
        "bus_voltage",
        "bus_reciprocal",
        "modulator",
        "compare",
        "charge",
        "gates",
    ),
    # paper 000: what dead time and drops take, its compensation, the magnets' flux
    "vsi_psi": (
        "inverter_loss",
        "magnet_flux",
        "towards",
        "directions",
        "leg_compensation",
        "compensation_dq",
        "direction_functions",
        "motor_voltage",
    ),
    # what no peer's figure has in it: limits of currents, bus, position and speed, watchdogs, memory of faults
    "protection": ("safety",),
}
OUTSIDE = "registers_telemetry"  # whatever fluxproof_axi holds beside the core
ROWS = (*GROUPS, OUTSIDE)
BETWEEN = "between_blocks"  # the core's own logic outside every block: a word from the top, hardly a gate
PLAIN_FOC = ("field_oriented_control", "io_svm")  # what every drive needs, with no estimator

_COMMENT = re.compile(r"--[^\n]*")
_GENERATE = re.compile(r"^\s*(\w+)\s*:\s*(?:if|for)\b.*\bgenerate\b")
_INSTANCE = re.compile(r"^\s*(\w+)\s*:\s*entity\s+work\.(\w+)", re.IGNORECASE | re.MULTILINE)


def instances(vhdl: Path) -> dict[str, str]:
    """{label: entity} of a file's instances, in lower case, in order."""
    found = _INSTANCE.findall(_COMMENT.sub("", vhdl.read_text()))
    return {label.lower(): entity.lower() for label, entity in found}


def netlist_names(vhdl: Path) -> dict[str, str]:
    """{label: name in the converted Verilog}: the labels of the generate blocks around an instance come first."""
    names, scopes = {}, []
    for line in _COMMENT.sub("", vhdl.read_text()).lower().splitlines():
        if begun := _GENERATE.match(line):
            scopes.append(f"{begun[1]}_")
        elif re.match(r"\s*end\s+generate", line):
            scopes.pop()
        elif found := _INSTANCE.match(line):
            names[found[1]] = "".join(scopes) + found[1]
    return names


def check(labels: Sequence[str], groups: Mapping[str, Sequence[str]] = GROUPS, where: str = f"rtl/{CORE}.vhd") -> None:
    """Raises ValueError unless ``groups`` holds every label exactly once and no other."""
    claimed = [label for members in groups.values() for label in members]
    problems = [f"{name} is in no group" for name in labels if name not in claimed]
    problems += [f"{name} is in a group and not in the file" for name in claimed if name not in labels]
    problems += [f"{name} is in two groups" for name in dict.fromkeys(claimed) if claimed.count(name) > 1]
    if problems:
        raise ValueError(f"{where} and GROUPS of scripts/synth/groups.py: " + "; ".join(problems))


def file_of(entity: str, rtl: Path = RTL) -> Path | None:
    """The entity's VHDL file, in whichever folder below ``rtl``; None where there is none."""
    return next(rtl.rglob(f"{entity}.vhd"), None)


def top_of(rtl: Path = RTL) -> str:
    """fluxproof_axi if its file exists, else the core."""
    return AXI_TOP if file_of(AXI_TOP, rtl) else CORE
