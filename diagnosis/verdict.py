"""Verdict, asserted names, ambiguity sets and the sentence, from the result of the search."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.cells import column_of
from fluxproof.diagnosis.curves import step_at_start
from fluxproof.diagnosis.effect import ALIKE, DOUBT, sigma
from fluxproof.diagnosis.result import NamedEffect

LEFTOVER = 2.0  # largest reduced chi^2 of an accepted explanation
# Share of the misfit's power that names must explain beside a remainder: this search does not know how much of a
# remainder may imitate an effect.
NAMED_SHARE = 0.9
FLOOR_SHARE = 0.15  # of the misfit's rms: a smaller residual is attributed to the curve shapes, not to another effect


CONSTANTS = {"magnet_temperature": "magnet_flux", "resistance_temperature": "resistance"}
# Drift relative to the constant part: below DRIFTS it belongs to the constant; above 1 / STANDS it is undecided.
DRIFTS, STANDS = 0.25, 1.5
STEADY = 0.1  # constant over drift: the lag of a thermocouple makes this share of a drift look constant

HOLDS = 0.05  # least share of an effect's power in an order that counts as one of its orders
LEAST_WEIGHT = 4.0  # threshold for a name: two standard deviations, squared
# Least value of a parameter in its stated standard deviations.  At one speed, Coulomb and viscous friction are
# collinear, and each sigma contains the other one's value.
LEAST_KNOWN = 0.5
WORSE = 1.05  # largest ratio of the held-out misfit, after over before
# Ohmic drop at rated current over the inverter's loss: the slope of a device is seldom larger.
SLOPE_DEVICE, SLOPE_UNCLEAR = 0.12, 0.2
# Ohmic drop over the growth of the loss between 0.12 and 0.3 of rated current.  A drop in log(i), fitted together with
# a resistance, gives up to 4.7; a curve that levels off gives less.  Below the first value the slope belongs to the
# device, beyond the second to a resistance.
GROWS_ON, STANDS_STILL = 2.5, 5.0
STRAIGHT = 0.03  # of the inverter's loss: a smaller ohmic drop may be an error of the loss curve


def groups(best, tied, effects, nominal, silent=frozenset(), cold=False, straight=None):
    """(asserted names, ambiguity sets): the names that all tied models share, and the others as alternatives.

    straight: (least, most) [V] ohmic drop at rated current that no device explains (ohms.py).  cold: whether the
    recording is known to have begun cold, so that a deviation at its start is not due to temperature.
    """
    models = [s.model.names - silent for s in (best, *tied)]
    shared = frozenset.intersection(*models)
    rest = frozenset().union(*models) - shared
    ambiguity = (
        [sorted(rest)] if len(rest) > 1 else []
    )  # a single optional effect has no alternative: it is too weak to be reported
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
    """Cause of an ohmic drop next to an inverter's loss: "dead_time" (the devices) or "resistance"; "" if undecided.

    The slope of a device is ohmic too, but never negative, and a device whose drop grows up to rated current also
    grows below.  straight: (least, most) [V] of the drop that no device explains: if the least exceeds the growth of
    the loss, it is a winding resistance; if the range contains zero, the drop belongs to the devices.
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
    """The same decision from the growth of the loss between 0.12 and 0.3 of rated current; size: full loss [V]."""
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
    """Size of a constant, minus the part that the drift's free course cancels at the start of the recording.

    A lagging thermocouple causes such a step at the start and nowhere else.
    """
    (value, *_), step = solution.c[constant].values(), step_at_start(solution.c[drift])
    if value * step < 0.0:
        value = np.sign(value) * max(abs(value) - abs(step), 0.0)
    return effects[constant].size({next(iter(solution.c[constant])): value}, solution.view.nominal)


WARMTH = {"magnet_flux": -1.0, "resistance": 1.0}  # sign of the change in a machine that was warm from the start


def _like_warmth(constant, solution, nominal) -> bool:
    """Whether the deviation of a constant has the sign that a warm start would cause."""
    return WARMTH[constant] * next(iter(solution.c[constant].values())) > 0.0


