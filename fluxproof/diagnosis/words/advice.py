# SPDX-License-Identifier: BSD-3-Clause
"""What to do next, in one or two sentences for each verdict."""

from __future__ import annotations

import re

import numpy as np

from fluxproof.diagnosis.effects import MeasurementError, is_usual
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.quantities import RPM, decimals, fixed
from fluxproof.diagnosis.words.phrases import CORRECTED, SIGNALS, capital, corrected, joined

MOST_TITLES = 4
MOST_CHECKED = 2  # causes of a best fit
NEAR = 0.05  # of an order: closer ones are the same
VARIABLES = {"omega": "the speed", "omega_e": "the speed", "i_d": "i_d", "i_q": "i_q", "i": "the current", "t": "time",
             "u_dc": "the bus voltage", "temp_winding": "the winding's temperature"}  # fmt: skip
HOW = {  # by the code of a finding
    "swapped_phases": "exchange the names of the columns",
    "sign": "give the column factor = -1",
    "rotation": "give angle and speed factor = -1, or exchange two phases",
    "unit": "state the unit",
}


def advice(answer, nominal, effects, improved=True, worse=False) -> str:
    """What to do after this answer.

    effects: the catalogue with the causes beyond it; improved: whether an improved drive file may differ; worse:
    whether the closed loop rejected it.
    """
    if worse:
        return (
            "Do not take these values into the drive file: in the closed loop they are further from the recording than "
            "the nominal drive. Check first what the columns and their units mean."
        )
    if answer.verdict == "bad_recording":
        return "Correct the findings of the checks, in the recording or in [columns] of the drive file; diagnose again."
    if answer.verdict == "digital_mismatch":
        return (
            "Compare the registers and the build of the core with the drive file, and record again: the physics is "
            "diagnosed only when the controller agrees with its golden model."
        )
    action, columns = _next(answer, nominal, effects, improved), _columns(answer)
    if not columns:
        return action
    if answer.verdict == "no_mismatch":  # the headline names it
        return f"Correct it {columns}. {action}"
    return f"{action} In addition, {joined(corrected(answer))}: correct this {columns}."


def _columns(answer) -> str:
    """Where and how to correct columns so that the next recording is read without a guess; "" if none are."""
    found = [p for p in answer.problems if p.action in CORRECTED]
    how = dict.fromkeys(HOW[p.code] for p in found if p.code in HOW)
    where = "in [columns] of the drive file, or in the log"
    return f"{where}{f': {joined(list(how))}' if how else ''}" if found else ""


def _next(answer, nominal, effects, improved) -> str:
    """What to do after a verdict on the physics."""
    if answer.verdict == "no_mismatch":
        change = "No other change" if corrected(answer) else "No change"
        torque = "" if answer.evidence.torque else ", and for friction and cogging torque (no torque was compared),"
        return (
            f"{change} needed for {covered(answer, nominal)}. "
            f"Outside this range{torque} the drive file is not verified."
        )
    if answer.verdict == "explained":
        return _take(answer, nominal, effects, improved)
    if answer.verdict == "ambiguous":
        return _record(answer, nominal) or _separated(answer, effects)
    if answer.verdict == "partly_explained":
        return f"{_take(answer, nominal, effects, improved)} {_where(answer, nominal, effects)}"
    return _where(answer, nominal, effects)


def _take(answer, nominal, effects, improved) -> str:
    """Which values of an explanation go into the drive file, and which belong to the recording."""
    if answer.conventions and not improved:
        return "Read the recording as stated and diagnose again: the drive file stays as it is."
    if answer.conventions:
        open_ = any(c.rivals for c in answer.conventions)
        rivals = " If an alternative interpretation is the right one, correct that instead." if open_ else ""
        found = " and contains the identified values" if answer.effects else ""
        return f"Use drive_improved.toml, which applies this interpretation{found}, and diagnose again.{rivals}"
    usual = [e for e in answer.effects if e.name not in effects or _is_usual(e, effects, nominal)]
    if answer.effects and not usual:
        return "Check it on the drive first: a size that no usual drive has is not written to a drive file."
    if not improved or not any(e.plant for e in usual):
        return "Correct the recording as stated: the drive file has no key for these effects."
    trims = any(isinstance(effects.get(e.name), MeasurementError) for e in usual)
    later = " Measurement errors remain in this recording; the trims act from the next recording on." if trims else ""
    whole_periods = "".join(f" {text}" for text in _periods(answer, nominal, effects))
    return f"Simulate with drive_improved.toml, which contains the identified values.{later}{whole_periods}"


def _is_usual(found, effects, nominal) -> bool:
    """Whether a drive file may take the sizes of an effect."""
    return is_usual(found.parameters, effects[found.name].plausible, nominal)


def _periods(answer, nominal, effects) -> list[str]:
    """What to correct where a time is a whole number of control periods: a count is then wrong, not a time."""
    out, period = [], nominal.sample_time_s
    for effect in answer.effects:
        for p in effects[effect.name].parameters if effect.name in effects else ():
            e = effect.parameters.get(p.name)
            if e is None or not p.periods:
                continue
            n = round(e.value / period)
            if n and abs(e.value - n * period) <= max(k.WHOLE_SIGMAS * e.sigma, k.WHOLE_PERIOD * period):
                many = "one sample" if abs(n) == 1 else f"{abs(n)} samples"
                now = getattr(nominal.control, p.periods)
                out.append(f"{capital(p.negative if n < 0 else p.called)} {many}: "
                           f"[control] {p.periods} seems to be {now + n}, not {now}.")  # fmt: skip
    return out


