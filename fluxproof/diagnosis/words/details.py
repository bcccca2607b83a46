# SPDX-License-Identifier: BSD-3-Clause
"""The figures behind the headline."""

from __future__ import annotations

from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.words.best_fit import left_by_best
from fluxproof.diagnosis.words.phrases import CORRECTED, as_if, capital, part_text, percent_below, said

TOLD = (
    "gates_off",
    "stuck",
    "late",
    "lost_rows",
    "torque_lost",
    "little_used",
)  # codes of findings without which the figures cannot be read
UNUSED = "rows not used"


def details(answer, sentence, effects) -> str:
    """The figures behind the headline: every parameter that is not in ``sentence``, the misfit at held-out points."""
    fit, parts = answer.fit, []
    if answer.verdict in ("bad_recording", "digital_mismatch"):
        return ""
    full = f"{capital('; '.join(said(e, effects) for e in answer.effects))}."
    if answer.effects and full != sentence:
        parts.append(full)
    volts = lambda x: ascii_of(quantity(x, fit.unit, 3))  # noqa: E731
    if answer.alternatives:
        parts.append(f"If it is one alone: {'; '.join(said(e, effects) for e in answer.alternatives)}.")
    if fit.holdout_before > 0.0:
        both = f"falls from {volts(fit.holdout_before)} to {volts(fit.holdout_after)}"
        found = bool(answer.effects or answer.ambiguity or answer.conventions)
        fall = both if found and fit.holdout_after < fit.holdout_before else f"is {volts(fit.holdout_before)}"
        floor = f"the noise floor is {volts(fit.noise_floor)}"
        parts.append(f"The misfit at held-out operating points {fall}; {floor}.")
        if answer.best_fit is not None:
            parts.append(left_by_best(answer))
        if answer.verdict == "explained" and fit.holdout_after > k.MUCH_LEFT * fit.noise_floor:
            times = f"{fit.holdout_after / fit.noise_floor:.2g} times the noise floor"
            why = "a formula is inexact for this drive, or a small effect is missing"
            parts.append(f"The remaining residual is {times}: {why}.")
    if answer.explained_share is not None and answer.effects:
        parts.append(f"The effects explain {percent_below(answer.explained_share)} of its power.")
    u = answer.unknown_term
    if u is not None and u.meaning:
        cause = as_if(u).removeprefix("as if ")
        parts.append(f"That {cause} would explain {percent_below(u.explains)} of the residual.")
    read = [p.message for p in answer.problems if p.action in CORRECTED]
    if read:
        parts.append(f"Corrected while reading: {'; '.join(read)}.")
    for p in answer.problems:
        if p.code in TOLD and not p.fatal:
            rows = f" ({p.count} rows not used)" if p.action == UNUSED else f" ({p.action})"
            parts.append(f"{capital(p.located() if p.code == 'stuck' else p.message)}{rows}.")
    if len(answer.remainder) > 1:
        parts.append(f"The largest residuals are {', '.join(part_text(r) for r in answer.remainder[:3])}.")
    return " ".join(parts)
