# SPDX-License-Identifier: BSD-3-Clause
"""Headline, details, advice and doubts: no raw keys, engineering units, and something to do under every verdict."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.diagnoses.samples import evidence, made_up
from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_equations import made, nominal_of, write
from fluxproof.diagnosis import physics
from fluxproof.diagnosis.build import build, worded
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.command import effect_table
from fluxproof.diagnosis.decide.decision import Decision
from fluxproof.diagnosis.decide.likeliest import AGAINST
from fluxproof.diagnosis.effects import Parameter
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import Problem
from fluxproof.diagnosis.ground.result import (
    VERDICTS,
    BestFit,
    Estimate,
    Fit,
    Location,
    NamedEffect,
    Region,
    Remainder,
    Request,
    UnknownTerm,
)
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.physics import known_effects
from fluxproof.diagnosis.words.advice import advice, point_text
from fluxproof.diagnosis.words.best_fit import minor_notes
from fluxproof.diagnosis.words.details import details
from fluxproof.diagnosis.words.doubts import IMPLAUSIBLE, doubts
from fluxproof.diagnosis.words.headline import MOST_LETTERS, headline

NOMINAL, KNOWN = load_nominal(PAPER), known_effects()
KEYS = {p.name for e in KNOWN.values() for p in e.parameters if "_" in p.name}
LATE = UnknownTerm("u_dq", "tau", 2.7e-5, 3e-7, "s", 0.9, "the measured currents were late")
SIZES = {"ohm": 0.35, "H": 3e-3, "Wb": 0.16, "s": 2.7e-5, "V": 5.087, "1": 0.02, "1/K": 0.0039, "rad": 0.03}


def named(name):
    """A NamedEffect with a usual value for each declared parameter."""
    values = {p.name: SIZES.get(p.unit, 0.5) for p in CATALOGUE[name].parameters}
    units = {p.name: p.unit for p in CATALOGUE[name].parameters}
    return NamedEffect(name, 0.99, {k: Estimate(v, 0.02 * v, units[k]) for k, v in values.items()}, 0.9, {})


def samples():
    """Answers of every verdict with one effect, with two, and with all of the catalogue."""
    answers = made_up()
    rest = [Remainder("u_dq", 6.0, 1.234, "V", 0.2), Remainder("torque", 0.0, 0.2, "Nm", 0.1)]
    for verdict, names in itertools.product(("explained", "partly_explained", "ambiguous"), (1, 2, len(CATALOGUE))):
        chosen = list(CATALOGUE)[:names]
        for first in CATALOGUE if names == 1 else [None]:
            effects = [named(n) for n in ([first] if first else chosen)]
            groups = [sorted(CATALOGUE)[: names + 1]] if verdict != "explained" else []
            yield replace(answers[verdict], effects=effects, ambiguity=groups, remainder=rest, explained_share=0.8)
    for term in (None, LATE):
        yield replace(answers["unexplained"], unknown_term=term, remainder=rest)
        yield replace(answers["partly_explained"], unknown_term=term, remainder=rest)
    yield answers["no_mismatch"]


@pytest.mark.parametrize("answer", list(samples()), ids=lambda a: f"{a.verdict}-{len(a.effects)}")
def test_headline_is_short_and_has_no_raw_keys(answer):
    text = headline(answer, KNOWN)
    assert 20 < len(text) <= MOST_LETTERS and text.endswith(".") and text.isascii(), text
    words = set(re.findall(r"\w+", text + details(answer, text, KNOWN)))
    assert not words & KEYS and "u_dq" not in words and not re.search(r"\de[-+]\d", text), text


def test_a_misfit_above_the_floor_is_not_told_to_be_at_it():
    agree = made_up()["no_mismatch"]
    for floor, says in ((0.6, "1 V is at the noise floor"), (0.2, "1 V is within the usual error")):
        assert says in headline(replace(agree, fit=Fit(train_before=1.0, noise_floor=floor)), KNOWN)


def drawn_fits():
    """Unexplained answers with best fits of one to five effects of the catalogue, drawn, each with a reason."""
    rng = np.random.default_rng(48)
    for reason in [*AGAINST, "it leaves 80 % of the misfit", "other sets of effects fit as well"]:
        for count in (1, 1, 2, 3, 5):
            effects = tuple(named(str(n)) for n in rng.choice(list(CATALOGUE), count, replace=False))
            found = BestFit(effects, float(10 ** rng.uniform(-4.0, 0.0)), 0.1, reason)
            yield replace(made_up()["unexplained"], unknown_term=None, best_fit=found)


@pytest.mark.parametrize("answer", list(drawn_fits()), ids=lambda a: "-".join(e.name for e in a.best_fit.effects))
def test_no_effect_is_called_known_beside_one_that_fits_best(answer):
    """A magnet flux that had been found and rejected was told as: no known effect has this dependence."""
    text, best = headline(answer, KNOWN), answer.best_fit
    assert KNOWN[best.effects[0].name].title in text.lower() or KNOWN[best.effects[0].name].title in text
    assert best.against in text and "probability" in text and len(text) <= MOST_LETTERS
    told = advice(answer, NOMINAL, KNOWN)
    assert KNOWN[best.effects[0].name].separated_by in told
    assert not any("no known effect" in x or "no effect of the catalogue" in x for x in (text, told))
    assert "The best fit leaves 0.1 V there." in details(replace(answer, fit=Fit(holdout_before=1.0)), text, KNOWN)


def test_what_is_too_small_to_act_on_is_a_note():
    gains = replace(
        made_up()["no_mismatch"], minor=(named("current_gain"),), fit=Fit(train_before=1.0, noise_floor=0.2)
    )
    assert "too small to act on" in headline(gains, KNOWN)
    (note,) = minor_notes(gains.minor, KNOWN)
    assert "nequal gains" in note and note.endswith("too small to act on.")


@pytest.mark.parametrize("name", sorted(CATALOGUE))
def test_a_file_that_changes_nothing_is_not_recommended(name):
    """What no drive can have is not written, and what is not written is not recommended."""
    usual = replace(made_up()["explained"], effects=(replace(named(name), plant={"machine.x": 1.0}),))
    assert "drive_improved.toml" not in advice(usual, NOMINAL, KNOWN, improved=False)
    assert advice(usual, NOMINAL, KNOWN, improved=False, worse=True).startswith("Do not take these values")
    absurd = {p.name: Estimate(1e9, 1.0, p.unit) for p in CATALOGUE[name].parameters}
    if CATALOGUE[name].plausible:
        found = (replace(named(name), parameters=absurd, plant={"machine.x": 1.0}),)
        assert "drive_improved.toml" not in advice(replace(usual, effects=found), NOMINAL, KNOWN)


def test_much_that_is_left_beside_an_explanation_is_told():
    explained = made_up()["explained"]
    for left, told in ((0.2, False), (0.5, True)):
        fit = Fit(holdout_before=9.0, holdout_after=left, noise_floor=0.1)
        assert ("5 times the noise floor" in details(replace(explained, fit=fit), "", KNOWN)) == told


def test_a_headline_says_what_and_how_large():
    dead = NamedEffect("dead_time", 0.99, {"v_dead_v": Estimate(5.0873, 0.23, "V")}, 0.9)
    one = replace(made_up()["explained"], effects=[dead])
    assert headline(one, KNOWN) == "Dead time of the inverter: dead-time voltage 5.1 +- 0.2 V."
    late = headline(replace(made_up()["unexplained"], unknown_term=LATE), KNOWN)
    assert "as if the measured currents were late (27.0 +- 0.3 us)" in late
    rest = [Remainder("u_dq", 6.0, 1.234, "V", 0.2)]
    part = headline(replace(made_up()["partly_explained"], effects=[dead], remainder=rest, unknown_term=None), KNOWN)
    assert "mostly at order 6 of the voltage (1.2 V)" in part and "(dead-time voltage 5.1 +- 0.2 V) explains" in part


@pytest.mark.parametrize(
    "name, key, periods, says, then",
    [
        ("delay", "delay_s", -1.0, "voltage recorded late by 0.1000 +-", "Voltage recorded late by one sample: [con"),
        ("delay", "delay_s", 0.27, "voltage later by 27.00 +-", None),
        ("delay", "angle_late_s", 0.27, "angle late by 27.00 +-", None),
        ("sampling_skew", "skew_s", -0.042, "angle early by 4.20 +-", None),
    ],
)
def test_a_time_is_early_or_late_and_has_no_sign(name, key, periods, says, then):
    time = Estimate(periods * NOMINAL.sample_time_s, 3e-7 if periods == -1.0 else 8e-8, "s")
    answer = replace(made_up()["explained"], effects=[NamedEffect(name, 0.99, {key: time}, 0.9, {"timing.x": 1.0})])
    assert says in headline(answer, KNOWN) and "-0" not in headline(answer, KNOWN).replace("+-", "")
    told = advice(answer, NOMINAL, KNOWN)
    assert then in told if then else "sample:" not in told, told


@pytest.mark.parametrize(
    "names, explains, text",
    [
        (["cogging"], 0.0, "in the torque"),
        (["inductance_d", "saturation"], 0.003, "shared (see total)"),
        (["sampling_skew", "magnet_flux"], (0.002, 0.999), "< 1 %"),
        (["resistance"], 0.0, "–"),
        (["resistance"], 0.5, "50 %"),
    ],
)
def test_a_share_that_is_not_counted_is_not_told_as_none(names, explains, text):
    shares = explains if isinstance(explains, tuple) else (explains,) * len(names)
    effects = [replace(named(n), explains=share) for n, share in zip(names, shares, strict=True)]
    table = effect_table(effects)
    assert table[1].endswith(text) and not any(line.endswith(" 0 %") for line in table), table


def test_a_share_is_of_the_alternatives_too():
    """Of a dead time and one of two other effects: the dead time alone explains less."""
    dead = NamedEffect("dead_time", 0.99, {"v_dead_v": Estimate(5.0873, 0.23, "V")}, 0.2)
    rest = (Remainder("u_dq", 6.0, 1.234, "V", 0.2),)
    both = replace(
        made_up()["partly_explained"],
        effects=(dead,),
        ambiguity=(("current_lag", "delay"),),
        remainder=rest,
        unknown_term=None,
    )
    text = headline(both, KNOWN)
    assert ", with one of currents delayed by a filter and 1 other effect, explain " in text, text
    alone = headline(replace(both, effects=[]), KNOWN)
    assert alone.startswith("One of currents delayed by a filter and delay of voltage or angle explains "), alone


def test_what_is_certain_is_told_from_what_takes_its_place():
    """Of a saturating machine eleven effects were not separable, two of which were in every probable set."""
    found = {"saturation": 0.99, "cross_saturation": 0.98, "udc_gain": 0.6, "resistance": 0.4}
    alternatives = tuple(replace(named(n), confidence=p) for n, p in found.items())
    answer = replace(made_up()["ambiguous"], effects=(), ambiguity=(tuple(found),), alternatives=alternatives)
    text = headline(answer, KNOWN)
    assert text.startswith("This recording cannot separate gain error of the bus voltage sensor"), text
    assert text.endswith(", on which the size of saturation of an axis by its own current and 1 more depends."), text
    twins = replace(answer, ambiguity=(("saturation", "udc_gain"),))
    assert "on which" not in headline(twins, KNOWN)


def test_an_effect_outside_the_catalogue_is_called_by_its_meaning():
    assert Parameter("x_a", "A", "its amplitude").called == "its amplitude"
    answer = replace(
        made_up()["explained"], effects=[NamedEffect("odd_one", 0.99, {"x_a": Estimate(1, 0.1, "A")}, 0.9)]
    )
    assert headline(answer, KNOWN) == "Odd one: x a 1.00 +- 0.10 A."


def test_every_parameter_has_a_title():
    assert all(p.title for e in KNOWN.values() if e.named for p in e.parameters)


def test_details_do_not_repeat_the_headline():
    dead = NamedEffect("dead_time", 0.99, {"v_dead_v": Estimate(5.0873, 0.23, "V")}, 0.9)
    answer = worded(replace(made_up()["explained"], sentence="", effects=(dead,)), NOMINAL)
    assert "dead-time voltage" in answer.sentence and "dead-time voltage" not in answer.details
    short = worded(replace(answer, sentence="Dead time."), NOMINAL)
    assert "dead-time voltage" in short.details


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_has_advice(verdict):
    answer = worded(made_up()[verdict], NOMINAL)
    assert 20 < len(answer.advice) < 500 and answer.advice.endswith("."), answer.advice
    said = {
        "explained": "drive_improved.toml",
        "ambiguous": "314 rad/s (750 rpm) with i_d = -2 A",
        "partly_explained": "at order 2 of the voltage",
        "no_mismatch": "-716 to 1432 rpm",
    }
    assert said.get(verdict, "") in answer.advice, answer.advice


def test_advice_names_what_shows_at_an_order():
    def at(order):
        rest = [Remainder("u_dq", order, 1.0, "V", 0.5)]
        return advice(replace(made_up()["unexplained"], remainder=rest, unknown_term=None), NOMINAL, KNOWN)

    assert CATALOGUE["emf_harmonics"].title in at(6.0) and CATALOGUE["dead_time"].title in at(6.0)
    assert CATALOGUE["encoder_eccentricity"].title in at(1.0 / NOMINAL.machine.pole_pairs)
    assert "no known effect acts at this order" in at(5.0)


@pytest.mark.parametrize(
    "formula, says",
    [
        ("u_d = c * omega", "changes the mean d-axis voltage with the speed:"),
        ("u_d = c * omega^2", "with the square of the speed:"),
        ("u_q = c * omega i_q^2", "changes the mean q-axis voltage with the speed times the square of i_q:"),
        ("u_q = c * abs(i)", "with the magnitude of the current:"),
        ("u_q = c * 1", "adds a constant to the mean q-axis voltage:"),
        ("torque = c * sin(6 theta_m + phi)", "changes the mean voltage with time:"),
    ],
)
def test_advice_uses_the_variable_of_the_unknown_term(formula, says):
    answer = replace(
        made_up()["unexplained"],
        remainder=(Remainder("u_dq", 0.0, 1.0, "V", 0.5),),
        unknown_term=UnknownTerm("u_d", formula, 1e-4, 1e-6, "V", 0.5),
        location=Location(regions=(Region("t", 0.0, 1.0, "s", 2.0, 1.0),)),
    )
    assert says in advice(answer, NOMINAL, KNOWN)


def test_no_mismatch_says_what_was_covered():
    answer = replace(made_up()["no_mismatch"], evidence=evidence(0.0, after=False))
    assert "i_q of -5 to 5 A" in advice(answer, NOMINAL, KNOWN)
    assert "and for friction and cogging torque (no torque was compared), the drive" in advice(answer, NOMINAL, KNOWN)
    compared = replace(answer, evidence=replace(answer.evidence, torque=True))
    assert "friction" not in advice(compared, NOMINAL, KNOWN)


@pytest.mark.parametrize(
    "code, says, how",
    [
        ("swapped_phases", "phase currents b and c are swapped", "exchange the names of the columns"),
        ("sign", "i_b has the opposite sign", "factor = -1"),
    ],
)
def test_what_was_corrected_is_told_and_to_be_changed(code, says, how):
    found = Problem(code, f"{says}: misfit 39% of the voltage as recorded, 2% with it", "i_b", action="corrected")
    answer = replace(made_up()["no_mismatch"], problems=[found])
    assert headline(answer, KNOWN).startswith(f"Simulation and recording agree once corrected: {says}. The misfit")
    told = advice(answer, NOMINAL, KNOWN)
    assert how in told and "[columns]" in told and "No other change needed" in told, told
    beside = advice(replace(made_up()["unexplained"], problems=[found]), NOMINAL, KNOWN)
    assert f" In addition, {says}: correct this in [columns]" in beside and how in beside, beside


def test_the_headline_knows_what_the_checks_found(tmp_path, monkeypatch):
    table, nominal = made(), nominal_of(tmp_path)
    table["i_b"], table["i_c"] = table["i_c"], table["i_b"]
    recording = load_recording(write(tmp_path / "r.parquet", table), nominal)
    monkeypatch.setattr(physics, "_decision", lambda *_: Decision("no_mismatch"))
    answer = build(physics.explain([recording], nominal), nominal)
    assert "once corrected: phase currents b and c are swapped" in answer.sentence


@pytest.mark.parametrize(
    "name, key, value, doubtful",
    [
        ("resistance_temperature", "resistance_temp_coeff_per_k", 0.0039, False),
        ("resistance_temperature", "resistance_temp_coeff_per_k", 0.0078, True),
        ("resistance", "resistance_ohm", 1.3 * NOMINAL.machine.resistance_ohm, False),
        ("resistance", "resistance_ohm", 2.8 * NOMINAL.machine.resistance_ohm, False),
        ("resistance", "resistance_ohm", 4.0 * NOMINAL.machine.resistance_ohm, True),
        ("magnet_temperature", "magnet_flux_drift_wb", 0.01, True),
    ],
)
def test_implausible_parameters_are_noted(name, key, value, doubtful):
    unit = next(p.unit for p in CATALOGUE[name].parameters if p.name == key)
    effect = NamedEffect(name, 0.99, {key: Estimate(value, 0.01 * abs(value), unit)}, 0.9)
    notes = doubts(replace(made_up()["explained"], effects=[effect]), NOMINAL, KNOWN)
    assert len(notes) == doubtful and all(IMPLAUSIBLE in n and CATALOGUE[name].otherwise in n for n in notes), notes


def test_plausible_limits_are_of_declared_parameters():
    for effect in KNOWN.values():
        assert set(effect.plausible) <= {p.name for p in effect.parameters}
        assert bool(effect.plausible) == bool(effect.otherwise)
        assert all(low < high for low, high, *_ in effect.plausible.values())


def test_a_point_is_given_in_rpm_too():
    asked = Request(220.0, -1.1, 0.65, [], "", None, 20.0)
    assert point_text(asked, NOMINAL) == "220 rad/s (525 rpm) at 20 degC with i_d = -1.1 A and i_q = 0.65 A"
