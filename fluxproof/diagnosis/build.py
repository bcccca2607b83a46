# SPDX-License-Identifier: BSD-3-Clause
"""The only place that makes a Diagnosis: from what was decided, with the sentences that words/ makes of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fluxproof.diagnosis.conventions.apply import read_drive
from fluxproof.diagnosis.ground.nominal import Nominal
from fluxproof.diagnosis.ground.result import Diagnosis, Digital, Fleet
from fluxproof.diagnosis.physics import Outcome, known_effects
from fluxproof.diagnosis.words.advice import advice
from fluxproof.diagnosis.words.details import details
from fluxproof.diagnosis.words.doubts import doubts
from fluxproof.diagnosis.words.headline import headline
from fluxproof.diagnosis.words.notes import notes_of
from fluxproof.diagnosis.words.requests import requested


@dataclass(frozen=True)
class Beside:
    """What a session found beside the physics.

    digital: of the replay; prior: the fleet that was the prior; before, read, after: notes of replay and prior, of the
    readers, and of the written files, which stand before and after those on the physics.  improved: whether an improved
    drive file differs from the given one, as far as one was written; worse: whether the closed loop rejected it.
    """

    digital: Digital = Digital()
    prior: Fleet | None = None
    before: tuple[str, ...] = ()
    read: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    improved: bool = True
    worse: bool = False


def build(found: Outcome, nominal: Nominal, beside: Beside | None = None) -> Diagnosis:
    """The diagnosis of recordings against a nominal drive."""
    decision, beside, effects = found.decision, beside or Beside(), known_effects()
    facts = Diagnosis(
        decision.verdict,
        "",
        effects=decision.effects,
        ambiguity=decision.ambiguity,
        alternatives=decision.alternatives,
        next_recording=requested(found.planned, effects),
        location=decision.location,
        fit=decision.fit,
        explained_share=decision.explained_share,
        remainder=decision.remainder,
        conventions=decision.conventions,
        unknown_term=decision.unknown_term,
        best_fit=decision.best_fit,
        minor=decision.minor,
        rows=found.rows,
        problems=found.problems,
        digital=beside.digital,
        prior=beside.prior,
        evidence=decision.evidence,
        notes=(*beside.before, *notes_of(decision, effects), *beside.read),
    )
    return worded(facts, read_drive(nominal, decision.readings), beside.after, beside.improved, beside.worse)


def worded(facts: Diagnosis, nominal: Nominal, after: tuple[str, ...] = (), improved=True, worse=False) -> Diagnosis:
    """A diagnosis with its sentences, made of its other fields; one that is there stays.

    nominal: the drive as it was read; after: notes that stand last; improved, worse: as in Beside.
    """
    effects = known_effects()
    sentence = facts.sentence or headline(facts, effects)
    return replace(
        facts,
        sentence=sentence,
        details=details(facts, sentence, effects),
        advice=advice(facts, nominal, effects, improved, worse),
        notes=(*facts.notes, *doubts(facts, nominal, effects), *after),
    )
