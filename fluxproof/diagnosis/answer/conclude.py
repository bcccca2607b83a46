# SPDX-License-Identifier: BSD-3-Clause
"""From a posterior to the answer: names, sizes on held-out points, verdict, next recording, evidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.answer.balance_notes import balance_notes
from fluxproof.diagnosis.answer.estimates import named_effects
from fluxproof.diagnosis.answer.headline import sentence
from fluxproof.diagnosis.answer.locate import evidence, locate
from fluxproof.diagnosis.answer.names import Names, names_of
from fluxproof.diagnosis.answer.phrases import as_if, capital, percent_below
from fluxproof.diagnosis.answer.request import requests, wants_cold
from fluxproof.diagnosis.answer.scan import Stray, row_residual, stray_order, stray_swing, stray_torque
from fluxproof.diagnosis.answer.sizes import Sizes, fit_of, with_stray
from fluxproof.diagnosis.answer.unknown import sparse_term
from fluxproof.diagnosis.answer.verdict import at_floor, is_usual, kind_of
from fluxproof.diagnosis.balance.orders import at_order
from fluxproof.diagnosis.effects import ShaftTorque
from fluxproof.diagnosis.effects.drive_file import caveat
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import Diagnosis, UnknownTerm
from fluxproof.diagnosis.inference.posterior import Posterior
from fluxproof.diagnosis.inference.problem import covariance_of

MOST_RIVALS = 5


@dataclass(frozen=True)
class Judgement:
    """The decision drawn from a posterior: verdict, reported effects, sizes of the misfit and of its residual.

    posterior: over the sets that are possible; told: effects that explain a part; channel: the one in which the
    explained share is counted; stray: a misfit outside the orders of the balance; train, unseen: sizes on fitted and on
    held-out blocks.
    """

    posterior: Posterior
    kind: str
    names: Names
    told: set[str]
    channel: str
    share: float | None
    stray: Stray | None
    train: Sizes
    unseen: Sizes


def judge(posterior, held) -> Judgement:
    """The judgement on a posterior; held: (b,) blocks that were not fitted."""
    setup = posterior.setup
    posterior = setup.call(shown, posterior, held)
    names, best = setup.call(names_of, posterior), posterior.best()
    stray = setup.call(stray_of, posterior, frozenset(names.suspects), held)
    if not stray and _is_noise(posterior, names, held):
        # What only the angle of a free shaft shows is in no size: there the names decide.
        shaft = {n for n, effect in setup.effects.items() if isinstance(effect, ShaftTorque)}
        hidden = setup.view.turns_freely.any() or not measured_torque(setup)
        names = names.withheld(frozenset(shaft if hidden else ()))
    told = told_of(names, best)
    before, after = setup.cells.y, left_by(best, told)
    train = Sizes(setup, before, after, ~held, measured_torque(setup))
    unseen = Sizes(setup, before, after, held, measured_torque(setup))
    channel = train.primary()
    electrical = [n for n in told if not isinstance(setup.effects[n], ShaftTorque)]
    share = unseen.share(channel) if electrical or (told and measured_torque(setup)) else None
    kind = kind_of(names, train, unseen, channel, share, stray)
    return Judgement(posterior, kind, names, told, channel, share, stray, train, unseen)


def told_of(names, best) -> set[str]:
    """Effects of the best set that explain a part of the misfit: those that are named, open, or likely."""
    effects = best.problem.setup.effects
    likely = {n for n, p in names.maybe.items() if p >= k.LIKELY and effects[n].named}
    return (names.said | {n for group in names.open for n in group} | likely) & set(best.names) - set(names.suspects)


def _is_noise(posterior, names, held) -> bool:
    """Whether the misfit is at the floor, or is usual and its larger part is not explained at held-out points.

    Usual is what a log may have whose own error is not known (least_error); that of others is their floor.
    """
    setup, best = posterior.setup, posterior.best()
    before, after = setup.cells.y, left_by(best, told_of(names, best))
    train, unseen = (Sizes(setup, before, after, blocks, measured_torque(setup)) for blocks in (~held, held))
    share = unseen.share(train.primary())
    little = share is not None and share < k.HALF and setup.view.least_error < 1.0
    return at_floor(train) or (little and is_usual(train))


def shown(posterior, held):
    """The posterior without effects that worsen the prediction at held-out points, whatever their probability."""
    while True:
        names = names_of(posterior)
        told = names.said | {n for group in names.open for n in group}
        idle = {n for n in told & set(posterior.best().names) if not helps(posterior, n, told, held)}
        if not idle:
            return posterior
        posterior = posterior.within({n for _, fit in names.fits for n in fit.names} - idle, idle)


def helps(posterior, name, told, held) -> bool:
    """Whether ``told`` leaves no less of the held-out blocks, in units of the usual error, without ``name``.

    Rows beyond the fitted operating points, of which the coefficients' own uncertainty exceeds that error, do not
    count, but for a mean torque in which a load may act, as that uncertainty is the load's.  The torque counts without
    a transducer too: friction and cogging of a free shaft show nowhere else.  Where a load may act that nobody
    recorded, what is left counts up to a limit.
    """
    best, setup = posterior.best(), posterior.setup
    cells, floor2 = setup.cells, setup.usual**2
    loads = (cells.channel == "torque") & (cells.order == 0) & (setup.load > 0.0)
    rows = np.flatnonzero(cells.ok & held[cells.block])
    rows = rows[loads[rows] | (_uncertain(best, told, rows) <= floor2[rows])]
    fewer = best.problem.fit([n for n in best.names if n != name])
    left2 = [fit.left(told & set(fit.names))[rows] ** 2 for fit in (best, fewer)]
    left2 = [np.where(loads[rows], np.minimum(x, k.DISCREPANCY**2 * floor2[rows]), x) for x in left2]
    left = np.zeros(2)
    # The ripple of a free shaft's acceleration is mostly noise, beside which its mean would not count.
    channels = np.where((cells.channel == "torque") & (cells.order == 0), "mean torque", cells.channel)[rows]
    for channel in np.unique(channels):
        mine = channels == channel
        left += [x[mine].sum() / floor2[rows][mine].sum() for x in left2]
    return left[1] >= left[0]


def _uncertain(fit, told, rows) -> np.ndarray:
    """Variance of what the effects ``told`` of a fit explain of some rows, (k,)."""
    mine = [j for j, n in enumerate(fit.take) if fit.problem.keys[n][0] in told]
    keys = [fit.problem.keys[fit.take[j]] for j in mine]
    x = np.array([fit.problem.cells.columns[name][key][rows] for name, key in keys]).reshape(len(mine), len(rows))
    return np.sum(x * (fit.cov[np.ix_(mine, mine)] @ x), axis=0)


def left_by(fit, told):
    """(r,) the misfit without what the effects ``told`` explain; without any, as it was recorded."""
    return fit.left(told) if told else fit.problem.setup.cells.y


def measured_torque(setup) -> bool:
    """Whether a transducer measures it; otherwise it follows from the angle, whose resolution is not the shaft's."""
    return setup.load == 0.0


