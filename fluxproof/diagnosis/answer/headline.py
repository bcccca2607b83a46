# SPDX-License-Identifier: BSD-3-Clause
"""The answer in words: a headline of at most two lines, and the figures below it.

Titles of effects and parameters are those that the effects declare.  Where a headline would be longer than
MOST_LETTERS letters, it says less of each effect, then of fewer effects; the whole is in ``details`` and in the table
of effects.
"""

from __future__ import annotations

import itertools

from fluxproof.diagnosis.answer.phrases import (
    CORRECTED,
    as_if,
    capital,
    corrected,
    joined,
    located,
    part_text,
    percent_below,
    said,
    title_of,
)
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.quantities import ascii_of, quantity

MOST_LETTERS = 200  # letters of a headline: two lines of a terminal or of the report


def sentence(answer, effects) -> str:
    """The verdict of an answer as a headline; effects: the catalogue."""
    variants = _variants(answer, effects)
    return next((text for text in variants if len(text) <= MOST_LETTERS), variants[-1])


def details(answer, effects) -> str:
    """The figures behind the headline: every parameter, and the misfit at points that were not fitted."""
    fit, parts = answer.fit, []
    if answer.verdict in ("bad_recording", "digital_mismatch"):
        return ""
    full = f"{capital('; '.join(said(e, effects) for e in answer.effects))}."
    if answer.effects and full != answer.sentence:
        parts.append(full)
    volts = lambda x: ascii_of(quantity(x, fit.unit, 3))  # noqa: E731
    if fit.holdout_before > 0.0:
        both = f"falls from {volts(fit.holdout_before)} to {volts(fit.holdout_after)}"
        found = bool(answer.effects or answer.ambiguity or answer.conventions)
        fall = both if found and fit.holdout_after < fit.holdout_before else f"is {volts(fit.holdout_before)}"
        floor = f"the noise floor is {volts(fit.noise_floor)}"
        parts.append(f"The misfit at held-out operating points {fall}; {floor}.")
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
    if len(answer.remainder) > 1:
        parts.append(f"The largest residuals are {', '.join(part_text(r) for r in answer.remainder[:3])}.")
    return " ".join(parts)


def _variants(answer, effects) -> list[str]:
    """The headline from the most detailed one to the shortest."""
    misfit = ascii_of(quantity(answer.fit.train_before, answer.fit.unit, 3))
    if answer.verdict == "no_mismatch":
        at_floor = answer.fit.train_before**2 <= (1.0 + k.FLOOR) * answer.fit.noise_floor**2
        usual = "is at the noise floor" if at_floor else "is within the usual error for this kind of recording"
        floor = f"the misfit of {misfit} {usual}"
        if found := corrected(answer):
            once = [joined(found), f"{found[0]}, and {len(found) - 1} more", "the columns are interpreted differently"]
            return [f"Simulation and recording agree once corrected: {what}. {capital(floor)}." for what in once]
        return [f"Simulation and recording agree: {floor}."]
    if answer.verdict == "explained":
        return [f"{capital(what)}." for what in _named(answer, effects)]
    named, sets = _named(answer, effects, brackets=True), _sets(answer.ambiguity, effects)
    if answer.verdict == "ambiguous":
        if not answer.effects:
            return [f"This recording cannot separate {group}." for group in sets]
        return [f"{capital(a)}; not separable: {b}." for a, b in _both(named, sets)]
    where, cause = located(answer), _cause(answer)
    if answer.verdict == "partly_explained":
        several = len(answer.effects) + len(answer.conventions) + len(answer.ambiguity) > 1
        verb = "explain" if several else "explains"
        share = f"{verb} {percent_below(answer.explained_share or 0.0)} of the misfit"
        if answer.ambiguity:
            one_of = [f"one of {group}" for group in sets]
            pairs = [f"{a}, with {b}," for a, b in _both(named, one_of)]
            names = [capital(n) for n in ([*pairs, f"{named[-1]} and others"] if answer.effects else one_of)]
        else:
            names = [capital(n) for n in named]
        return [f"{n} {share}; the residual is {where} and {c}." for n, c in _both(names, cause)]
    if answer.unknown_term is not None and answer.unknown_term.meaning:
        return [f"No parameter of the simulation explains the misfit of {misfit}: it {c}." for c in cause]
    return [f"Unknown: no effect of the catalogue explains half of the misfit of {misfit}, {where}."]


def _both(first, second) -> list[tuple[str, str]]:
    """Pairs of two texts that become shorter, those that say most first."""
    places = sorted(itertools.product(range(len(first)), range(len(second))), key=lambda at: (sum(at), at[1]))
    return [(first[m], second[n]) for m, n in places]


def _named(answer, effects, brackets=False) -> list[str]:
    """The named effects: with all parameters, with their main one, without any, and the first two of them."""
    first = [c.says for c in answer.conventions]
    listed = lambda texts: joined([*first, *texts]) if brackets else "; ".join([*first, *texts])  # noqa: E731
    titles = [title_of(e.name, effects) for e in answer.effects]
    shown = max(2 - len(first), 0)
    few = [*titles[:shown], f"{len(titles) - shown} more effects"] if len(titles) > 3 else titles
    sized = [listed([said(e, effects, most, brackets) for e in answer.effects]) for most in (None, 1)]
    return [*sized, joined([*first, *titles]), joined([*first, *few])]


def _sets(groups, effects) -> list[str]:
    """The ambiguities: all members of each set, the first two of each, and their number."""
    titles = [[title_of(n, effects) for n in group] for group in groups]
    short = [t if len(t) < 4 else [*t[:2], f"{len(t) - 2} other effects"] for t in titles]
    texts = ["; and ".join(joined(t) for t in each) for each in (titles, short)]
    others = sum(map(len, titles)) - 1
    return [*texts, f"{titles[0][0]} and {others} other effect{'s' if others > 1 else ''}" if titles else ""]


def _cause(answer) -> list[str]:
    """What the residual looks like."""
    u = answer.unknown_term
    if u is not None and u.meaning:
        without = "looks like a cause without a parameter in the simulation"
        return [f"looks {as_if(u)}", f"looks as if {u.meaning}", without]
    return ["its cause is not known"]
