"""From what the search found to a verdict, names, ambiguities and one sentence."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.cells import told
from fluxproof.diagnosis.curves import step_at_start
from fluxproof.diagnosis.effect import ALIKE, DOUBT, sigma
from fluxproof.diagnosis.result import NamedEffect

LEFTOVER = 2.0  # reduced chi^2 that an explanation may leave
FLOOR_SHARE = 0.15  # of the misfit's rms: a leftover below it is the curve's, not another effect's


CONSTANTS = {"magnet_temperature": "magnet_flux", "resistance_temperature": "resistance"}
# Drift over constant part: below the first it is the constant's, above 1 / second nobody knows.
DRIFTS, STANDS = 0.25, 1.5
STEADY = 0.1  # constant over drift: a thermocouple lags, and so much of a drift may seem to stand

HOLDS = 0.05
LEAST_WEIGHT = 4.0  # of a name: two standard deviations
LEAST_KNOWN = 0.5  # of a parameter's stated standard deviation: at one speed friction's two parts hold each other's
WORSE = 1.05  # misfit on points not fitted, after over before
# Ohmic drop at rated current over the inverter's loss: a device's own slope is seldom larger.
SLOPE_DEVICE, SLOPE_UNCLEAR = 0.12, 0.2
# The same over what the loss grows between 0.12 and 0.3 of rated current: a drop in log(i), fitted with ohms, has up to
# 4.7, every curve that levels off less.  Below the first they are the device's, beyond the second they are not.
GROWS_ON, STANDS_STILL = 2.5, 5.0
STRAIGHT = 0.03  # of the inverter's loss: fewer ohms than that may be what is wrong with its curve


def groups(best, tied, effects, nominal, silent=frozenset(), cold=False, straight=None):
    """(asserted names, ambiguity sets): what all tied models share, and the rest in sets that exclude each other.

    straight: (least, most) [V] of ohms at rated current that no device makes (ohms.py).  cold: whether the
    recording is known to have begun cold, so that what stood at its start is not warmth.
    """
    models = [s.model.names - silent for s in (best, *tied)]
    shared = frozenset.intersection(*models)
    rest = frozenset().union(*models) - shared
    ambiguity = (
        [sorted(rest)] if len(rest) > 1 else []
    )  # one alone is there or is not: too weak to be spoken of
    for drift, constant in CONSTANTS.items():
        if {drift, constant} <= shared:
            moved = effects[drift].size(best.c[drift], nominal)
            stood = effects[constant].size(best.c[constant], nominal)
            if moved < DRIFTS * stood:
                shared -= {drift}
            elif _stays(constant, drift, best, effects) < STEADY * effects[drift].moved(best.c[drift], best.view):
                shared -= {constant}
            elif moved * STANDS > stood and not cold and _like_warmth(constant, best, nominal):
                shared -= {constant}
                ambiguity.append([constant, drift])
    if {"dead_time", "resistance"} <= shared:
        owner = owner_of_ohms(best, effects, nominal, straight)
        if owner != "resistance":
            shared -= {"resistance"}
            ambiguity += [["dead_time", "resistance"]] if not owner else []
    return sorted(shared), ambiguity


def owner_of_ohms(solution, effects, nominal, straight=None) -> str:
    """dead_time or resistance: whose the ohms beside an inverter's loss are; "" where nobody can tell.

    A device's slope is ohms too, but never less than none, and one that grows up to rated current grows before as well.
    straight: (least, most) of them [V] that are none's.  More than all that the loss grows are a winding's; where they
    may be none, they are the device's.
    """
    least, most = straight or (-np.inf, np.inf)
    loss = solution.c["dead_time"]
    size = effects["dead_time"].size(loss, nominal)
    owner = _owner_by_growth(solution, size, nominal)
    if least > max(abs(loss.get("growth", 0.0)), STRAIGHT * size):
        return "resistance"
    maybe_none = straight and least <= STRAIGHT * size and most >= -STRAIGHT * size
    return "dead_time" if not owner and maybe_none else owner


def _owner_by_growth(solution, size, nominal) -> str:
    """The same by what a loss of a full size [V] grows between 0.12 and 0.3 of rated current."""
    (signed, *_), loss = solution.c["resistance"].values(), solution.c["dead_time"]
    ohms = abs(signed) * nominal.machine.rated_current_a
    if signed < 0.0:
        return "resistance"
    growth = loss.get("growth", 0.0)
    if growth:
        at = list(loss).index("growth")
        most = abs(growth) + DOUBT * sigma(solution.covariance["dead_time"], at)
        if ohms > STANDS_STILL * most:
            return "resistance"
    share = ohms / max(size, 1e-9)
    if ohms < GROWS_ON * growth or share < SLOPE_DEVICE:
        return "dead_time"
    return "resistance" if share >= SLOPE_UNCLEAR else ""


def _stays(constant, drift, solution, effects) -> float:
    """Size of a constant, less what the drift's free course takes back of it as soon as the recording has begun.

    A thermocouple that lags leaves a step there which is in no other part of the recording.
    """
    (value, *_), step = solution.c[constant].values(), step_at_start(solution.c[drift])
    if value * step < 0.0:
        value = np.sign(value) * max(abs(value) - abs(step), 0.0)
    return effects[constant].size({next(iter(solution.c[constant])): value}, solution.view.nominal)


WARMTH = {"magnet_flux": -1.0, "resistance": 1.0}  # what a machine that was warm from the start does to it


def _like_warmth(constant, solution, nominal) -> bool:
    """Whether a wrong constant has the sign that warmth from the start would give it."""
    return WARMTH[constant] * next(iter(solution.c[constant].values())) > 0.0


def lag_of_currents(solution) -> float:
    """By how much the measured currents alone are late [s], where a delay and a skew of a solution say that; else 0.

    Voltage late and angle early by the same are nothing but currents that are late: a filter in front of the
    converters.  No effect is that, and neither of the two names is.
    """
    c = solution.c
    if not {"delay", "sampling_skew"} <= solution.model.names:
        return 0.0
    delay, skew = c["delay"]["tau"], c["sampling_skew"]["tau"] - c["sampling_skew"].get("angle", 0.0)
    return delay if abs(delay + skew) < ALIKE * delay else 0.0


def verdict(names, ambiguity, left, lag=0.0) -> str:
    """The verdict from the names, the ambiguity sets, what remains and a lag that no effect is."""
    if left.stray or left.group or lag:
        return "unexplained"
    if names and left.fit.holdout_after > WORSE * left.fit.holdout_before:
        return "unexplained"  # a fit that does not carry over explains nothing
    if not names and not ambiguity:
        return "no_mismatch" if left.reduced <= LEFTOVER else "unexplained"
    if left.reduced > LEFTOVER and left.fit.share_left > FLOOR_SHARE:
        return "unexplained"
    return "ambiguous" if ambiguity else "explained"


def carried(names, found, cells, worth, effects):
    """Names that bring more than what is left where they live, where much is left; ``worth(solution, name)`` in chi^2.

    A harmonic that a dead time's curve leaves says nothing against ohms: what counts are the orders of a channel that
    hold the effect.  An error of the record acts on all of it, so that all that is left speaks against it.
    cells: of the solution's view.
    """
    best = found.best
    if best.dispersion <= LEFTOVER:
        return names
    use = cells.ok & found.train
    left = np.where(use, (best.residual / found.sigma) ** 2, 0.0)
    everywhere = np.ones(len(use), bool)

    def where(name):
        return everywhere if effects[name].corrects else lives(cells, name, best.c[name], found.sigma, use)

    return [n for n in names if worth(best, n) > float(left[where(n)].sum())]


def lives(cells, name, c, sigma, use):
    """(r,) rows of the channels' orders that hold an effect with coefficients c, each at least HOLDS of its power."""
    columns = cells.columns[name]
    own = sum(v * columns[told(columns, k)] for k, v in c.items() if told(columns, k))
    power, out = np.where(use, (own / sigma) ** 2, 0.0), np.zeros(len(use), bool)
    for channel in np.unique(cells.channel):
        for order in np.unique(cells.order[cells.channel == channel]):
            rows = (cells.channel == channel) & (cells.order == order)
            out |= rows & (power[rows].sum() >= HOLDS * power.sum())
    return out


