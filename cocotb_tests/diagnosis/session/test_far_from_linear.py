# SPDX-License-Identifier: BSD-3-Clause
"""Errors of measurement so large that no line reaches them: scales of 0.3 to 3, angles over the whole turn."""

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_core import MACHINE
from cocotb_tests.support.recordings.with_mistake import PHASES, Mistake, scaled, table_of, turned, written
from cocotb_tests.support.slow import slowly
from fluxproof.diagnosis.session import diagnose, work


def answer_to(mistake, tmp_path):
    return diagnose(*written(mistake, tmp_path))


@pytest.mark.parametrize("degrees", [slowly(100), slowly(48), slowly(-75), slowly(-150), slowly(165)])
def test_an_angle_off_by_any_part_of_a_turn_is_found(degrees, tmp_path):
    answer = answer_to(Mistake("", turned(np.radians(degrees))), tmp_path)
    assert [e.name for e in answer.effects] == ["encoder_offset"]
    assert answer.verdict == "explained" or degrees in (-75, -150)
    # A resistance that is 1.6 % larger, less than what is of interest, may be seen beside it as one or as its drift.
    assert {n for group in answer.ambiguity for n in group} <= {"resistance", "resistance_temperature"}
    offset = answer.effects[0].parameters["offset_rad"]
    assert abs(np.degrees(offset.value) - degrees) < 1.0 and offset.sigma < 0.02


@pytest.mark.parametrize("factor", [slowly(0.3), slowly(1.6)])  # 1.6: line-to-line values, and a scale beside them
def test_a_scale_of_the_currents_may_be_one_of_the_constants(factor, tmp_path):
    """R, L_d and L_q, each by the same factor, leave the same voltages: only another instrument decides."""
    answer = answer_to(Mistake("", scaled(PHASES, factor)), tmp_path)
    assert answer.verdict == "ambiguous" and not answer.conventions and not answer.effects, answer.sentence
    (group,) = answer.ambiguity  # with a resistance beside a scale, as a drive file may be off by a third there
    assert {"current_scale", "machine_scale"} <= set(group) <= {"current_scale", "machine_scale", "resistance"}


@pytest.mark.slow
def test_a_scale_of_the_currents_by_three(tmp_path):
    """An iron loss may join the ambiguity: why is open."""
    answer = answer_to(Mistake("", scaled(PHASES, 3.0)), tmp_path)
    assert answer.verdict == "ambiguous" and not answer.conventions and not answer.effects, answer.sentence
    (group,) = answer.ambiguity
    assert {"current_scale", "machine_scale"} <= set(group) <= {"current_scale", "machine_scale", "iron_loss"}


@pytest.mark.parametrize("factor", [slowly(1.7), slowly(0.4), slowly(3.0)])
def test_a_gain_of_the_bus_is_one_cause_at_any_size(factor, tmp_path):
    """Not two readings, nor a reading and a gain beside it."""
    answer = answer_to(Mistake("", scaled(("u_dc",), factor)), tmp_path)
    assert answer.verdict == "explained" and not answer.conventions, answer.sentence
    assert [e.name for e in answer.effects] == ["udc_gain"]
    found = answer.effects[0].parameters["udc_gain"]
    assert abs(found.value - (factor - 1.0)) < 0.01 * factor + 2.0 * found.sigma


@pytest.mark.parametrize(("degrees", "factor"), [slowly(-8, 1.3), slowly(5, 0.85), slowly(3, 0.85)])
def test_an_inductance_beside_an_angle_that_is_off(degrees, factor, tmp_path):
    """On data whose angle a soft shaft corrected too, the inductance looked worse than a cross-saturation."""
    deviations = {"machine": (("inductance_q_h", factor * MACHINE.inductance_q_h),)}
    answer = diagnose(*written(Mistake("", turned(np.radians(degrees))), tmp_path, deviations))
    assert answer.verdict == "explained"
    assert sorted(e.name for e in answer.effects) == ["encoder_offset", "inductance_q"], answer.sentence
    found = {k: e.value for effect in answer.effects for k, e in effect.parameters.items()}
    assert found["inductance_q_h"] == pytest.approx(factor * MACHINE.inductance_q_h, rel=0.01)
    assert abs(np.degrees(found["offset_rad"]) - degrees) < 0.1


@pytest.mark.parametrize(
    ("columns", "table"),
    [
        (("u_dc",), False),
        slowly(PHASES, False),
        slowly(("u_d_ref", "u_q_ref", "u_dc"), True),
        slowly(("i_d", "i_q"), True),
    ],
)
def test_a_gain_beside_a_wrong_flux_is_not_told_from_another_gain(columns, table, tmp_path):
    """A gain of the bus or a scale of the currents, each with another magnet flux, leave the same.

    The one that scales the remainder down was named before.
    """
    deviations = {"machine": (("magnet_flux_wb", 0.92 * MACHINE.magnet_flux_wb),)}
    recording, drive = written(Mistake("", scaled(columns, 1.03), dq=table), tmp_path, deviations)
    worked = work(table_of(recording, tmp_path / "points.csv") if table else recording, drive)
    answer = worked.answer()
    assert answer.verdict == "ambiguous", answer.sentence
    assert {"current_scale", "udc_gain"} <= {name for group in answer.ambiguity for name in group}
    fits = {fit.names: fit.value for _, fit in worked.decision.posterior.weights()}
    pairs = [fits[tuple(sorted(pair))] for pair in (("current_scale", "magnet_flux"), ("magnet_flux", "udc_gain"))]
    assert abs(pairs[0] - pairs[1]) < 2.0


def shifted(rows):
    """Duties ``rows`` rows later than the drive file says; the first and the last rows are not steady."""
    return lambda c: {**c, **{f"d_{x}": np.roll(c[f"d_{x}"], rows) for x in "abc"}}


@pytest.mark.parametrize("rows", [2, slowly(1), slowly(-2)])
def test_a_delay_of_more_than_a_period_has_its_size(rows, tmp_path):
    answer = answer_to(Mistake("", shifted(rows)), tmp_path)
    assert answer.verdict == "explained" and [e.name for e in answer.effects] == ["delay"], answer.sentence
    assert answer.effects[0].parameters["delay_s"].value == pytest.approx(-rows * 1e-4, abs=1e-6)


def test_no_parameter_of_a_machine_is_negative(tmp_path):
    """With the d axis mirrored, a resistance of -1.6 ohm fits best."""
    answer = answer_to(Mistake("", scaled(("i_d", "u_d_ref"), -1.0), dq=True), tmp_path)
    values = [p.value for e in answer.effects for n, p in e.parameters.items() if n.endswith(("_ohm", "_h", "_wb"))]
    assert all(v > 0.0 for v in values)
