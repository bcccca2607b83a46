# SPDX-License-Identifier: BSD-3-Clause
"""The judge: right, covering, honest limit, withheld or wrong, by rule, from an answer and a truth.

wrong          an effect that is not there, or of another size, or of a size compatible with zero, or implausible;
               an ambiguity, a convention or a correction without the truth; agreement or an explanation where a
               cause is missing; an alarm where all agrees; an improved drive equal to the given one; a crash
right          every cause is named
covering       every cause is named or is in an ambiguity, or the headline of an unexplained misfit describes it
honest limit   refused, or unexplained where no cause is known, and the message names the true reason
withheld       the rest: refused for another reason, unexplained, or part of the causes
"""

from __future__ import annotations

import re

from fluxproof.diagnosis.words.phrases import CORRECTED
from studies.scored.sizes import size_fault
from studies.scored.truth import Truth

CALLS_FOR_IT = "Use drive_improved.toml"


def judge(answer: dict, truth: Truth, machine: dict) -> tuple[str, str]:
    """(judgement, why); answer: as answers.py keeps it; machine: [machine] of the drive file."""
    if "crash" in answer:
        return "wrong", answer["crash"]
    headline = headline_of(answer)
    if truth.never and (found := re.search(truth.never, headline)):
        return "wrong", f"says {found.group()!r}"
    if "refused" in answer or answer["verdict"] == "bad_recording":
        return _refused(answer, truth, headline)
    faults = [*_false_effects(answer, truth, machine), *_false_groups(answer, truth), *_false_readings(answer, truth)]
    guessed = truth.tells and (not truth.guess or _any([truth.guess], " ".join(answer.get("notes", []))))
    if guessed and not _any([truth.tells], answer["sentence"]):
        faults.append("rests on a guess that the headline does not tell")
    if answer.get("improved") == "same" and CALLS_FOR_IT in answer["advice"]:
        faults.append("drive_improved.toml equals the given drive file")
    if faults:
        return "wrong", "; ".join(faults)
    return _healthy(answer, truth) if not truth.causes else _caused(answer, truth, headline)


def headline_of(answer: dict) -> str:
    """What a user reads first."""
    parts = [answer.get(key) or "" for key in ("refused", "sentence", "advice")]
    meaning = (answer.get("unknown_term") or {}).get("meaning", "")
    return " ".join([*parts, *([f"As if {meaning}."] if meaning else [])])


def said(text: str) -> str:
    """A message without what it only repeats, the name of the file and its columns, which may have telling names."""
    text = re.sub(r"\S*\.(csv|parquet|txt|mat|toml|mf4|h5)\b", "", text)
    return re.sub(r"found columns [^;]*", "", text)


def _refused(answer, truth, headline):
    fatal = [p["message"] for p in answer.get("recording", {}).get("problems", []) if p["fatal"]]
    if truth.limit and re.search(truth.limit, said(" ".join([headline, *fatal])), re.IGNORECASE):
        return "honest limit", "refused for the true reason"
    return "withheld", "refused, the message does not name the reason"


def _false_effects(answer, truth, machine):
    for effect in answer["effects"]:
        causes = [c for c in (*truth.causes, *truth.beside) if effect["name"] in c.names]
        if not causes:
            yield f"{effect['name']} is not there"
        elif fault := size_fault(effect, [c.sizes for c in causes], machine):
            yield fault


def _false_groups(answer, truth):
    true = {n for c in (*truth.causes, *truth.beside) for n in (*c.names, *c.may)}
    yield from (f"ambiguity without the truth: {', '.join(g)}" for g in answer["ambiguity"] if not true & set(g))


def _false_readings(answer, truth):
    own = [c.reading for c in truth.causes]
    free = [c.may_read for c in truth.causes]
    for c in answer["conventions"]:
        known = [*own, *free] if c["rivals"] else own
        if not _any([*known, truth.readings], _text_of(c)):
            yield f"reading {c['code']!r} is not true"
    for text in corrections(answer):
        if not _any([*own, truth.readings], text):
            yield f"corrected what is right: {text[:80]}"


def corrections(answer) -> list[str]:
    """The findings by which a column was read otherwise than recorded."""
    return [p["message"] for p in answer["recording"]["problems"] if p["action"] in CORRECTED]


def _healthy(answer, truth):
    if answer["ambiguity"] or answer["effects"]:
        return "covering", "names what is there and of no interest"
    if answer["verdict"] == "no_mismatch":
        return "right", "agrees"
    if answer["verdict"] in ("explained", "ambiguous") and answer["conventions"]:
        open_ = any(c["rivals"] for c in answer["conventions"])
        return ("covering", "a reading beside others") if open_ else ("right", "the reading is told")
    if _any([truth.limit], said(answer["sentence"])):
        return "honest limit", "unexplained, and the headline names the true reason"
    return "wrong", f"false alarm: {answer['verdict']}"


def _caused(answer, truth, headline):
    states = [_state(c, answer, headline) for c in truth.causes]
    missing = [c for c, s in zip(truth.causes, states, strict=True) if s == "missing"]
    if not missing:
        return ("right", "named") if set(states) == {"named"} else ("covering", "in an ambiguity, or described")
    lost = ", ".join("|".join(c.names) or c.reading for c in missing)
    if answer["verdict"] == "no_mismatch":
        return "wrong", f"agrees, in spite of {lost}"
    if answer["verdict"] == "explained":
        return "wrong", f"explained without {lost}"
    return "withheld", f"{answer['verdict']} without {lost}"


def _state(cause, answer, headline) -> str:
    """Whether a cause is named, covered or missing."""
    if {e["name"] for e in answer["effects"]} & set(cause.names):
        return "named"
    sole = [_text_of(c) for c in answer["conventions"] if not c["rivals"]]
    if cause.reading and any(_any([cause.reading], text) for text in (*sole, *corrections(answer))):
        return "named"
    shared = [_text_of(c) for c in answer["conventions"] if c["rivals"]]
    if any(_any([cause.reading, cause.may_read], text) for text in shared):
        return "covered"
    if any({*cause.names, *cause.may} & set(group) for group in answer["ambiguity"]):
        return "covered"
    described = answer["verdict"] in ("unexplained", "partly_explained") and _any([cause.words], headline)
    return "covered" if described else "missing"


def _text_of(convention) -> str:
    return " ".join([convention["code"], *convention["rivals"], convention["says"]])


def _any(patterns, text) -> bool:
    return any(re.search(p, text, re.IGNORECASE) for p in patterns if p)