def beyond_doubt(spread, names) -> list[str]:
    """Names whose coefficients are larger than their uncertainty where every operating point is counted once.

    A name of which no parameter is known to twice its value says nothing either, whatever the fit makes of it.
    """
    others = spread.others()
    return [name for name in names if _weight(spread, name) >= LEAST_WEIGHT and _known(spread.estimates(name, others))]


def _known(estimates) -> bool:
    return not estimates or any(abs(e.value) >= LEAST_KNOWN * e.sigma for e in estimates.values())


def _weight(spread, name) -> float:
    """Square of an effect's coefficients in standard deviations, per coefficient."""
    c, covariance = np.array(list(spread.solution.c[name].values())), spread.covariance[name]
    return float(c @ np.linalg.pinv(covariance) @ c) / max(len(c), 1)


def named(spread, names, empty) -> list[NamedEffect]:
    """The asserted effects of a solution with their parameters; spread: uncertainty.Plain of it."""
    out, solution, effects, others = [], spread.solution, spread.effects, spread.others()
    for name in names:
        effect, c = effects[name], solution.c[name]
        explained = max(empty.chi2 - empty.rows, 1e-9)
        share = effect.relative({n: solution.c[n] for n in names}, spread.nominal)
        estimates = spread.estimates(name, others)
        for e in estimates.values() if share != 1.0 else ():
            # Either may be what it is a share of: ohms beyond the nameplate's may stand outside the winding.
            e.value, e.sigma = share * e.value, float(np.hypot(share * e.sigma, (1.0 - share) * e.value))
        out.append(
            NamedEffect(
                name,
                float(np.clip(1.0 - 1.0 / (1.0 + _weight(spread, name) / 4.0), 0.5, 0.999)),
                estimates,
                float(np.clip((empty.chi2 - solution.chi2) / explained, 0.0, 1.0)),
                effect.plant({k: share * v for k, v in c.items()}, spread.nominal),
            )
        )
    return out


