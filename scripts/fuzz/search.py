# SPDX-License-Identifier: BSD-3-Clause
"""Draws cases of a target in turns; what fails is made smaller by Hypothesis and kept once for each kind of fault."""

from __future__ import annotations

import time
from collections.abc import Callable
from random import Random
from typing import NamedTuple

from hypothesis import HealthCheck, Phase, find, settings
from hypothesis.errors import HypothesisException

from scripts.fuzz.case import Case, Verdict
from scripts.fuzz.smaller import smaller
from scripts.fuzz.worker import Worker

SHRINKING = 30.0  # s for Hypothesis, and as much for leaving out lines and blocks


class Find(NamedTuple):
    """The smallest case of one kind of fault of a target; ``turn``: the number of the turn that drew it."""

    target: str
    turn: int
    case: Case
    verdict: Verdict


class _Enough(BaseException):
    """Ends a search of Hypothesis from inside the condition; no Exception, so that it does not take it for a find."""


class Search:
    """The search in one target; the same seed draws the same cases, turn by turn."""

    def __init__(self, target, seed: int, worker: Worker, shrinking: float = SHRINKING):
        self.target, self.worker, self.seed, self.shrinking = target, worker, seed, shrinking
        self.stop_at = float("inf")  # by time.monotonic
        self.name = target.__name__.rpartition(".")[2]
        self.strategy = target.cases()
        self.turns = self.cases = 0
        self.finds: dict[str, Find] = {}

    def turn(self, cases: int, after_each: Callable[[], None] = lambda: None) -> list[Find]:
        """Draw so many cases, fewer if one fails; the new finds, which ``finds`` has even if Ctrl-C ends the turn."""
        self.turns += 1
        new: list[Find] = []
        first = [0.0]

        def fails(case: Case) -> bool:
            now = time.monotonic()
            if now > (first[0] + self.shrinking if new else self.stop_at):
                raise _Enough
            self.cases += 1
            after_each()
            verdict = self.worker.verdict(self.target, case)
            if not verdict.kind or verdict.kind in self.finds or (new and verdict.kind != new[0].verdict.kind):
                return False
            if not new or len(case.content) <= len(new[0].case.content):
                new[:] = [Find(self.name, self.turns, case, verdict)]
            first[0] = first[0] or now
            return True

        try:
            find(self.strategy, fails, random=Random(f"{self.seed} {self.name} {self.turns}"), settings=_how(cases))
        except (_Enough, HypothesisException):  # none in this turn; or one that fails only sometimes, which is kept
            pass
        finally:
            self.finds |= {f.verdict.kind: f for f in new}
        for found in new:
            self.finds[found.verdict.kind] = self._shortened(found)
        return [self.finds[found.verdict.kind] for found in new]

    def _shortened(self, found: Find) -> Find:
        """The find with fewer lines or blocks, and with the verdict on them."""
        last = [found]

        def fails(content: bytes) -> bool:
            verdict = self.worker.verdict(self.target, Case(found.case.suffix, content))
            if verdict.kind == found.verdict.kind:
                last[0] = found._replace(case=Case(found.case.suffix, content), verdict=verdict)
            return verdict.kind == found.verdict.kind

        smaller(found.case.content, fails, self.shrinking)
        return last[0]


def _how(cases: int) -> settings:
    return settings(
        max_examples=cases,
        database=None,
        deadline=None,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
    )
