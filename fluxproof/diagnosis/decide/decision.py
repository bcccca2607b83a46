# SPDX-License-Identifier: BSD-3-Clause
"""What is decided about a recording, and what it was decided from.

posterior -> Decision (rules.py) -> the next recording (plan/), files (improve/), sentences (words/)
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fluxproof.diagnosis.balance.view import View
from fluxproof.diagnosis.ground.result import (
    BestFit,
    Convention,
    Evidence,
    Fit,
    Location,
    NamedEffect,
    Remainder,
    UnknownTerm,
)
from fluxproof.diagnosis.inference.posterior import Posterior

# Why an effect is withheld.
IMITATION = "imitation"  # a large residual may imitate it
CONSTANT = "constant"  # at one operating point: an unexplained constant misfit may imitate its drift
NOISE = "noise"  # recording and simulation agree without it
SIZELESS = "sizeless"  # its size is compatible with zero
INSIGNIFICANT = "insignificant"  # its probability is below that of a name


@dataclass(frozen=True)
class Withheld:
    """An effect that is not asserted.

    why: one of the words above; size: the share that it would explain of an IMITATION, else its probability; 0: none.
    """

    effect: str
    why: str
    size: float = 0.0


@dataclass(frozen=True)
class OnePoint:
    """The only operating point of a recording.

    constant: misfit that stays the same over time, dq [V]; off: whether it is more than ripple and resolution;
    candidates: effects that explain it alone; long: whether the point was held long enough for a drift.
    """

    constant: complex
    off: bool
    candidates: tuple[str, ...]
    long: bool


@dataclass(frozen=True, eq=False)
class Basis:
    """What a decision was drawn from.

    view: blocks of the recording; held: (b,) bool, blocks that were not fitted; posterior: Posterior over the sets that
    are possible, None of one operating point; rivals: one fit of it per alternative of the ambiguities.
    """

    view: View
    held: np.ndarray
    posterior: Posterior | None = None
    rivals: tuple = ()
    one_point: OnePoint | None = None


@dataclass(frozen=True, eq=False)
class Decision:
    """The verdict with its reasons; the fields that Diagnosis has too mean the same.

    withheld: effects that are not asserted; alike: causes beyond the simulation, other than ``unknown_term``, that the
    residual looks like; readings: interpretations of recording and drive file that are asserted, as conventions/
    applies them; hinted: those that fit better and are not asserted; basis: None if nothing was compared.
    """

    verdict: str
    effects: tuple[NamedEffect, ...] = ()
    ambiguity: tuple[tuple[str, ...], ...] = ()
    alternatives: tuple[NamedEffect, ...] = ()
    withheld: tuple[Withheld, ...] = ()
    location: Location = Location()
    fit: Fit = Fit()
    explained_share: float | None = None
    remainder: tuple[Remainder, ...] = ()
    unknown_term: UnknownTerm | None = None
    best_fit: BestFit | None = None
    minor: tuple[NamedEffect, ...] = ()
    alike: tuple[UnknownTerm, ...] = ()
    conventions: tuple[Convention, ...] = ()
    readings: tuple = ()
    hinted: tuple = ()
    evidence: Evidence = field(default_factory=Evidence)
    basis: Basis | None = None

    @property
    def posterior(self) -> Posterior | None:
        """Over sets of effects; None of one operating point, or if nothing was compared."""
        return self.basis.posterior if self.basis is not None else None
