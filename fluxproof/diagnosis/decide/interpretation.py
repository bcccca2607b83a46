# SPDX-License-Identifier: BSD-3-Clause
"""Whether it is asserted that recording or drive file mean something else than documented: if that explains enough.

interpret/ judges which interpretation the data prefer, and whether it is a mistake and no coincidence.
"""

from __future__ import annotations

import math
from dataclasses import replace

from fluxproof.diagnosis.decide.decision import Decision
from fluxproof.diagnosis.decide.verdict import kind_as_interpreted
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import Evidence, Fit, Remainder

OF_THE_REST = ("after", "noise", "spectrum_after")  # arrays of the evidence in true volts


def under(readings, rivals, documented: Decision, found: Decision, level: float) -> Decision:
    """``found``, decided with the readings, as a decision on the recording as it is; level: rms of its voltage [V].

    ``documented`` if they explain less than half of the misfit, or so little of it that what is left may imitate them.
    Voltages are those of the recording: where the bus is recorded at half, the residual is given in recorded volts.
    readings: tuple of Reading; rivals: list of those that fit as well as the only one.  documented: the decision
    without readings, for the misfit before.
    """
    volts = 1.0
    for reading in readings:
        volts *= reading.volts
    fit = _fit(documented.fit, found.fit, volts)
    remainder = tuple(_recorded(part, volts) for part in found.remainder)
    kind = kind_as_interpreted(found.verdict, fit.explained_share, remainder)
    if kind == "unexplained" or _imitated(fit, level) > k.DOUBTED:
        return replace(documented, hinted=readings)
    return replace(
        found,
        verdict=kind,
        location=documented.location,
        fit=fit,
        explained_share=fit.explained_share,
        remainder=remainder,
        best_fit=None,
        conventions=tuple(r.told(rivals) for r in readings),
        readings=readings,
        evidence=_evidence(documented.evidence, found.evidence, volts),
    )


def _imitated(fit: Fit, level: float) -> float:
    """The probability that something unknown, of which much is left, imitates an interpretation (credibility.py).

    A recording in other units leaves a misfit that is nearly all of the simulation's voltage: no more than the recorded
    ``level`` counts as explained.  Two factors that left 14 of 42 V were told of a mirrored frame, which is neither.
    """
    left2 = max(fit.holdout_after**2 - fit.noise_floor**2, 0.0)
    explained2 = max(min(fit.holdout_before, level) ** 2 - fit.holdout_after**2, 0.0)
    return math.exp(-explained2 / (2.0 * k.IMITATION**2 * left2)) if left2 else 0.0


def restated(decision: Decision, changed) -> Decision:
    """The decision with a key of the drive file that had to be changed for the recording to be usable at all.

    changed: conventions.restated.Restated, or None.
    """
    if changed is None or decision.basis is None:
        return decision
    return replace(
        decision,
        verdict="explained" if decision.verdict == "no_mismatch" else decision.verdict,
        readings=(changed, *decision.readings),
        conventions=(changed.told(), *decision.conventions),
    )


def _fit(documented: Fit, found: Fit, volts) -> Fit:
    """The misfit before as documented, and after in recorded volts."""
    return replace(
        documented,
        train_after=found.train_after / volts,
        holdout_after=found.holdout_after / volts,
        noise_floor=found.noise_floor / volts,
    )


def _recorded(part: Remainder, volts) -> Remainder:
    return replace(part, size=part.size / volts) if part.unit == "V" else part


def _evidence(documented: Evidence, found: Evidence, volts) -> Evidence:
    """The arrays of ``found`` with the misfit before as documented, the rest in recorded volts."""
    arrays, old = dict(found.arrays), documented.arrays
    for name, values in found.arrays.items():
        if name.startswith(("before", "spectrum_before")) and name in old:
            arrays[name] = old[name]
        elif name.startswith(OF_THE_REST):
            arrays[name] = values / volts
    return replace(found, arrays=arrays)
