# SPDX-License-Identifier: BSD-3-Clause
"""Phase currents that do not sum to zero: sensor offsets and gains, which the diagnosis identifies.

Small sums are noted and not corrected.  A sum as large as the currents is no sensor error: one of the channels is a
different signal.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.ground.recording import Problem

STAGE = "signals"
NOTED = 0.002  # of rated current
LARGE = 0.25  # of the currents' own rms


def check(recording, nominal) -> None:
    if not recording.has("i_a", "i_b", "i_c"):
        return
    good = recording.usable
    if not good.any():
        return
    currents = np.stack([recording[name] for name in ("i_a", "i_b", "i_c")])[:, good]
    total = currents.sum(axis=0)
    rated = nominal.machine.rated_current_a
    mean = float(total.mean())
    spread = float(np.sqrt(np.mean((total - mean) ** 2)))
    size = float(np.sqrt(np.mean(currents**2)))
    if max(abs(mean), spread) > LARGE * size and max(abs(mean), spread) > 0.1 * rated:
        row = int(np.flatnonzero(good)[np.argmax(np.abs(total))])
        message = f"phase currents sum to {mean:.3g} A on average and {spread:.3g} A rms around it"
        recording.problems.append(
            Problem(
                "current_sum",
                message,
                "i_c",
                row,
                int(good.sum()),
                "not corrected; the diagnosis identifies sensor errors",
            )
        )
    elif max(abs(mean), spread) > NOTED * rated:
        recording.meta["notes"].append(
            f"phase currents sum to {mean:.3g} A on average, {spread:.3g} A rms around it: sensor offsets and gains"
        )
