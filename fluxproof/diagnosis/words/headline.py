# SPDX-License-Identifier: BSD-3-Clause
"""The headline of every verdict, in at most two lines.

Titles of effects and parameters are those that the effects declare.  Where a headline would be longer than
MOST_LETTERS letters, it says less of each effect, then of fewer effects; the whole is in details.py and in the table
of effects.
"""

from __future__ import annotations

import itertools

from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.words.best_fit import best_fits
from fluxproof.diagnosis.words.phrases import (
    as_if,
    capital,
    corrected,
    joined,
    located,
    percent_below,
    said,
    title_of,
)

ASSUMED = ("assumed_time",)  # codes of findings
SENSOR = ("angle_step", "angle_drift", "angle_uneven")  # which a user has to mend, whatever else is found
REASONS = (*ASSUMED, "unit", "gates_off", "repeated", "gap", "dropped", "stuck", "slow_sampling")
MOST_BESIDE = 2
MOST_LETTERS = 200  # two lines of a terminal or of the report; only what the checks or the replay found may be longer


def headline(answer, effects) -> str:
    """The verdict of an answer as a headline; effects: the catalogue."""
    variants, beside = _variants(answer, effects), f"{_guessed(answer)}{_beside(answer)}"
    most = MOST_LETTERS - len(beside)
    return next((text for text in variants if len(text) <= most), variants[-1]) + beside


def _beside(answer) -> str:
    """What the answer rests on and nothing confirms, and beside a refusal what the checks found before."""
    codes = REASONS if answer.verdict == "bad_recording" else ASSUMED
    if answer.verdict != "no_mismatch":  # which names what was corrected
        codes = (*SENSOR, *codes)
    messages = (_told(p) for p in answer.problems if p.code in codes and not p.fatal)
    found = dict.fromkeys(messages)
    return "".join(f" {capital(message)}." for message in list(found)[:MOST_BESIDE])


def _told(problem) -> str:
    """What a finding says in a headline: of a unit also which one was taken."""
    if problem.code == "unit":
        return f"{problem.message} ({problem.action})"
    return problem.message.partition(":")[0] if problem.code in SENSOR else problem.message


def _guessed(answer) -> str:
    """The units that only the numbers gave away, as a sentence: the answer rests on them."""
    found = dict.fromkeys(p.message for p in answer.problems if p.action == "converted")
    if not found or answer.verdict in ("bad_recording", "digital_mismatch", "no_mismatch"):  # these name it themselves
        return ""
    return f" By its numbers, {joined(list(found))}."


def _variants(answer, effects) -> list[str]:
    """The headline from the most detailed one to the shortest."""
    if answer.verdict == "bad_recording":
        worst = next(p for p in answer.problems if p.fatal)
        text = f"The recording cannot be used: {worst.located()}"
        return [f"{text.rstrip('.')}." if _beside(answer) else text]
    if answer.verdict == "digital_mismatch":
        return [_mismatch(answer.digital.first_difference)]
    misfit = ascii_of(quantity(answer.fit.train_before, answer.fit.unit, 3))
    if answer.verdict == "no_mismatch":
        at_floor = answer.fit.train_before**2 <= (1.0 + k.FLOOR) * answer.fit.noise_floor**2
        usual = "is at the noise floor" if at_floor else "is within the usual error for this kind of recording"
        floor = f"the misfit of {misfit} {usual}"
        if answer.minor and not at_floor:
            floor = f"what explains the misfit of {misfit} is too small to act on"
        if found := corrected(answer):
            once = [joined(found), f"{found[0]}, and {len(found) - 1} more", "the columns are interpreted differently"]
            return [f"Simulation and recording agree once corrected: {what}. {capital(floor)}." for what in once]
        return [f"Simulation and recording agree: {floor}."]
    if answer.verdict == "explained":
        return [f"{capital(what)}." for what in _named(answer, effects)]
    named, sets = _named(answer, effects, brackets=True), _sets(answer, effects)
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
        looks = [f"No parameter of the simulation explains the misfit of {misfit}: it {c}" for c in cause]
        beside = [f"; of those, {fits}" for fits in best_fits(answer, effects)]
        return [*(f"{c}{b}." for c, b in _both(looks, [*beside, ""])), f"{looks[-1]}."]
    if answer.best_fit is not None:
        return [f"Not explained, {misfit}, {where}: {fits}." for fits in best_fits(answer, effects)]
    return [f"Unknown: no effect of the catalogue explains half of the misfit of {misfit}, {where}."]


def _mismatch(d: dict) -> str:
    """Block, sample, signal and bit of the first difference, and its cause if one was found."""
    text = (
        f"The controller's output differs from its golden model: block {d['block']}, sample {d['sample']}, "
        f"signal {d['signal']}, bit {d['bit']} (recorded {d['recorded']}, golden model {d['golden']})"
    )
    return f"{text}; {d['cause']}." if d.get("cause") else f"{text}."


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


def _sets(answer, effects) -> list[str]:
    """The ambiguities: all members with the sizes of each alone, all, the first two of each, and their number."""
    alone = {e.name: said(e, effects, 1, brackets=True) for e in answer.alternatives}
    parts = [_open_and_certain(group, answer) for group in answer.ambiguity]
    sized = [[alone.get(n, title_of(n, effects)) for n in group] for group, _ in parts]
    titles = [[title_of(n, effects) for n in group] for group, _ in parts]
    short = [t if len(t) < 4 else [*t[:2], f"{len(t) - 2} other effects"] for t in titles]
    depend = [_depends([title_of(n, effects) for n in certain]) for _, certain in parts]
    few = [_depends([title_of(certain[0], effects), f"{len(certain) - 1} more"]) if len(certain) > 1 else d
           for (_, certain), d in zip(parts, depend, strict=True)]  # fmt: skip
    lengths = ((sized, depend), (titles, depend), (titles, few), (short, few))
    texts = ["; and ".join(joined(t) + d for t, d in zip(*each, strict=True)) for each in lengths]
    others = sum(map(len, titles)) - 1
    return [*texts, f"{titles[0][0]} and {others} other effect{'s' if others > 1 else ''}" if titles else ""]


def _open_and_certain(group, answer) -> tuple[list[str], list[str]]:
    """The members of an ambiguity of which one is there, and those that are there whichever it is, with another size.

    Of a saturating machine eleven effects were told as not separable, two of which were certain.
    """
    sure = {e.name for e in answer.alternatives if e.confidence >= 1.0 - k.DOUBTED}
    left = [n for n in group if n not in sure]
    # What no balance tells from its twin is certain only as one of the two.
    return (left, [n for n in group if n in sure]) if len(left) > 1 else (list(group), [])


def _depends(certain) -> str:
    """That the sizes of what is certain depend on which of an ambiguity is there; "" if nothing is."""
    if not certain:
        return ""
    return f", on which the size of {joined(certain)} depends"


def _cause(answer) -> list[str]:
    """What the residual looks like."""
    u = answer.unknown_term
    if u is not None and u.meaning:
        without = "looks like a cause without a parameter in the simulation"
        return [f"looks {as_if(u)}", f"looks as if {u.meaning}", without]
    return ["its cause is not known"]
