"""What the search over a slow log's operating points allows to be said: names, exchanges of effects, the verdict.

A set of effects ties with the best one if it explains about as much with no more effects.  What every such set needs is
named; effects that take each other's place are an ambiguity; an effect that no set needs is weak.
"""

from __future__ import annotations

from fluxproof.diagnosis.inference import constants as k

AT_FLOOR = 2.0  # ratio of a misfit to the noise floor up to which it is noise


def sorted_out(found):
    """(asserted names, ambiguity sets, names that are too weak), from the best model and the tied ones."""
    best = found.best.model.names
    sets = sorted([found.best, *found.tied], key=lambda s: s.score)
    needed = [s.model.names for s in sets if not any(o.model.names < s.model.names for o in sets)]
    first = next((names for names in needed if names <= best), best)
    weak = best - frozenset().union(*needed)
    asserted, groups = set(first), []
    differences = [(first - names, names - first) for names in needed if names != first]
    for gone, come in sorted(differences, key=lambda d: len(d[0]) + len(d[1])):
        asserted -= gone
        group = gone | come
        if any(group <= g for g in groups) or group <= set().union(*groups):
            continue  # a combination of two exchanges that are already known
        for g in [g for g in groups if g & group]:
            groups.remove(g)
            group = group | g
        groups.append(group)
    return sorted(asserted), [sorted(g) for g in groups], sorted(weak)


def at_floor(fit, found) -> bool:
    """Whether the misfit before any explanation is noise, in volts and in units of each row's own noise.

    What effects explain at points that were not fitted is not noise, however much is left.
    """
    explained = fit.holdout_before**2 - fit.holdout_after**2 > k.HALF * fit.holdout_before**2
    quiet = found.empty.chi2 <= AT_FLOOR**2 * found.empty.rows and not explained
    return fit.train_before <= AT_FLOOR * fit.noise_floor and (quiet or not found.best.model.names)


def bearable(fit, level) -> bool:
    """Whether physics without a name could leave what is left; level: rms of the voltage [V]."""
    return fit.holdout_after <= max(k.SLOW_REST * level, AT_FLOOR * fit.noise_floor)


def kind_of(fit, found, names, ambiguity, level) -> str:
    """The verdict; names, ambiguity: of ``sorted_out``; level: rms of the voltage [V]."""
    if at_floor(fit, found):
        return "no_mismatch"
    if not names and not ambiguity:
        return "unexplained"
    left = found.best.chi2 / max(found.best.rows - found.best.count, 1)
    if left > k.LEFTOVER and fit.share_left > k.FLOOR_SHARE:
        return "partly_explained" if fit.explained_share >= k.NAMED_SHARE and bearable(fit, level) else "unexplained"
    return "ambiguous" if ambiguity else "explained"
