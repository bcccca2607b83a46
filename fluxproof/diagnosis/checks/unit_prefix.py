# SPDX-License-Identifier: BSD-3-Clause
"""Currents whose unit is off by a prefix, of a size that no comparison with the nameplate tells: milliamps for amperes.

A current that is a thousandth leaves its whole effect on the voltage, as other causes might.  It is a prefix if the
nominal balance at large currents is not met as the file says and is met with the prefix, and worse without any current:
a prefix that makes the currents vanish is confirmed by nothing.  The recording is refused, since the file states the
one and the voltages need the other.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.balance import BETTER, FIT, SteadyRows, discriminates, misfit, rows_of
from fluxproof.diagnosis.conventions.units import PREFIXES
from fluxproof.diagnosis.ground.recording import Problem

STAGE = "channels"
VANISHING = 1e-12  # times the currents: none, and still the same rows with the largest ones
NAMES = ("i_a", "i_b", "i_c", "i_d", "i_q")


def check(recording, nominal) -> None:
    rows = rows_of(recording, nominal)
    if rows is None or not discriminates(rows):
        return
    as_is = misfit(rows, at_current=True)
    if as_is < FIT:
        return
    names = [name for name in NAMES if name in recording.columns and name in recording.meta.get("columns", {name: 0})]
    if not names:
        return
    name, machine = names[0], nominal.machine
    reaches = max(float(np.nanmax(np.abs(recording[n]))) for n in names)
    tried = {factor: misfit(_scaled(rows, factor), at_current=True) for factor in PREFIXES}
    best = min(tried, key=tried.__getitem__)
    without = misfit(_scaled(rows, VANISHING), at_current=True)
    if tried[best] > min(BETTER * as_is, BETTER * without, FIT):
        return
    stated = "as documented" if name in recording.meta.get("documented_units", ()) else "without a stated unit"
    message = (
        f"{', '.join(names)} reach {reaches:.3g} A {stated}, and rated_current_a = {machine.rated_current_a:g} A; "
        f"voltage and nameplate need {best:g} times these currents (misfit {as_is:.0%} of the voltage, "
        f"{tried[best]:.0%} with them): correct the unit of these columns, or the drive file"
    )
    recording.problems.append(Problem("unit", message, name, 0, len(recording), fatal=True))


def _scaled(rows, factor):
    """The rows with currents multiplied by a factor."""
    return rows.change(dq=rows.dq * factor) if isinstance(rows, SteadyRows) else rows.with_currents(rows.i * factor)
