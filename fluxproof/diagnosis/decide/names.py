# SPDX-License-Identifier: BSD-3-Clause
"""Which effects are named, which are ambiguous, and with what confidence.

The confidence in a name is the probability of its presence, the sum over all sets that contain it.  What no model has
is in the marginal likelihood of every set.  Only where much is left is it asked whether that may imitate what was found
(credibility.py): of a partly explained misfit (verdict.py), of a suspect, of an interpretation (interpretation.py).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np

from fluxproof.diagnosis.balance.shaft import measures_torque
from fluxproof.diagnosis.decide.ambiguity import ambiguities
from fluxproof.diagnosis.decide.bent import bent_groups
from fluxproof.diagnosis.decide.credibility import credibilities
from fluxproof.diagnosis.decide.estimates import estimates_in, named_effects
from fluxproof.diagnosis.decide.sized import has_size, is_sized
from fluxproof.diagnosis.effects.constant import Constant
from fluxproof.diagnosis.effects.drive_file import Restates
from fluxproof.diagnosis.ground import constants as k

TORQUE_PER_AMPERE = {("i",), ("magnet_flux_wb",)}  # what an effect rescales that changes it


@dataclass(frozen=True)
class Names:
    """named: {effect: probability}; ambiguous: groups of which one effect is present.

    possible: {effect: probability} of effects that are neither named nor an alternative.  suspects: {effect:
    probability} of causes that are as sure as a name but that no simulation carries.  minor: {effect: probability} of
    what is as sure as a name and too small to act on (relevant.py).  sizeless: {effect: probability} of what is as sure
    as a name and has no size (sized.py).  fits: [(probability, fit)] of the sets that hold the mass of the posterior,
    the most probable first.
    """

    named: dict[str, float]
    ambiguous: tuple[tuple[str, ...], ...]
    possible: dict[str, float]
    suspects: dict[str, float] = field(default_factory=dict)
    fits: tuple = ()
    minor: dict[str, float] = field(default_factory=dict)
    sizeless: dict[str, float] = field(default_factory=dict)

    @property
    def asserted(self) -> set[str]:
        """Effects that are named or in an ambiguity."""
        return set(self.named) | {n for group in self.ambiguous for n in group}

    def only_possible(self, fit) -> set[str]:
        """Effects of a fit that are neither named, nor an alternative, nor as sure as a name."""
        return set(fit.names) - self.asserted - set(self.suspects) - set(self.minor)

    def withheld(self, but=frozenset()) -> Names:
        """The same with nothing asserted but the effects ``but``: what else was named is possible."""
        kept = {n: p for n, p in self.named.items() if n in but}
        possible = {n: p for n, p in self.named.items() if n not in but}
        groups = tuple(g for g in self.ambiguous if but.issuperset(g))
        return replace(self, named=kept, ambiguous=groups, possible=self.possible | possible, suspects={})


def names_of(posterior) -> Names:
    """Names and ambiguities of a posterior.

    A name without a size over all probable sets is open: its size is that of a rival in some of them, where it is not.
    """
    kept = _mass(posterior)
    names = _names_of(posterior, kept, ())
    open_ = _sizeless(names, posterior)
    return _names_of(posterior, kept, open_) if open_ else names


def _names_of(posterior, kept, open_) -> Names:
    """Names and ambiguities, where the effects ``open_`` are in a set only if they have a size there."""
    best, effects = posterior.best(), posterior.setup.effects
    seen = {n for _, fit in kept for n in fit.names}
    present = {n: p for n, p in posterior.present().items() if n in seen}
    sure = {n: p for n, p in present.items() if p >= 1.0 - k.DOUBTED and n in best.names}
    sizeless = {n: sure.pop(n) for n in open_}
    there = [(p, frozenset(n for n in fit.names if n not in open_ or is_sized(fit, n))) for p, fit in kept]
    present |= {n: sum(p for p, names in there if n in names) for n in open_}
    named = {n: p for n, p in sure.items() if effects[n].named}
    suspects = _no_imitations({n: p for n, p in sure.items() if not effects[n].named}, best)
    groups = tuple(_with_what_depends(g, named, kept) for g in ambiguities(there, present, sure, effects))
    twins = [n for n in named if _has_a_twin(n, effects, groups)]
    if twins and not measures_torque(posterior.setup.view):  # which a wrong current changes, and a wrong nameplate not
        groups += tuple(_with_its_twin(n, effects[n], best.c[n]) for n in twins)
    groups += bent_groups([n for n in named if not any(n in g for g in groups)], best, effects)
    same = {n for n, e in effects.items() if isinstance(e, Constant) and e.rescales in TORQUE_PER_AMPERE}
    if same & {*named, *itertools.chain(*groups)} and not posterior.setup.view.has_voltage.any():
        groups = _with_the_same_torque(groups, same)
    named = {n: p for n, p in named.items() if not any(n in g for g in groups)}
    grouped = {n for g in groups for n in g}
    sizeless = {n: p for n, p in sizeless.items() if n not in grouped}
    rest = present.keys() - sure.keys() - sizeless.keys() - grouped
    possible = {n: p for n, p in present.items() if n in rest and p >= k.PRESENT}
    return Names(named, groups, possible, suspects, tuple(kept), sizeless=sizeless)


def _sizeless(names, posterior) -> set[str]:
    """Names of which every parameter is compatible with zero, its standard deviation that of the answer."""
    best, effects = posterior.best(), posterior.setup.effects
    nominal = best.problem.view.nominal
    found = named_effects(names, posterior, {})
    return {e.name for e in found if not has_size(e.parameters, effects[e.name], best.c[e.name], nominal)}


def _no_imitations(suspects, fit) -> dict[str, float]:
    """The suspects that no remainder may imitate (credibility.py): of a cause that no formula has, any is a guess.

    A second harmonic of the EMF, which the catalogue does not have, was told as a resolver with unequal signals.
    """
    real = credibilities(fit) if suspects else {}
    return {n: p for n, p in suspects.items() if real[n] >= 1.0 - k.DOUBTED}


def _has_a_twin(name, effects, groups) -> bool:
    """Whether no voltage balance can tell an effect outside of the ambiguities from another one."""
    return isinstance(effects[name], Restates) and not any(name in g for g in groups)


def _with_its_twin(name, effect, c) -> tuple[str, ...]:
    """An ambiguity of an effect and the one that leaves the same at every operating point.

    Small effects beside them may prefer one: a loss of 90 mV, found on currents recorded at 0.3, preferred the machine.
    """
    return tuple(sorted((name, effect.twin(c))))


def _with_the_same_torque(groups, same: set[str]) -> tuple[tuple[str, ...], ...]:
    """Ambiguities of a recording without voltages, in which factors on the torque per ampere are told together."""
    touched = [g for g in groups if same & set(g)] or [()]
    return (*(g for g in groups if not same & set(g)), *(tuple(sorted(same.union(g))) for g in touched))


def _with_what_depends(group, named, kept) -> tuple[str, ...]:
    """A group with the names whose sizes depend on which of its effects is there: a part of them is not known.

    A resistance beside a factor on all currents, or on all constants of the drive file, is 75 or 150 mOhm.
    """
    members = [next((fit for _, fit in kept if n in fit.names), None) for n in group]
    fits = [fit for fit in members if fit is not None]
    return tuple(sorted({*group, *(n for n in named if _depends(n, fits))}))


def _depends(name, fits) -> bool:
    """Whether a size of an effect differs between sets by more than their errors and the share ``DEPENDS`` of it."""
    sizes = [estimates_in(fit, name) for fit in fits if name in fit.names]
    for first, second in itertools.combinations(sizes, 2):
        for key in first.keys() & second.keys():
            a, b = first[key], second[key]
            apart = abs(a.value - b.value)
            if apart > max(k.DEPENDS * max(abs(a.value), abs(b.value)), k.SURE * np.hypot(a.sigma, b.sigma)):
                return True
    return False


def _mass(posterior) -> list:
    """[(probability, fit)] of the most probable sets, up to all but LEFT_OUT of the mass."""
    held, kept = 0.0, []
    for p, fit in posterior.weights():
        kept.append((p, fit))
        held += p
        if held >= 1.0 - k.LEFT_OUT:
            break
    return kept
