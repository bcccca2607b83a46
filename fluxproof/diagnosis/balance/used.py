# SPDX-License-Identifier: BSD-3-Clause
"""What share of a recording the balance compares, and why not the rest: a finding where it is less than half."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import Problem, Recording

STEADY, USED = "rows_steady", "rows_used"  # in the meta data of a recording, once it is cut
MOSTLY = 0.5  # of the rows: where fewer are compared, it is told why
TOLD = 0.005  # of the rows: a smaller part is not told


def count_rows(recording: Recording, steady, used) -> None:
    """Remember how many rows are steady, and how many of them are compared."""
    recording.meta[STEADY], recording.meta[USED] = int(steady), int(used)


def little_used(recordings: list[Recording]) -> tuple[Problem, ...]:
    """The finding that less than half of the rows are compared; () if more are, or if they were not cut."""
    cut = [r for r in recordings if USED in r.meta]
    rows, used = sum(map(len, cut)), sum(r.meta[USED] for r in cut)
    if used >= MOSTLY * rows:
        return ()
    usable = sum(int(np.count_nonzero(r.usable)) for r in cut)
    steady = min(sum(r.meta[STEADY] for r in cut), usable)
    parts = {
        "where current, speed or voltage change or a stretch is short": usable - steady,
        "set aside by the checks": rows - usable,
        "of operating points that are held long or repeated": steady - used,
    }
    rest = [f"{_percent(n, rows)} {why}" for why, n in parts.items() if n > TOLD * rows]
    says = f"the answer rests on {_percent(used, rows)} of the rows ({used} of {rows})"
    return (Problem("little_used", says, count=rows - used, action=f"not compared: {', '.join(rest)}"),)


def _percent(n, rows) -> str:
    return f"{100.0 * n / rows:.2g} %"
