# SPDX-License-Identifier: BSD-3-Clause
"""Phase currents that are the codes of a converter, whose middle is zero current: they need factor and offset.

The three share a mean that is far from zero and larger than their swing; currents of a machine have none.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import Problem

STAGE = "units"
SAME = 0.1  # of the mean: how near those of the phases are


def check(recording, nominal) -> None:
    names = [c for c in ("i_a", "i_b", "i_c") if c in recording.columns]
    if len(names) < 2 or recording.points:
        return
    values = np.stack([recording[c] for c in names])
    middle = np.median(values, axis=1)
    swing = np.percentile(np.abs(values - middle[:, None]), 98, axis=1)
    same = np.ptp(middle) < SAME * abs(middle.mean())
    if not same or abs(middle.mean()) < max(swing.max(), nominal.machine.rated_current_a):
        return
    message = (
        f"{', '.join(names)} lie around {middle.mean():.6g}, their unit is not ampere: they look like codes of a "
        "converter; give factor and offset in [columns]"
    )
    recording.problems.append(Problem("unit", message, names[0], 0, len(recording), fatal=True))
