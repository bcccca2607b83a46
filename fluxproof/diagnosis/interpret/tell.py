# SPDX-License-Identifier: BSD-3-Clause
"""The answer under the readings that the data prefer, with the misfit as it was documented."""

from __future__ import annotations

from fluxproof.diagnosis.answer.headline import sentence
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.conventions.reading import Reading
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import Diagnosis
from fluxproof.diagnosis.suspects import SUSPECTS

OF_THE_REST = ("after", "noise", "spectrum_after")  # arrays of the evidence in true volts


def under(readings, rivals, documented: Diagnosis, answer: Diagnosis, level: float) -> Diagnosis:
    """``answer``, found with the readings, as an answer to the recording as it is; level: rms of its voltage [V].

    ``documented`` if nothing is explained with them: they must explain half of the misfit and of the voltage, as a
    recording in other units leaves a misfit that is nearly all of the simulation's voltage.
    Voltages are those of the recording: where the bus is recorded at half, the residual is given in recorded volts.
    readings: tuple of Reading; rivals: list of those that fit as well as the only one.  documented: the answer without
    readings, for the misfit before.
    """
    volts = 1.0
    for reading in readings:
        volts *= reading.volts
    fit, before = answer.fit, documented.fit
    for name in ("train_after", "holdout_after", "noise_floor"):
        setattr(fit, name, getattr(fit, name) / volts)
    for part in answer.remainder:
        part.size /= volts if part.unit == "V" else 1.0
    fit.train_before, fit.holdout_before = before.train_before, before.holdout_before
    answer.explained_share = fit.explained_share
    if answer.verdict == "no_mismatch":
        answer.verdict = "explained"
    elif answer.verdict == "unexplained" and answer.remainder and answer.explained_share >= k.HALF:
        answer.verdict = "partly_explained"
    if answer.verdict == "unexplained" or fit.holdout_after**2 > k.HALF * level**2:
        return not_told(readings, documented)
    answer.readings, answer.conventions = readings, [r.told(rivals) for r in readings]
    answer.location = documented.location
    arrays, old = answer.evidence.arrays, documented.evidence.arrays
    for name in arrays:
        if name.startswith(("before", "spectrum_before")) and name in old:
            arrays[name] = old[name]
        elif name.startswith(OF_THE_REST):
            arrays[name] = arrays[name] / volts
    answer.sentence = sentence(answer, {**CATALOGUE, **SUSPECTS})
    return answer


def not_told(readings: tuple[Reading, ...], documented: Diagnosis) -> Diagnosis:
    """The answer without readings, with a note that they would fit better but leave a large residual."""
    says = "; ".join(r.says for r in readings)
    why = "would fit better, but a large residual remains, so this is only a hint"
    documented.notes.append(f"The interpretation that {says} {why}.")
    return documented


def restate(answer: Diagnosis, loaded) -> None:
    """Report a key of the drive file that had to be changed for the recording to be usable at all."""
    restated = loaded[0].meta.get("restated")
    if restated is None or answer.verdict == "bad_recording":
        return
    answer.readings = (restated, *answer.readings)
    answer.conventions = [restated.told(), *answer.conventions]
    if answer.verdict == "no_mismatch":
        answer.verdict = "explained"
    answer.sentence = sentence(answer, {**CATALOGUE, **SUSPECTS})
