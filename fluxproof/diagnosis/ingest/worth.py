# SPDX-License-Identifier: BSD-3-Clause
"""What a refused file would need: where it belongs, what each missing column would add, the nearest kind that would do.

The kinds are those of docs/recordings.md section 2.
"""

from __future__ import annotations

import re

from fluxproof.diagnosis.ground.recording import COLUMNS
from fluxproof.diagnosis.ingest.demand import COMMANDED, CURRENTS
from fluxproof.quote import shown

MOST_CHANNELS = 4
FLUX = re.compile(r"(psi|lambda|flux)[ _]?[dq]([ _(\[].*)?", re.I)
TORQUE = re.compile(r"torque|drehmoment|\bN[ .*]?mm?\b", re.I)
MAP = (
    ". These are the columns of a flux map, which belongs to the drive and is no recording: name the file in the drive "
    'file, [plant.machine] flux_map = "FILE", with the columns i_d_a, i_q_a, psi_d_wb, psi_q_wb'
)
MATRICES = (
    ". Matrices over two axes are read with a vector for each axis if these have different lengths, else with both "
    "axes as matrices too ([i_q, omega_e] = meshgrid(...)), or as a table with one row per operating point"
)
NO_NAMES = (
    ". The columns have no names: a log needs a header, or [columns] with their numbers; a matrix over speed and "
    "current must be written as a table, one row per operating point: i_d, i_q, u_d_ref, u_q_ref, omega_e"
)
DYNO = (
    ". Without voltages torque, i_q and omega_e (a dyno sheet) give flux and friction; the control's u_q_ref would "
    "add R and a scale of the currents, u_d_ref also inductances and the angle"
)
VOLTAGES = (
    ". The control's u_q_ref alone would show R and flux, u_d_ref in addition inductances and the angle; nearest kind "
    "without voltages: a dyno sheet (torque, i_q, omega_e), which shows flux and friction"
)
AXIS = ". {} would show L_{} and the angle; if it was constant, give its value in [constants], such as i_d = 0"
ANGLE = (
    ". omega_e would show steady effects, theta_e in addition harmonics and the inverter's loss at standstill; nearest "
    "kind: a slow log or a table of operating points with omega_e"
)
UNNAMED = (
    ". {} may be terminal voltages of a machine that is turned without current (an EMF run): then the command needs {}"
)
CHANNEL = re.compile(r"(ch|channel|c|dev\d+[_/]ai|ai|probe)?[ _]?\d+|channel [a-d]", re.I)
SCOPE = (
    ". {} are channels of an instrument: state which signal each has, as an EMF run of a machine that is turned "
    "without current (--column {}), or currents and duties of the control with the angle"
)
PROBES = {1: ("u_ab",), 2: ("u_ab", "u_bc"), 3: ("u_a", "u_b", "u_c")}
LITTLE = (
    ". Quantities of the supply alone show nothing of the machine; nearest kinds: a table (i_d, i_q, u_q_ref, "
    "omega_e), a dyno sheet (torque, i_q, omega_e), an EMF run without current (t, u_ab)"
)


def worth(missing: list[str], names: dict[str, str], have: set[str], taken=()) -> str:
    """The end of a refusal; names: columns of the file with units; have: canonical columns, found in those taken."""
    if sum(bool(FLUX.fullmatch(name)) for name in names) >= 2:
        return MAP
    if sum(name.endswith("[1]") and name[:-3] in COLUMNS for name in names) >= 2:
        return MATRICES
    if names and all(name.isdigit() for name in names):
        return NO_NAMES
    lacks_voltages = any(text.startswith("voltages") for text in missing)
    if lacks_voltages and any(TORQUE.search(f"{name} {unit}") for name, unit in names.items()):
        return DYNO
    if not CURRENTS & have:
        left = [name for name in names if name not in taken]
        if have == {"t"} and len(left) in PROBES:
            return _unnamed(left)
        channels = [shown(name) for name in left if CHANNEL.fullmatch(name)]
        if channels and not have - {"t"}:
            return SCOPE.format(", ".join(channels[:MOST_CHANNELS]), shown(f"{channels[0]}=u_ab"))
        return "" if COMMANDED & have else LITTLE
    if lacks_voltages:
        return VOLTAGES
    axis = next((text for text in missing if text in ("i_d", "i_q")), None)
    if axis:
        return AXIS.format(axis, axis[-1])
    return ANGLE if any("theta_e" in text for text in missing) else ""


def _unnamed(left: list[str]) -> str:
    """How an EMF run is told whose columns have names of an instrument, "Dev1_ai0"."""
    options = " ".join(f"--column {shown(f'{n}={u}')!r}" for n, u in zip(left, PROBES[len(left)], strict=True))
    one = "; =u_a of a phase" if len(left) == 1 else ""
    return UNNAMED.format(" and ".join(repr(shown(name)) for name in left), f"{options}{one}")