def conclude(posterior, held, progress=lambda text: None) -> Diagnosis:
    """The answer to a posterior; held: (b,) blocks that were not fitted."""
    j = judge(posterior, held)
    posterior, setup, best = j.posterior, j.posterior.setup, j.posterior.best()
    names, told, channel, share, stray, train, unseen = (
        j.names, j.told, j.channel, j.share, j.stray, j.train, j.unseen
    )  # fmt: skip
    view, cells, before, measured = setup.view, setup.cells, setup.cells.y, measured_torque(setup)
    kind, after = j.kind, left_by(best, told)
    fit = fit_of(train, unseen)
    answer = Diagnosis(kind, "", location=locate(view, cells, setup.noise), fit=fit, search=posterior)
    answer.effects = named_effects(names, posterior, _shares(posterior, names, told, channel, held, measured))
    answer.ambiguity = names.open
    answer.explained_share = share
    answer.remainder = unseen.remainder() if kind != "no_mismatch" else []
    if stray:
        answer.remainder = with_stray(answer.remainder, stray, train)
    if names.open:
        progress("choosing the next recording")
        noise_v = float(np.nanmedian(np.abs(at_order(cells, setup.noise, 0.0))))
        open_names = sorted({n for group in names.open for n in group})
        answer.next_recording = requests(setup, _rivals(names), noise_v, wants_cold(open_names, setup.effects, view))
    if kind in ("unexplained", "partly_explained"):
        answer.unknown_term = _unknown(best, after, stray, names, held, unseen)
    if kind == "unexplained":  # beside a large unknown part even a credible name may be its imitation
        for e in answer.effects:
            title = capital(setup.effects[e.name].title)
            share = f"would explain {100 * e.explains:.0f} %"
            answer.notes.append(f"{title}: {share}; not reported, as the large residual may imitate it.")
        answer.effects, answer.ambiguity, answer.next_recording = [], [], []
        if told:  # nothing is named, so nothing is explained and the whole misfit is left
            after, answer.explained_share = before, 0.0
            train, unseen = (Sizes(setup, before, before, blocks, measured) for blocks in (~held, held))
            answer.fit = fit_of(train, unseen)
    answer.evidence = evidence(view, (cells, before), (cells, after), setup.noise, held)
    answer.sentence = sentence(answer, setup.effects)
    answer.notes += balance_notes(view, held, setup.effects, answer.ambiguity)
    answer.notes += [text for e in answer.effects if (text := caveat(setup.effects[e.name], view, best.c[e.name]))]
    answer.held = held
    for name in names.suspects:
        if answer.unknown_term is None or answer.unknown_term.meaning != setup.effects[name].clause:
            answer.notes.append(f"The residual also looks {as_if(_described(best, name, held, unseen))}.")
    for name in sorted(posterior.idle):
        title = capital(setup.effects[name].title)
        answer.notes.append(f"{title}: rejected, as it worsens the prediction at the held-out operating points.")
    agree = "recording and simulation already agree within noise"
    why = agree if kind == "no_mismatch" else "not significant"
    for name, p in sorted(names.maybe.items(), key=lambda entry: -entry[1])[:3]:
        title = capital(setup.effects[name].title)
        answer.notes.append(f"{title}: possible ({percent_below(p)}), but {why}.")
    return answer


