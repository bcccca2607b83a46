# SPDX-License-Identifier: BSD-3-Clause
"""What a check undoes holds at every operating point and explains more than an angle that is off."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.diagnoses.answers import without
from cocotb_tests.support.drives import L_D, L_Q, PSI, RATED
from cocotb_tests.support.recordings.bench_logs import GRID, Truth, sampled, table
from cocotb_tests.support.recordings.from_equations import made, nominal_of, write
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.checks.balance import SteadyRows, contradicts
from fluxproof.diagnosis.ground.machine import steady_voltage
from fluxproof.diagnosis.ground.recording import RecordingError
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.words.phrases import CORRECTED

PAIRS = 4


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def corrected(recording) -> list[str]:
    return [p.message for p in recording.problems if p.action in CORRECTED]


def test_a_sign_that_fits_at_large_currents_only_is_not_undone(tmp_path, nominal):
    """Field weakening leaves next to no q voltage at the largest current: its sign says nothing there."""
    weak = -PSI / L_D  # no q voltage is left
    points = [(450.0, 0.0, 1.0), (300.0, 0.0, 2.0), (450.0, 0.4 * weak, 1.0)] * 6
    points += [(450.0, weak * x, 0.3 * RATED) for x in (1.0, 1.002, 1.004, 1.006, 1.008, 1.01)]
    columns = table(Truth(psi=0.9 * PSI), points=points)
    assert not corrected(load_recording(write(tmp_path / "r.csv", columns), nominal))


@pytest.mark.parametrize("fit", [0, 1, 5])
def test_rows_that_fit_as_recorded_speak_against_a_change(nominal, fit):
    """Magnets that warm in field weakening turn the q voltage round: its sign fits all but the first rows."""
    omega, i = np.full((2, 100), 450.0), np.full((2, 100), 0.5 + 1.0j)
    u = steady_voltage(nominal.machine, i[0], omega[0])
    rows = SteadyRows(nominal.machine, 1e-4, omega, omega, i, np.where(np.arange(100) < fit, u, np.conj(u)))
    assert contradicts(rows, rows.change(u_dq=np.conj(rows.u_dq))) == (fit > 1)


def test_magnets_that_warm_in_field_weakening_are_no_sign_of_the_voltage(tmp_path, nominal):
    """Warm magnets turn the q voltage of nearly all rows round; the few cold rows fit as recorded."""
    deep = -0.95 * PSI / L_D  # what is left of the flux, a twentieth, has the other sign with magnets of nine tenths
    points = [(w, deep, q) for w in (1500.0, 1800.0) for q in (0.5, -0.5, 0.8, -0.8)]
    cold, hot = table(points=[(1500.0, 0.0, 1.0), (1500.0, 0.0, -1.0)]), table(Truth(psi=0.9 * PSI), points * 12)
    both = {name: np.concatenate([cold[name], hot[name]]) for name in hot}
    assert not corrected(load_recording(write(tmp_path / "r.csv", both), nominal))
    (undone,) = corrected(load_recording(write(tmp_path / "hot.csv", hot), nominal))  # nothing contradicts it there
    assert undone.startswith("u_q_ref has the opposite sign")


def test_currents_that_a_wrong_nameplate_hides_are_in_amperes(tmp_path, nominal):
    """Stronger magnets and a larger L_d cancel at the largest current: no prefix is seen where no current is."""
    stronger = Truth(psi=1.86 * PSI, l_d=0.86 * PSI / 5.0)
    points = [(w, i_d, 0.0) for w in (200.0, 300.0, 400.0, 500.0) for i_d in (0.0, -2.0, -3.5, -5.0)]
    recording = load_recording(write(tmp_path / "r.csv", table(stronger, points=points)), nominal)
    assert not [p for p in recording.problems if p.fatal]


def test_an_angle_that_is_off_at_one_point_is_no_order_of_phases(tmp_path, nominal):
    """At one current an angle that is 25 degrees off leaves as little with another order of the phases."""
    speed, step, n = 400.0, 1e-4, 3000
    t = step * np.arange(n)
    theta, turns = speed * t, np.exp(-2j * np.pi / 3 * np.arange(3))
    i = 1.5 - 3.0j
    u = (1j * speed * (L_D * i.real + 1j * L_Q * i.imag + PSI)) * np.exp(1j * speed * step / 2)
    phases = lambda z: (np.outer(z * np.exp(1j * theta), turns)).real  # noqa: E731
    duty = 0.5 + np.roll(phases(u), 1, axis=0) / 563.0
    columns = {"t": t, "theta_e": np.mod(theta + np.radians(25), 2 * np.pi), "omega_e": np.full(n, speed)}
    columns |= {"u_dc": np.full(n, 563.0)} | dict(zip(("d_a", "d_b", "d_c"), duty.T, strict=True))
    columns |= dict(zip(("i_a", "i_b", "i_c"), phases(i).T, strict=True))
    assert not corrected(load_recording(write(tmp_path / "r.parquet", columns), nominal))


@pytest.mark.parametrize("name", ["i_a", "i_b"])
def test_the_sign_of_one_of_two_measured_currents_is_undone(tmp_path, nominal, name):
    """The third current follows from the other two, so that it changes with them."""
    table_ = without(made(), "i_c")
    recording = load_recording(write(tmp_path / "r.parquet", table_ | {name: -table_[name]}), nominal)
    assert corrected(recording)[0].startswith(f"{name} has the opposite sign")
    np.testing.assert_allclose(recording[name], table_[name])


def test_exchanged_current_and_voltage_are_seen(tmp_path, nominal):
    columns = table(repeats=3)
    columns["i_q"], columns["u_q_ref"] = columns["u_q_ref"], columns["i_q"]
    recording = load_recording(write(tmp_path / "r.csv", columns), nominal)
    (finding,) = (p.message for p in recording.problems if p.fatal or p.action in CORRECTED)
    assert "swapped" in finding


def test_a_current_as_large_as_the_voltage_is_not_in_milliamperes(tmp_path, nominal):
    columns = table(points=[(w, d, q) for w in (800.0, 1200.0, -1000.0) for d, q in ((0.0, 1.0), (-2.0, 2.0))])
    columns["i_q"], columns["u_q_ref"] = columns["u_q_ref"], columns["i_q"]
    (finding,) = load_recording(write(tmp_path / "r.csv", columns), nominal).problems
    assert finding.fatal and "they look swapped" in finding.message


def test_a_speed_in_rpm_is_seen_without_an_angle(tmp_path, nominal):
    columns = without(sampled(1e4, hold_s=0.06, ramp_s=0.02), "theta_e")
    columns["omega_e"] = columns["omega_e"] * 30 / np.pi / PAIRS
    recording = load_recording(write(tmp_path / "r.parquet", columns), nominal)
    assert corrected(recording) == ["the speed is in rpm of the shaft"]


def test_a_unit_that_was_guessed_is_in_the_headline(tmp_path, nominal):
    columns = table(Truth(psi=0.95 * PSI), points=GRID[1::2])
    columns["omega_e"] = columns["omega_e"] * 30 / np.pi / PAIRS
    answer = diagnose(write(tmp_path / "r.csv", columns), nominal)
    assert answer.verdict == "explained" and "the speed is in rpm of the shaft" in answer.sentence


def test_a_proposal_for_the_speed_asks_for_its_unit(tmp_path, nominal):
    columns = table()
    columns["omega"] = columns.pop("omega_e")
    with pytest.raises(RecordingError, match=r"'omega' for omega_e if its unit is stated, .*unit = 'rpm'"):
        load_recording(write(tmp_path / "r.csv", columns), nominal)
