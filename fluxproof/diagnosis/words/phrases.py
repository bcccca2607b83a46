# SPDX-License-Identifier: BSD-3-Clause
"""Phrases of which headline, details and advice are made; titles are those that the effects declare."""

from __future__ import annotations

from dataclasses import replace

from fluxproof.diagnosis.ground.quantities import ascii_of, measured, quantity

SIGNALS = {"u_dq": "voltage", "u_d": "d-axis voltage", "u_q": "q-axis voltage", "u": "voltage",
           "current_sum": "sum of the phase currents", "torque": "torque"}  # fmt: skip
CORRECTED = ("converted", "corrected")  # actions of findings by which columns were read otherwise than recorded


def said(effect, effects, most=None, brackets=False) -> str:
    """'dead time of the inverter: dead-time voltage 5.1 +- 0.1 V' of a NamedEffect.

    most: number of its largest parameters, None: all; brackets: parameters in brackets instead of behind a colon.
    """
    entry = effects.get(effect.name)
    declared = {p.name: p for p in entry.parameters} if entry else {}
    estimates = dict(effect.parameters)
    if most is not None and len(estimates) > most:
        unit = next(iter(estimates.values())).unit
        same = {k: e for k, e in estimates.items() if e.unit == unit}
        estimates = dict(sorted(same.items(), key=lambda item: -abs(item[1].value))[:most])
    texts = [_parameter(declared.get(key), key, e) for key, e in estimates.items()]
    title, sizes = title_of(effect.name, effects), ", ".join(texts)
    if not texts:
        return title
    return f"{title} ({sizes})" if brackets else f"{title}: {sizes}"


def _parameter(p, key, e) -> str:
    """'later by 27.0 +- 0.3 us', or 'earlier by' of a negative one; p: its Parameter, or None."""
    if p is not None and p.negative and e.value < 0.0:
        return f"{p.negative} {size_text(replace(e, value=-e.value))}"
    return f"{p.called if p is not None else key.replace('_', ' ')} {size_text(e)}"


def size_text(e) -> str:
    """'5.1 +- 0.1 V' of an Estimate or an UnknownTerm: one digit of the error, two if it begins with 1."""
    return ascii_of(measured(e.value, e.sigma, e.unit, digits=1)).replace(" (uncertainty unknown)", "")


def as_if(u) -> str:
    """'as if the measured currents were late (27.0 +- 0.3 us)' of a term whose meaning is known."""
    return f"as if {u.meaning} ({size_text(u)})"


def located(answer) -> str:
    """'mostly at order 6 of the voltage (1.2 V)' of the largest remainder."""
    if not answer.remainder:
        signal = answer.location.signal
        return f"in the {SIGNALS.get(signal, signal)}" if signal else "not located"
    return f"mostly {part_text(max(answer.remainder, key=lambda r: r.share))}"


def part_text(r) -> str:
    """'at order 6 of the voltage (1.2 V)' of a Remainder."""
    signal = SIGNALS.get(r.signal, r.signal)
    place = f"at order {r.order:.4g} of the {signal}" if r.order else f"in the mean {signal}"
    return f"{place} ({ascii_of(quantity(r.size, r.unit, 2))})"


def percent_below(share: float) -> str:
    """A share of less than one in percent, never rounded up to 100 %."""
    return f"{min(100.0 * max(share, 0.0), 99.0):.0f} %"


def title_of(name, effects) -> str:
    """The title of an effect, or its name in words."""
    return effects[name].title if name in effects else name.replace("_", " ")


def joined(texts, word="and") -> str:
    """'a, b and c'."""
    return f"{', '.join(texts[:-1])} {word} {texts[-1]}" if len(texts) > 1 else "".join(texts)


def corrected(answer) -> list[str]:
    """What the checks read otherwise than recorded, as clauses: 'phase currents b and c are swapped'."""
    found = [p.message.split(": misfit ")[0] for p in answer.problems if p.action in CORRECTED]
    return list(dict.fromkeys(found))


def capital(text: str) -> str:
    return text[:1].upper() + text[1:]
