"""The verdict, from names and sizes, and its sentence."""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.inference import constants as k


def kind_of(names, train, held, share, stray) -> str:
    """The verdict.  names: Names; train, held: Sizes; share: explained share; stray: a misfit outside the orders."""
    if not names.confidence and not names.open:
        if names.suspects:
            return "unexplained"
        quiet = all(s.before <= k.FLOOR * s.floor for s in train.channels.values())
        return "no_mismatch" if quiet and not stray and not standing_out(train) else "unexplained"
    sizes = [s for c, s in held.channels.items()]
    at_floor = all(s.after <= k.FLOOR * s.floor for s in sizes)
    whole = at_floor or (share is not None and share >= 1.0 - k.SMALL)
    if not whole or stray:
        return "partly_explained" if share is not None and share >= k.HALF else "unexplained"
    return "ambiguous" if names.open else "explained"


def standing_out(sizes) -> list:
    """[(channel, order)] whose remainder exceeds its noise floor and is a large part of what was there before."""
    return [
        key for key, s in sizes.orders.items()
        if key[0] in sizes.channels and s.after > k.FLOOR * s.floor and s.left > 0.1 * max(s.excess, 1e-300)
    ]  # fmt: skip


def size_text(estimates) -> str:
    """'v_dead_v = 5.1 +- 0.1 V' of an effect's first parameters."""
    parts = []
    for key, e in list(estimates.items())[:3]:
        unit = "" if e.unit == "1" else f" {e.unit}"
        parts.append(f"{key} = {e.value:.4g} +- {e.sigma:.1g}{unit}")
    return ", ".join(parts)


def sentence(answer, effects) -> str:
    """The verdict of an answer in one or two sentences; effects: the catalogue."""
    fit = answer.fit
    what = " and ".join(f"{effects[e.name].title} ({size_text(e.parameters)})" for e in answer.effects)
    what = what[:1].upper() + what[1:]
    fall = (
        "the misfit at operating points that were not fitted falls"
        f" from {fit.holdout_before:.3g} V to {fit.holdout_after:.3g} V"
    )
    sets = "; ".join(" or ".join(effects[n].title if n in effects else n for n in g) for g in answer.ambiguity)
    if answer.verdict == "no_mismatch":
        floor = f"is at the noise floor of {fit.noise_floor:.3g} V"
        return f"Simulation and recording agree: the misfit of {fit.train_before:.3g} V {floor}."
    if answer.verdict == "explained":
        return f"{what}: {fall}."
    if answer.verdict == "ambiguous":
        begin = f"{what} for certain; beyond that, t" if what else "T"
        return f"{begin}his recording cannot separate {sets}: {fall}."
    where = located(answer)
    meaning = answer.unknown_term.meaning if answer.unknown_term else ""
    if answer.verdict == "partly_explained":
        begin = what or f"One of {sets}"
        share = 100.0 * (answer.explained_share if answer.explained_share is not None else 0.0)
        explained = f"{begin} explains {min(share, 99.9):.0f} % of the misfit's power"
        cause = f"is {as_if(answer.unknown_term)}" if meaning else "has no known cause"
        return f"{explained}: {fall}; the rest is {where} and {cause}."
    if meaning:
        u = answer.unknown_term
        return (
            f"No parameter of the simulation explains the misfit of {fit.train_before:.3g} V, {where}: it is"
            f" {as_if(answer.unknown_term)}, which would explain {100.0 * u.explains:.0f} % of it."
        )
    return f"Unknown: no effect in the catalogue explains half of the misfit of {fit.train_before:.3g} V, {where}."


def as_if(u) -> str:
    """'as if the measured currents were late (2.7e-05 +- 3e-07 s)' of a term whose meaning is known."""
    return f"as if {u.meaning} ({u.value:.3g} +- {u.sigma:.1g} {u.unit})"


def located(answer) -> str:
    """'mostly in u_dq at order 6 (1.2 V)' of the largest remainder."""
    if not answer.remainder:
        return f"in {answer.location.signal}" if answer.location.signal else "not located"
    r = max(answer.remainder, key=lambda x: x.share)
    at = f" at order {r.order:g}" if r.order else ""
    return f"mostly in {r.signal}{at} ({np.format_float_positional(r.size, 3, fractional=False, trim='-')} {r.unit})"
