# SPDX-License-Identifier: BSD-3-Clause
"""A recording in canonical form: SI units, peak values, one row per control sample or per operating point.

Canonical columns (only ``t`` is required here; columns.py checks what a balance needs):

    t                    s      sampling instant
    i_a i_b i_c          A      phase currents, or i_d i_q (dq, d axis at theta_e)
    theta_e              rad    electrical angle of the d axis, wrapped or not
    omega_e              rad/s  electrical speed
    u_dc                 V
    d_a d_b d_c          1      duties computed from this row's samples, in force
                                duty_applied_after_samples periods later; or u_d_ref u_q_ref [V]
    i_d_ref i_q_ref      A
    temp_winding         degC
    torque               Nm     at the shaft, positive with positive speed when motoring
    u_a u_b u_c          V      measured at the terminals of a machine without current (EMF run), or u_ab u_bc u_ca
    fault enable         1      of the inverter: its gates are off where fault is not 0 or enable is 0
    u_line i_line p_el   V A W  amplitudes and power of a power analyser, in a table with i_d_ref i_q_ref or i_d i_q
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fluxproof.quote import escaped

COLUMNS = {
    "t": "s",
    "i_a": "A",
    "i_b": "A",
    "i_c": "A",
    "i_d": "A",
    "i_q": "A",
    "theta_e": "rad",
    "omega_e": "rad/s",
    "u_dc": "V",
    "d_a": "1",
    "d_b": "1",
    "d_c": "1",
    "u_d_ref": "V",
    "u_q_ref": "V",
    "i_d_ref": "A",
    "i_q_ref": "A",
    "temp_winding": "degC",
    "torque": "Nm",
    "u_a": "V",
    "u_b": "V",
    "u_c": "V",
    "u_ab": "V",
    "u_bc": "V",
    "u_ca": "V",
    "u_line": "V",
    "i_line": "A",
    "p_el": "W",
    "fault": "1",
    "enable": "1",
}


class RecordingError(ValueError):
    """Unusable input; the message is one line with the file, the line or column, and what was expected.

    What a terminal or UTF-8 cannot show, as in some names of files, is escaped.
    """

    def __init__(self, message: object = ""):
        super().__init__(escaped(message))


@dataclass(frozen=True)
class Problem:
    """One finding of the checks.  ``fatal``: no diagnosis is possible; else ``action`` states the correction."""

    code: str  # stable, lower_snake_case: gap, duplicate, clipped, stuck, unit, swapped_phases, current_sum, ...
    message: str
    column: str = ""
    row: int = -1  # first row concerned, 0-based in the recording; -1: the whole column
    count: int = 0  # rows concerned
    action: str = ""
    fatal: bool = False

    def located(self) -> str:
        """The message with its column and first row, as far as they are known and it does not name them itself."""
        where = f"column {self.column}: " if self.column and self.column not in self.message else ""
        return f"{where}{self.message}{f' (from row {self.row})' if self.row > 0 else ''}"


@dataclass
class Recording:
    """Canonical arrays of one recording, float64, shape (n,), and what the checks found.

    ``usable``: bool (n,), False on rows that must not enter a balance (clipped, stuck, repaired).
    ``joined``: bool (n,), True where row k+1 follows row k after one sample time; the last is False.
    ``slow``: sampled too slowly for a balance between samples; only steady operating points are used.
    ``points``: every row is one operating point (``slow`` too); ``t`` is a row number if "time" is in ``lacks``.
    ``lacks``: what the recording cannot show, of the words in effect.NEEDS.
    ``meta``: further contents of the file, such as registers and raw codes of a telemetry dump.
    ``checked``: diagnosis/checks has judged it, as it does every file that is read.
    """

    source: str
    columns: dict[str, np.ndarray]
    usable: np.ndarray
    joined: np.ndarray
    slow: bool = False
    points: bool = False
    lacks: frozenset = frozenset()
    problems: list[Problem] = field(default_factory=list)
    meta: dict = field(default_factory=dict)
    checked: bool = False

    def __len__(self) -> int:
        return len(self.columns["t"])

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    def has(self, *names: str) -> bool:
        """Whether all named columns are present."""
        return all(name in self.columns for name in names)

    @property
    def fatal(self) -> bool:
        return any(problem.fatal for problem in self.problems)


def from_columns(columns: dict[str, np.ndarray], sample_time_s: float, source: str = "arrays") -> Recording:
    """A recording from arrays (n,) in canonical form; RecordingError where the lengths differ.

    Here only lengths and gaps in time are checked; ``diagnose`` judges the values as it does those of a file.
    """
    arrays = {name: np.ascontiguousarray(values, dtype=float) for name, values in columns.items()}
    n = {name: len(values) for name, values in arrays.items()}
    if "t" not in arrays or len(set(n.values())) != 1:
        raise RecordingError(f"{source}: columns of one length with a column t are needed, got {n}")
    step = np.diff(arrays["t"])
    joined = np.append(np.abs(step - sample_time_s) < 0.25 * sample_time_s, False)
    return Recording(source, arrays, np.ones(len(arrays["t"]), bool), joined)
