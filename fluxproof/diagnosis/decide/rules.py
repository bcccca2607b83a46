# SPDX-License-Identifier: BSD-3-Clause
"""The rules by which a posterior becomes a verdict with names, in the order in which they apply.

    1. sized.py         a set in which an effect is smaller than its own uncertainty is no explanation
    2. names.py         what is probable and has a size is named, rivals are ambiguous (ambiguity.py); where the misfit
                        is more than a recording of this kind has, there is a cause, so that "none" is no alternative
    3. off_orders.py    a misfit outside the orders of the balance is looked for
    4. _as_noise        nothing is asserted where recording and simulation agree
    5. relevant.py      what is too small to act on is no cause
    6. verdict.py       the kind follows from the names and from the sizes of what is left
    7. _beside_unknown  nothing is asserted beside a large unexplained residual

conclude.py adds the numbers.  A recording without a posterior: one_point.py, and ``not_compared`` below.  Where the
recording or the drive file means something else than documented: interpretation.py.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fluxproof.diagnosis.decide.decision import Decision
from fluxproof.diagnosis.decide.names import Names, names_of
from fluxproof.diagnosis.decide.off_orders import Stray, row_residual, stray_order, stray_swing, stray_torque
from fluxproof.diagnosis.decide.relevant import relevant_names
from fluxproof.diagnosis.decide.sized import with_sizes
from fluxproof.diagnosis.decide.sizes import Sizes, left_by, measured_torque
from fluxproof.diagnosis.decide.verdict import at_floor, is_usual, kind_of, without_imitations
from fluxproof.diagnosis.effects import ShaftTorque
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.inference.posterior import Posterior


@dataclass(frozen=True, eq=False)
class Judgement:
    """What the rules decide on a posterior.

    searched: the posterior over all sets; posterior: over those whose effects have sizes; names: what is asserted;
    found: the names before rule 7; sizeless: what is not named for its size; explaining: effects that explain a part of
    the misfit; channel, share: where the explained share is counted, and what it is; stray: a misfit outside the orders
    of the balance; train, unseen: sizes on fitted and on held-out blocks.
    """

    searched: Posterior
    posterior: Posterior
    kind: str
    names: Names
    found: Names
    sizeless: frozenset[str]
    explaining: set[str]
    channel: str
    share: float | None
    stray: Stray | None
    train: Sizes
    unseen: Sizes


def judge(posterior, held) -> Judgement:
    """The judgement on a posterior; held: (b,) blocks that were not fitted."""
    setup, searched = posterior.setup, posterior
    posterior = setup.call(with_sizes, posterior)
    posterior = replace(posterior, agrees=is_usual(_sizes(posterior.best(), set(), ~held)))
    names, best = setup.call(names_of, posterior), posterior.best()
    stray = setup.call(_off_orders, posterior, frozenset(names.suspects), held)
    names = relevant_names(_as_noise(posterior, names, stray, held), best)
    explaining = _explaining(names, best)
    train, unseen = (_sizes(best, explaining, blocks) for blocks in (~held, held))
    channel = train.primary()
    share = unseen.share(channel) if _is_counted(explaining, setup) else None
    kind = kind_of(names, train, unseen, channel, share, stray)
    kind = without_imitations(kind, names, best)
    found = _beside_unknown(names, kind), names, _sizeless(names, searched)
    return Judgement(searched, posterior, kind, *found, explaining, channel, share, stray, train, unseen)


def not_compared(verdict: str) -> Decision:
    """The decision on a recording of which the physics is not diagnosed: digital_mismatch or bad_recording.

    While the controller differs from its golden model, or a check found the recording unusable, a misfit has no
    meaning.
    """
    return Decision(verdict)


def _off_orders(posterior, suspects, held) -> Stray | None:
    """Rule 3, after the best set of which every cause is named or in ``suspects``.

    An effect that is only possible is not reported, so it explains nothing here.
    """
    setup = posterior.setup
    effects = setup.effects
    reported = [f for f in posterior.fits.values() if all(effects[n].named or n in suspects for n in f.names)]
    best = max(reported, key=lambda f: f.value)
    doubts = [effects[n].doubt(best.c[n], setup.view) for n in best.names]
    doubt = np.sqrt(sum((np.square(d) for d in doubts), np.zeros(len(setup.view))))
    sizes = Sizes(setup, setup.cells.y, setup.cells.y, ~held, measured_torque(setup))
    before = sizes.channels["u"].before if "u" in sizes.channels else 0.0
    floor = k.FORMS_LEFT * before if best.names else 0.0
    certain = np.flatnonzero(doubt <= k.FORMS_LEFT * before) if best.names else np.arange(len(setup.view))
    if not len(certain):
        return None
    known = sorted({h for n in best.names for h in effects[n].shows_at.trailing})
    view, rows = best.problem.view.take(certain), row_residual(best)[certain]
    found = stray_order(view, rows, floor, known) or stray_swing(view, rows, floor)
    if found is None and measured_torque(setup):
        found = stray_torque(setup.view, setup.projector, setup.cells, best.left(), setup.usual)
    return found


def _as_noise(posterior, names, stray, held) -> Names:
    """Rule 4: the misfit is at the floor, or is usual and its larger part is not explained at held-out points.

    Usual is what a log may have whose own error is not known (least_error); that of others is their floor.  What only
    the angle of a free shaft shows is in no size: there the names decide.
    """
    if stray:
        return names
    setup, best = posterior.setup, posterior.best()
    train, unseen = (_sizes(best, _explaining(names, best), blocks) for blocks in (~held, held))
    share = unseen.share(train.primary())
    little = share is not None and share < k.HALF and setup.view.least_error < 1.0
    if not (at_floor(train) or (little and is_usual(train))):
        return names
    shaft = {n for n, effect in setup.effects.items() if isinstance(effect, ShaftTorque)}
    hidden = setup.view.turns_freely.any() or not measured_torque(setup)
    return names.withheld(frozenset(shaft if hidden else ()))


def _beside_unknown(names, kind) -> Names:
    """Rule 7: beside a large unknown part even a probable name may be its imitation."""
    return replace(names, named={}, ambiguous=()) if kind == "unexplained" else names


def _sizeless(names, searched) -> frozenset[str]:
    """What is as sure as a name and has no size, or is in the best set of all and in no probable one with sizes."""
    kept = {n for _, fit in names.fits for n in fit.names}
    return frozenset(names.sizeless) | (frozenset(searched.best().names) - kept)


def _explaining(names, best) -> set[str]:
    """Effects of the best set that explain a part of the misfit: named, ambiguous, likely, or too small to act on."""
    effects = best.problem.setup.effects
    likely = {n for n, p in names.possible.items() if p >= k.LIKELY and effects[n].named}
    return (names.asserted | likely | set(names.minor)) & set(best.names) - set(names.suspects)


def _sizes(best, explaining, blocks) -> Sizes:
    setup = best.problem.setup
    return Sizes(setup, setup.cells.y, left_by(best, explaining), blocks, measured_torque(setup))


def _is_counted(explaining, setup) -> bool:
    """Whether a share is counted: of effects in the voltage, or of any where a transducer measures the torque."""
    electrical = [n for n in explaining if not isinstance(setup.effects[n], ShaftTorque)]
    return bool(electrical or (explaining and measured_torque(setup)))