def lag_of_currents(solution) -> float:
    """Lag of the measured currents alone [s], if delay and skew of a solution are equal and opposite; else 0.

    Voltage late and angle early by the same time are equivalent to late currents, as a filter in front of the
    converters causes.  The catalogue has no such effect, so that neither name may be asserted.
    """
    c = solution.c
    if not {"delay", "sampling_skew"} <= solution.model.names:
        return 0.0
    delay, skew = c["delay"]["tau"], c["sampling_skew"]["tau"] - c["sampling_skew"].get("angle", 0.0)
    return delay if abs(delay + skew) < ALIKE * delay else 0.0


def verdict(names, ambiguity, left, lag=0.0) -> str:
    """The verdict from the names, the ambiguity sets, the residual and a lag of the currents [s]."""
    if left.stray or left.group or lag:
        return "unexplained"
    if names and left.fit.holdout_after > WORSE * left.fit.holdout_before:
        return "unexplained"  # a fit that does not generalise explains nothing
    if not names and not ambiguity:
        return "no_mismatch" if left.reduced <= LEFTOVER else "unexplained"
    if left.reduced > LEFTOVER and left.fit.share_left > FLOOR_SHARE:
        return "unexplained"
    return "ambiguous" if ambiguity else "explained"


def carried(names, found, cells, worth, effects):
    """Names whose gain in chi^2, ``worth(solution, name)``, exceeds the residual in their own channels and orders.

    Applied only if the residual is significant.  Only orders in which the effect has power count: a residual harmonic
    of a dead-time curve is no evidence against a resistance.  A measurement error acts on every order, so that the
    whole residual counts against it.  cells: of the solution's view.
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
    """(r,) bool: rows of the channels and orders that contain at least HOLDS of the power of an effect with c."""
    columns = cells.columns[name]
    own = sum(v * columns[column_of(columns, k)] for k, v in c.items() if column_of(columns, k))
    power, out = np.where(use, (own / sigma) ** 2, 0.0), np.zeros(len(use), bool)
    for channel in np.unique(cells.channel):
        for order in np.unique(cells.order[cells.channel == channel]):
            rows = (cells.channel == channel) & (cells.order == order)
            out |= rows & (power[rows].sum() >= HOLDS * power.sum())
    return out


def beyond_doubt(spread, names) -> list[str]:
    """Names whose coefficients exceed their uncertainty when every operating point counts once.

    A name is also dropped if the stated sigma of each of its parameters is more than twice its value.
    """
    others = spread.others()
    return [name for name in names if _weight(spread, name) >= LEAST_WEIGHT and _known(spread.estimates(name, others))]


def _known(estimates) -> bool:
    return not estimates or any(abs(e.value) >= LEAST_KNOWN * e.sigma for e in estimates.values())


def _weight(spread, name) -> float:
    """Squared coefficients of an effect in standard deviations (Mahalanobis distance), per coefficient."""
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
            # The reference may be either resistance: ohms beyond the nameplate may lie outside the winding.
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
        return f"Simulation and recording agree: the misfit of {fit.train_before:.3g} V is within the noise."
    what = " and ".join(
        f"{effects[e.name].title} ({size_text(effects[e.name], e.parameters)})" for e in effects_named
    )
    before, after = fit.holdout_before, fit.holdout_after
    gain = f"the misfit at operating points that were not fitted falls from {before:.3g} V to {after:.3g} V"
    if verdict == "explained":
        return f"{what[0].upper()}{what[1:]}: {gain}."
    if verdict == "ambiguous":
        sets = "; ".join(" or ".join(group) for group in ambiguity)
        first = f"{what[0].upper()}{what[1:]} for certain; beyond that, t" if what else "T"
        return f"{first}his recording cannot separate {sets}."
    where = f" in {location.signal}" if location.signal else ""
    return f"Unknown: no effect in the catalogue explains the misfit of {fit.train_before:.3g} V{where}."