def size_text(effect, estimates) -> str:
    """'v_dead_v = 5.1 +- 0.1 V' of the effect's first parameters."""
    parts = []
    for key, e in list(estimates.items())[:3]:
        unit = "" if e.unit == "1" else f" {e.unit}"
        parts.append(f"{key} = {e.value:.4g} +- {e.sigma:.1g}{unit}")
    return ", ".join(parts)


def sentence(verdict, effects_named, ambiguity, fit, effects, location) -> str:
    """The verdict in one sentence."""
    if verdict == "no_mismatch":
        return f"Simulation and recording agree: the misfit of {fit.train_before:.3g} V is noise."
    what = " and ".join(
        f"{effects[e.name].title} ({size_text(effects[e.name], e.parameters)})" for e in effects_named
    )
    before, after = fit.holdout_before, fit.holdout_after
    gain = f"the misfit on operating points not fitted falls from {before:.3g} V to {after:.3g} V"
    if verdict == "explained":
        return f"{what[0].upper()}{what[1:]}: {gain}."
    if verdict == "ambiguous":
        sets = "; ".join(" or ".join(group) for group in ambiguity)
        first = f"{what[0].upper()}{what[1:]} for certain; beyond it t" if what else "T"
        return f"{first}his recording cannot tell {sets} apart."
    where = f" in {location.signal}" if location.signal else ""
    return f"Unknown: nothing in the catalogue explains the misfit of {fit.train_before:.3g} V{where}."
