# SPDX-License-Identifier: BSD-3-Clause
"""From the judgement on a posterior to the Decision: estimates, shares, residual, unknown term, location."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.decide.decision import IMITATION, INSIGNIFICANT, NOISE, SIZELESS, Basis, Decision, Withheld
from fluxproof.diagnosis.decide.estimates import estimates_in, named_effects
from fluxproof.diagnosis.decide.likeliest import likeliest
from fluxproof.diagnosis.decide.locate import evidence, locate
from fluxproof.diagnosis.decide.off_orders import Stray
from fluxproof.diagnosis.decide.rules import Judgement, judge
from fluxproof.diagnosis.decide.sizes import Sizes, fit_of, left_by, measured_torque, with_stray
from fluxproof.diagnosis.decide.unknown_term import sparse_term
from fluxproof.diagnosis.ground.quantities import measured
from fluxproof.diagnosis.ground.result import Fit, NamedEffect, Remainder, UnknownTerm
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.fitted_set import covariance_of

MOST_RIVALS = 5
MOST_POSSIBLE = 3  # possible effects that are reported as withheld


def conclude(posterior, held) -> Decision:
    """The decision on a posterior; held: (b,) blocks that were not fitted."""
    j = judge(posterior, held)
    setup, best = j.posterior.setup, j.posterior.best()
    explained = j.explaining if j.kind != "unexplained" else set()  # nothing is named, so the whole misfit is left
    shares = _shares(j, held)
    unknown = _unknown(j, held)
    view, cells, left = setup.view, setup.cells, left_by(best, explained)
    return Decision(
        j.kind,
        effects=tuple(named_effects(j.names, j.posterior, shares)),
        ambiguity=j.names.ambiguous,
        alternatives=_alternatives(j),
        withheld=_withheld(j, shares),
        location=locate(view, cells, setup.noise),
        fit=_fit(j, held, explained),
        explained_share=j.share if explained == j.explaining else 0.0,
        remainder=_remainder(j),
        unknown_term=unknown,
        best_fit=likeliest(j.searched, j.sizeless, held) if j.kind == "unexplained" else None,
        minor=tuple(named_effects(j.names, j.posterior, shares, only=set(j.names.minor))),
        alike=_alike(j, held, unknown),
        evidence=evidence(view, (cells, cells.y), (cells, left), setup.noise, held),
        basis=Basis(view, held, j.posterior, _rivals(j.names)),
    )


def _fit(j: Judgement, held, explained) -> Fit:
    """Sizes of the misfit with what is explained; of an unexplained one both are those before."""
    if explained == j.explaining:
        return fit_of(j.train, j.unseen)
    setup = j.posterior.setup
    before = setup.cells.y
    return fit_of(*(Sizes(setup, before, before, blocks, measured_torque(setup)) for blocks in (~held, held)))


def _remainder(j: Judgement) -> tuple[Remainder, ...]:
    """What is left above the noise floor at held-out points, and outside the orders of the balance."""
    listed = j.unseen.remainder() if j.kind != "no_mismatch" else []
    return tuple(with_stray(listed, j.stray, j.train) if j.stray else listed)


def _withheld(j: Judgement, shares) -> tuple[Withheld, ...]:
    """Every effect that was found and is not asserted, with the rule that withholds it."""
    dropped = sorted(set(j.found.named) - set(j.names.named))
    possible = sorted(j.names.possible.items(), key=lambda entry: -entry[1])[:MOST_POSSIBLE]
    unsure = NOISE if j.kind == "no_mismatch" else INSIGNIFICANT
    return (
        *(Withheld(n, IMITATION, shares[n]) for n in dropped),
        *(Withheld(n, SIZELESS) for n in sorted(j.sizeless)),
        *(Withheld(n, unsure, p) for n, p in possible),
    )


def _rivals(names) -> tuple:
    """One fit per alternative: the most probable one with each ambiguous effect."""
    rivals, seen = [], set()
    for _, fit in names.fits:
        mine = frozenset(n for group in names.ambiguous for n in group if n in fit.names)
        if mine and mine not in seen:
            seen.add(mine)
            rivals.append(fit)
    return tuple(rivals[:MOST_RIVALS])


def _alternatives(j: Judgement) -> tuple[NamedEffect, ...]:
    """Every effect of an ambiguity with its sizes in the most probable set that contains it."""
    present, out = j.posterior.present(), []
    for name in sorted({n for group in j.names.ambiguous for n in group}):
        fit = next((fit for _, fit in j.names.fits if name in fit.names), None)
        if fit is not None:
            out.append(NamedEffect(name, float(min(present.get(name, 0.0), 0.999)), estimates_in(fit, name), 0.0))
    return tuple(out)


def _shares(j: Judgement, held) -> dict[str, float]:
    """{effect: share of the misfit's power above the floor that is left without it}."""
    best, setup = j.posterior.best(), j.posterior.setup
    measured, possible, out = measured_torque(setup), j.found.only_possible(best), {}
    for name in j.found.named:
        # What is only possible must not take over.
        fewer = fit_set(best.problem, [n for n in best.names if n != name and n not in possible])
        left = left_by(fewer, j.explaining & set(fewer.names))
        without = Sizes(setup, setup.cells.y, left, held, measured)
        with_it = Sizes(setup, setup.cells.y, best.left(j.explaining), held, measured)
        mine = [j.channel] if j.channel in without.channels else list(without.channels)
        excess = sum(without.channels[c].excess for c in mine)
        more = sum(without.channels[c].left - with_it.channels[c].left for c in mine)
        out[name] = float(np.clip(more / excess, 0.0, 1.0)) if excess > 0.0 else 0.0
    return out


def _unknown(j: Judgement, held) -> UnknownTerm | None:
    """What fits an unexplained remainder best: a suspect, or a formula."""
    if j.kind not in ("unexplained", "partly_explained"):
        return None
    best, suspects = j.posterior.best(), j.names.suspects
    suspect = max(suspects, key=lambda n: suspects[n] * best.sizes[best.names.index(n)], default=None)
    if suspect:
        return _described(j, suspect, held)
    if j.stray is not None:
        return _term_of(j.stray)
    setup = j.posterior.setup
    return sparse_term(best.problem.view, setup.cells, left_by(best, j.explaining), setup.usual, setup.train)


def _term_of(stray: Stray) -> UnknownTerm:
    signal = "torque" if stray.kind == "torque" else "u_dq"
    return UnknownTerm(signal, stray.formula, stray.value, stray.sigma, stray.unit, min(stray.explains, 1.0))


def _alike(j: Judgement, held, unknown) -> tuple[UnknownTerm, ...]:
    """Further suspects that the remainder looks like."""
    meaning = unknown.meaning if unknown is not None else None
    clause = {n: j.posterior.setup.effects[n].clause for n in j.names.suspects}
    return tuple(_described(j, n, held) for n in clause if clause[n] != meaning)


def _described(j: Judgement, name, held) -> UnknownTerm:
    """A suspect with its parameter and the share of the remainder that it explains at points that were not fitted."""
    best = j.posterior.best()
    setup, effect = best.problem.setup, best.problem.setup.effects[name]
    channel = "u"
    least = Sizes(setup, setup.cells.y, best.left(), held, True).channels[channel].left
    before = j.unseen.channels[channel].left
    share = float(np.clip(1.0 - least / before, 0.0, 1.0)) if before > 0.0 else 0.0
    (parameter, e), *others = effect.estimates(best.c[name], covariance_of(best, name, best.cov), None).items()
    sizes = "".join(f"; {other} {measured(x.value, x.sigma, x.unit)}" for other, x in others)
    formula = f"{parameter}, {effect.equation}{sizes}"
    return UnknownTerm("u_dq", formula, e.value, e.sigma, e.unit, share, effect.clause)