def _record(answer, nominal) -> str:
    if not answer.next_recording:
        return ""
    points = "; ".join(point_text(r, nominal) for r in answer.next_recording)
    return f"Record further points, each until steady, and diagnose both recordings together: {points}."


def point_text(request, nominal) -> str:
    """'310 rad/s (740 rpm) with i_d = -2 A and i_q = 0 A' of a Request."""
    at = f"{request.omega_e:.4g} rad/s ({whole(request.omega_e * RPM / nominal.machine.pole_pairs)} rpm)"
    cold = f" at {request.temp_winding:.0f} degC" if request.temp_winding is not None else ""
    return f"{at}{cold} with i_d = {request.i_d:.3g} A and i_q = {request.i_q:.3g} A"


def whole(rpm: float) -> str:
    """A speed of at most four digits, without an exponent."""
    return f"{rpm:.0f}" if abs(rpm) >= 100.0 else f"{rpm:.3g}"


def _separated(answer, effects) -> str:
    torque = answer.evidence.torque
    how = [effects[n].experiment(torque) for group in answer.ambiguity for n in group if n in effects]
    return f"To separate them: {'; '.join(list(dict.fromkeys(how))[:2])}."


def _where(answer, nominal, effects) -> str:
    """Where to look for an unexplained residual: the physics that acts at the order of its largest part."""
    u = answer.unknown_term
    if u is not None and u.meaning:
        how = [e.separated_by for e in effects.values() if e.clause == u.meaning]
        return f"Check on the drive whether {u.meaning}.{f' Test: {how[0]}.' if how else ''}"
    if answer.best_fit is not None:
        names = [e.name for e in answer.best_fit.effects if e.name in effects]
        how = list(dict.fromkeys(f"{effects[n].title}: {effects[n].experiment(answer.evidence.torque)}" for n in names))
        return f"Check first what fits best. {'; '.join(capital(text) for text in how[:MOST_CHECKED])}."
    if not answer.remainder:
        return "Record more speeds and currents of both signs, so that the misfit can be located."
    r = max(answer.remainder, key=lambda part: part.share)
    signal = SIGNALS.get(r.signal, r.signal)
    if not r.order:
        dependence = _dependence(u) or f"changes the mean {signal} with {_varies(answer)}"
        return f"Look for something that {dependence}: no known effect has this dependence."
    pairs = nominal.machine.pole_pairs
    known = [e.title for e in effects.values() if shows(e, r.order, pairs)][:MOST_TITLES]
    turns = r.order * pairs
    place = f"at order {r.order:.4g} of the {signal}, {turns:.4g} per mechanical turn"
    if known:
        return f"Look {place}: {joined(known)} act at this order, but depend differently on speed and current."
    return (
        f"Look {place}: no known effect acts at this order. "
        "Compare it with the numbers of slots, poles, bearing elements and gear teeth."
    )


def shows(effect, order, pole_pairs) -> bool:
    """Whether an effect appears at an electrical order, by its declaration."""
    orders = [*effect.shows_at.electrical, *(n / pole_pairs for n in effect.shows_at.per_turn)]
    return any(abs(abs(order) - h) <= NEAR * h for h in orders if h)


def _dependence(u) -> str:
    """How the best single term changes the mean voltage: of 'u_d = c * omega i_q' with the speed times i_q."""
    part, _, factor = u.formula.partition(" = c * ") if u is not None else ("", "", "")
    if part not in ("u_d", "u_q"):  # an order, or a formula that is no term of the dictionary
        return ""
    if factor == "1":
        return f"adds a constant to the mean {SIGNALS[part]}"
    found = re.findall(r"(abs\()?\b(omega|i_d|i_q|i|u_dc|t)\b\)?(\^2)?", factor)
    texts = [f"{'the magnitude of ' * bool(a)}{'the square of ' * bool(s)}{VARIABLES[name]}" for a, name, s in found]
    return f"changes the mean {SIGNALS[part]} with {' times '.join(texts)}" if texts else ""


def _varies(answer) -> str:
    """The variable that bounds the region with the largest misfit."""
    regions = answer.location.regions
    return VARIABLES.get(regions[0].variable, "the operating point") if regions else "the operating point"


def covered(answer, nominal) -> str:
    """'-800 to 1200 rpm, i_d of -2 to 0 A and i_q of -5 to 5 A' of the steady blocks."""
    arrays, spans = answer.evidence.arrays, []
    shaft = RPM / nominal.machine.pole_pairs
    for name, factor, unit in (("omega_e", shaft, "rpm"), ("i_d", 1.0, "A"), ("i_q", 1.0, "A")):
        values = np.asarray(arrays.get(name, ()), float) * factor
        if values.size:
            ends = float(values.min()), float(values.max())
            places = 0 if unit == "rpm" else decimals(max(*np.abs(ends), 1e-9), 2)
            low, high = (f"{float(fixed(x, places)):g}" for x in ends)
            span = f"{low} to {high} {unit}" if low != high else f"{low} {unit}"
            spans.append(span if unit == "rpm" else f"{name} of {span}")
    return joined(spans) if spans else "the recorded operating points"
