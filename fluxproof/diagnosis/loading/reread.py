# SPDX-License-Identifier: BSD-3-Clause
"""Whether a recording that was read again with another sample time or other pole pairs is read rightly.

With duties the balance needs the angle alone, which the pole pairs do not change if it is electrical: they are told
only where angle and speed agree with them and disagreed before.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.checks.balance import FIT, discriminates, misfit, rows_of
from fluxproof.diagnosis.conventions.restated import AGREES

FITS = 0.02  # of the voltage: largest misfit of a recording that is read rightly, whatever effect the drive has
VISIBLE = 3.0  # times FITS: what one sample time of delay must change, in rad, to be noticed
CODES = ("sample_time", "angle_speed", "no_fit", "slow_sampling")


def doubtful(recording) -> bool:
    """Whether the checks found what a wrong sample time or wrong pole pairs cause."""
    return any(p.code in CODES for p in recording.problems) and not recording.points


def fits(recording, nominal, restated) -> bool:
    """Whether a recording, as read with a restated drive file, is met by it and would show another reading."""
    if recording.fatal or recording.slow or recording.points:
        return False
    rows = rows_of(recording, nominal)
    if rows is not None and (rows.steady or not discriminates(rows)):
        rows = None  # it does not tell readings apart
    if restated.key == "pole_pairs":
        ratio = angle_speed_ratio(recording, nominal.sample_time_s)
        if "angle_speed" in recording.meta or ratio is None or abs(ratio - 1.0) > AGREES:
            return False
        # The angle of an EMF run is that of its voltages; else any effect may be left, as the ratio is the evidence.
        return "inverter" in recording.lacks or (rows is not None and misfit(rows) < FIT)
    if rows is None:
        return False
    turn = float(np.percentile(np.abs(rows.omega), 75)) * nominal.sample_time_s
    return turn > VISIBLE * FITS and misfit(rows) < FITS
