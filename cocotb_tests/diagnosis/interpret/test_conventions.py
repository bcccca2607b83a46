# SPDX-License-Identifier: BSD-3-Clause
"""Mistaken conventions are told in plain words or said to be indistinguishable, never answered by a wrong cause."""

from __future__ import annotations

import dataclasses

import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import POINT, recorded
from cocotb_tests.support.recordings.with_mistake import MISTAKES, PHASES, ROOT2, Mistake, scaled, table_of, written
from cocotb_tests.support.slow import halved
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.conventions.table import readings_for
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.improve.improve import write_improved
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.session import run, work

GIVEN_BACK = (  # whose improved drive file is tried as well
    "currents in rms", "dq voltages line to line", "angle of the q axis", "bus at half", "R, L and psi line to line",
    "L in mH", "half the pole pairs, angle of the shaft", "sample time half", "R and L line to line, currents in rms",
)  # fmt: skip
OF_DATA_SHEETS = ("psi_line_rms_of_shaft", "psi_line_rms_krpm", "psi_torque_rms")
# Every mistake that a table can show: of dq values, of the speed, of the drive file without its times.
IN_TABLES = [
    name for name, m in MISTAKES.items()
    if m.dq or (m.file and not m.log and m.found not in ("sample_time_s", *OF_DATA_SHEETS))
] + ["speed of the shaft", "speed in rpm"]  # fmt: skip


def told(answer) -> set[str]:
    """Codes of everything that was said about conventions, rivals included."""
    return {code for c in answer.conventions for code in (c.code, *c.rivals)}


def test_there_are_enough_mistakes():
    assert len(MISTAKES) >= 25


@pytest.mark.parametrize("name", halved(MISTAKES, every=34))
def test_a_mistake_is_told_and_nothing_else(name, tmp_path):
    mistake = MISTAKES[name]
    recording, drive = written(mistake, tmp_path)
    worked = work(recording, drive)
    answer = worked.answer()
    assert not answer.effects and not answer.ambiguity, answer.sentence
    codes = {r.code for r in readings_for(load_nominal(tmp_path / "drive.toml"))} | {"pole_pairs", "sample_time_s"}
    if set(mistake.found.split()) <= codes:
        assert answer.verdict == "explained" and set(mistake.found.split()) <= told(answer), answer.sentence
        assert len(answer.conventions) == len(mistake.found.split())
        assert answer.fit.holdout_after <= 2.0 * answer.fit.noise_floor
    else:  # corrected by a check
        assert answer.verdict == "no_mismatch" and not answer.conventions
        assert any(mistake.found in problem.message for problem in answer.problems), answer.problems
        assert mistake.found in answer.details
    if name in GIVEN_BACK:  # the improved drive file reads the recording rightly
        assert answer.conventions and "drive_improved.toml" in answer.advice
        nominal, path = load_nominal(drive), tmp_path / "drive_improved.toml"
        recorded_there = load_recording(recording, nominal)
        again = diagnose(
            recording, write_improved(nominal, answer.effects, path, worked.decision.readings, recorded_there)
        )
        assert again.verdict == "no_mismatch" and not again.conventions, again.sentence


@pytest.mark.slow
def test_the_improved_drive_holds_the_unit_that_the_numbers_gave_away(tmp_path):
    """Currents in mA are converted by a check, but not if [columns] has a factor: it has to be the whole one."""
    recording, drive = written(Mistake("currents_rms", scaled(PHASES, 1e3 / ROOT2)), tmp_path)
    assert "currents_rms" in told(run(recording, drive, tmp_path / "out"))
    columns = load_nominal(tmp_path / "out" / "drive_improved.toml").columns
    factors = {name: entry["factor"] for name, entry in columns.items()}
    assert factors == pytest.approx(dict.fromkeys(PHASES, 1e-3 * ROOT2))
    again = diagnose(recording, tmp_path / "out" / "drive_improved.toml")
    assert again.verdict == "no_mismatch" and not again.problems


@pytest.mark.parametrize(
    "name", halved(["currents in rms", "R and L line to line", "bus at half", "angle 90 degrees behind"], every=4)
)
@pytest.mark.slow
def test_an_effect_behind_a_mistake_is_named_with_its_size(name, tmp_path):
    """The magnets are 5 % weaker; under the right reading that is found too."""
    deviations = {"machine": (("magnet_flux_wb", 0.15675),)}
    answer = diagnose(*written(MISTAKES[name], tmp_path, deviations))
    assert set(MISTAKES[name].found.split()) <= told(answer), answer.sentence
    assert [e.name for e in answer.effects] == ["magnet_flux"], answer.sentence
    found = answer.effects[0].parameters["magnet_flux_wb"]
    assert found.value == pytest.approx(0.15675, rel=0.005)


@pytest.mark.parametrize("name", halved(IN_TABLES, every=16))
def test_a_mistake_is_told_from_operating_points(name, tmp_path):
    mistake = dataclasses.replace(MISTAKES[name], dq=True)
    recording, drive = written(mistake, tmp_path)
    answer = diagnose(table_of(recording, tmp_path / "points.csv"), drive)
    assert not answer.effects and not answer.ambiguity, answer.sentence
    if mistake.found in {r.code for r in readings_for(load_nominal(drive))}:
        assert answer.verdict == "explained" and mistake.found in told(answer), answer.sentence
        assert len(answer.conventions) == 1
    else:  # corrected by a check
        assert answer.verdict == "no_mismatch" and not answer.conventions, answer.sentence
        assert any(mistake.found in problem.message for problem in answer.problems), answer.problems


@pytest.mark.parametrize("gain", halved([0.68, 0.74, 0.9], every=3))
def test_a_gain_error_near_a_convention_is_a_gain_error(gain, tmp_path):
    answer = diagnose(*written(Mistake("", scaled(("i_a", "i_b", "i_c"), gain)), tmp_path))
    assert not answer.conventions, answer.sentence
    assert "current_scale" in {e.name for e in answer.effects} | {n for g in answer.ambiguity for n in g}


def test_one_operating_point_tells_no_convention():
    """A machine that is 40 % off is no line-to-line value: one point cannot know."""
    answer = diagnose(recorded(POINT, machine={"resistance_ohm": 0.75, "magnet_flux_wb": 0.15}), load_nominal(PAPER))
    assert not answer.conventions


def test_a_healthy_recording_has_no_convention():
    answer = diagnose(recorded(), load_nominal(PAPER))
    assert answer.verdict == "no_mismatch" and not answer.conventions


@pytest.mark.parametrize("name", [n for n, m in MISTAKES.items() if m.found in OF_DATA_SHEETS])
def test_a_constant_of_a_data_sheet_is_told(name, tmp_path):
    recording, drive = written(dataclasses.replace(MISTAKES[name], dq=True), tmp_path)
    answer = diagnose(table_of(recording, tmp_path / "points.csv"), drive)
    assert [c.code for c in answer.conventions] == [MISTAKES[name].found] and not answer.effects, answer.sentence