def _rivals(names) -> list:
    """One set per alternative: the most probable one with each open effect."""
    rivals, seen = [], set()
    for _, fit in names.fits:
        mine = frozenset(n for group in names.open for n in group if n in fit.names)
        if mine and mine not in seen:
            seen.add(mine)
            rivals.append(fit)
    return rivals[:MOST_RIVALS]


def _shares(posterior, names, told, channel, held, measured) -> dict[str, float]:
    """{effect: share of the misfit's power above the floor that is left without it}; told: what the rest is without."""
    best, setup = posterior.best(), posterior.setup
    possible, out = names.only_possible(best), {}
    for name in names.said:
        # What is only possible must not take over.
        fewer = best.problem.fit([n for n in best.names if n != name and n not in possible])
        without = Sizes(setup, setup.cells.y, left_by(fewer, told & set(fewer.names)), held, measured)
        with_it = Sizes(setup, setup.cells.y, best.left(told), held, measured)
        mine = [channel] if channel in without.channels else list(without.channels)
        excess = sum(without.channels[c].excess for c in mine)
        more = sum(without.channels[c].left - with_it.channels[c].left for c in mine)
        out[name] = float(np.clip(more / excess, 0.0, 1.0)) if excess > 0.0 else 0.0
    return out


def stray_of(posterior, suspects, held) -> Stray | None:
    """A misfit outside the orders of the balance, after the best set of which every cause is named or in ``suspects``.

    An effect that is only possible is not reported, so it explains nothing here.
    """
    setup = posterior.setup
    effects = setup.effects
    told = [f for f in posterior.fits.values() if all(effects[n].named or n in suspects for n in f.names)]
    best = max(told, key=lambda f: f.value)
    problem = best.problem
    doubts = [effects[n].doubt(best.c[n], setup.view) for n in best.names]
    doubt = np.sqrt(sum((np.square(d) for d in doubts), np.zeros(len(setup.view))))
    sizes = Sizes(setup, setup.cells.y, setup.cells.y, ~held, measured_torque(setup))
    before = sizes.channels["u"].before if "u" in sizes.channels else 0.0
    floor = k.FORMS_LEFT * before if best.names else 0.0
    certain = np.flatnonzero(doubt <= k.FORMS_LEFT * before) if best.names else np.arange(len(setup.view))
    if not len(certain):
        return None
    known = sorted({h for n in best.names for h in effects[n].shows_at.trailing})
    view, rows = problem.view.take(certain), row_residual(best)[certain]
    found = stray_order(view, rows, floor, known) or stray_swing(view, rows, floor)
    if found is None and setup.load == 0.0:
        found = stray_torque(setup.view, setup.projector, setup.cells, best.left(), setup.usual)
    return found


def _unknown(best, after, stray, names, held, unseen) -> UnknownTerm | None:
    """What fits the remainder best: a suspect, or a formula."""
    suspect = max(names.suspects, key=lambda n: names.suspects[n] * best.sizes[best.names.index(n)], default=None)
    if suspect:
        return _described(best, suspect, held, unseen)
    if stray is None:
        setup = best.problem.setup
        return sparse_term(best.problem.view, setup.cells, after, setup.usual, setup.train)
    signal = "torque" if stray.kind == "torque" else "u_dq"
    return UnknownTerm(signal, stray.formula, stray.value, stray.sigma, stray.unit, min(stray.explains, 1.0))


def _described(best, name, held, unseen) -> UnknownTerm:
    """A suspect with its parameter and the share of the remainder that it explains at points that were not fitted."""
    setup, effect = best.problem.setup, best.problem.setup.effects[name]
    channel = "u"
    least = Sizes(setup, setup.cells.y, best.left(), held, True).channels[channel].left
    before = unseen.channels[channel].left
    share = float(np.clip(1.0 - least / before, 0.0, 1.0)) if before > 0.0 else 0.0
    parameter, e = next(iter(effect.estimates(best.c[name], covariance_of(best, name, best.cov), None).items()))
    formula = f"{parameter}, {effect.equation}"
    return UnknownTerm("u_dq", formula, e.value, e.sigma, e.unit, share, effect.clause)
