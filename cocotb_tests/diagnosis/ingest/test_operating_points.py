# SPDX-License-Identifier: BSD-3-Clause
"""Which recordings are operating points, and constants in the place of columns."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.diagnoses.answers import answer_of, found, held, said, without
from cocotb_tests.support.drives import L_D, L_Q, PSI, R
from cocotb_tests.support.recordings.bench_logs import Truth, table, with_torque
from cocotb_tests.support.recordings.from_equations import DRIVE, codes, nominal_of, write
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording

WEAK = Truth(psi=0.95 * PSI)


def test_many_rows_without_time_are_a_table_only_if_they_jump(tmp_path):
    nominal = nominal_of(tmp_path)
    assert load_recording(write(tmp_path / "r.csv", table(repeats=20)), nominal).points
    smooth = {"i_d": np.zeros(2000), "i_q": 3.0 * np.sin(np.arange(2000) / 300), "omega_e": np.full(2000, 300.0)}
    smooth |= {"u_d_ref": -300 * L_Q * smooth["i_q"], "u_q_ref": 300 * PSI + R * smooth["i_q"]}
    assert not load_recording(write(tmp_path / "s.csv", smooth), nominal).points


def test_messages_of_different_age_are_no_operating_points(tmp_path):
    columns = held({k: np.repeat(v, 4) for k, v in table().items()}, 1.0)
    assert load_recording(write(tmp_path / "r.csv", columns), nominal_of(tmp_path)).points  # all at the same time
    columns["u_q_ref"] = np.roll(columns["u_q_ref"], 2)
    assert not load_recording(write(tmp_path / "s.csv", columns), nominal_of(tmp_path)).points


def test_constants_replace_columns(tmp_path):
    points = [(250.0, 0.0, q) for q in np.linspace(-5.0, 5.0, 13)]
    columns = without(table(Truth(r=1.9), points=points), "omega_e", "i_d")
    rpm = 250.0 * 60 / (2 * np.pi) / 4
    answer = answer_of(tmp_path, columns, f"[constants]\nomega_e = {{value = {rpm}, unit = 'rpm'}}\ni_d = 0\n")
    assert found(answer) == {"resistance_ohm": pytest.approx(1.9, abs=0.03)}
    assert said(answer, "omega_e = 250 by [constants]")
    # A column of the file is preferred.
    whole = answer_of(tmp_path, table(WEAK), "[constants]\nomega_e = 1\n")
    assert said(whole, "[constants] omega_e is not used") and [e.name for e in whole.effects] == ["magnet_flux"]


WRONG = {
    "omega_m = 3": ("omega_m", "not a canonical name", "'omega_e'"),
    "t = 3": ("not a canonical name that can be constant",),
    'i_d = "0"': ("i_d", "must be a finite number"),
    "i_d = nan": ("must be a finite number",),
    "i_d = true": ("must be a finite number",),
    'omega_e = {value = 3, unit = "knots"}': ("unit 'knots' is unknown for omega_e", "rpm"),
    "omega_e = {rpm = 3}": ("must be a number or a table",),
}


@pytest.mark.parametrize("line", WRONG)
def test_wrong_constants_name_the_entry(tmp_path, line):
    with pytest.raises(RecordingError) as error:
        answer_of(tmp_path, table(), f"[constants]\n{line}\n")
    message = str(error.value)
    assert "drive.toml: [constants]" in message and "\n" not in message
    for word in WRONG[line]:
        assert word in message


def test_the_missing_column_and_what_would_do_are_named(tmp_path):
    with pytest.raises(RecordingError, match=r"missing i_d; .*\[columns\] of drive.toml, or .*\[constants\]"):
        answer_of(tmp_path, without(table(), "i_d"))


AREA = [(w, d, q) for w in (250.0, 500.0, -300.0) for d in (-4.0, -2.0, 0.0) for q in (-5.0, -3.0, -1.5, 0.0, 2.0, 4.0)]


def test_codes_of_a_table_are_clean(tmp_path):
    assert codes(load_recording(write(tmp_path / "r.csv", table()), nominal_of(tmp_path))) == []


LARGER = Truth(r=1.3 * R, l_d=1.3 * L_D, l_q=1.3 * L_Q)
ALIKE = {"current_scale", "machine_scale"}


@pytest.mark.parametrize("truth, scale", [(LARGER, 1.0), (Truth(), 1 / 1.3)])
def test_a_torque_tells_a_gain_of_the_currents_from_constants_off_by_one_factor(tmp_path, truth, scale):
    both = with_torque(table(truth), truth, scale=scale)
    alone = answer_of(tmp_path, {name: x for name, x in both.items() if name != "torque"})
    assert alone.verdict == "ambiguous" and set(alone.ambiguity[0]) == ALIKE
    answer = answer_of(tmp_path, both)
    assert answer.verdict == "explained"
    assert [e.name for e in answer.effects] == ["machine_scale" if scale == 1.0 else "current_scale"]


def test_friction_and_magnets_of_a_table_with_torque(tmp_path):
    truth = Truth(psi=0.93 * PSI)
    answer = answer_of(tmp_path, with_torque(table(truth), truth, friction=0.3))
    values = found(answer)
    assert {e.name for e in answer.effects} == {"friction", "magnet_flux"}
    assert values["coulomb_friction_nm"] == pytest.approx(0.3, abs=0.02)
    assert values["magnet_flux_wb"] == pytest.approx(0.93 * PSI, rel=0.002)


def test_a_torque_that_the_drive_computed_is_no_measurement(tmp_path):
    truth = Truth(psi=0.93 * PSI)
    columns = table(truth)
    computed = with_torque(columns, noise_nm=0.0)  # from the currents, with the constants of the drive file
    answer = answer_of(tmp_path, computed)
    assert found(answer) == {"magnet_flux_wb": pytest.approx(0.93 * PSI, rel=0.002)}
    assert [e.name for e in answer_of(tmp_path, columns).effects] == [e.name for e in answer.effects]


def test_a_locked_rotor_whose_time_has_too_few_digits(tmp_path):
    """A date of ten digits of which six were written is the same in every row: the plateaus are points of a table."""
    rng = np.random.default_rng(4)
    i_q = np.repeat([1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0, -4.0, 5.0, -5.0], 60)
    noise = rng.standard_normal((2, len(i_q)))
    columns = {"t": np.full(len(i_q), 1.74223e9), "i_q": i_q + 0.01 * noise[0], "u_q_ref": 1.3 * R * i_q}
    columns["u_q_ref"] = columns["u_q_ref"] + 0.02 * noise[1]
    (tmp_path / "drive.toml").write_text(
        DRIVE.replace("sample_time_s = 0.0001", "") + "\n[constants]\ni_d = 0\nomega_e = 0\ntheta_e = 0\n"
    )
    answer = diagnose(write(tmp_path / "r.csv", columns), tmp_path / "drive.toml")
    assert found(answer) == {"resistance_ohm": pytest.approx(1.3 * R, rel=0.01)}
    assert "The file has no time" in answer.sentence
    assert any("is the same in all rows and tells no time" in note for note in answer.notes)
