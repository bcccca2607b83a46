# SPDX-License-Identifier: BSD-3-Clause
"""Sheets of a dynamometer: torque, current and speed without the voltages of the control."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.diagnoses.answers import answer_of, found, said
from cocotb_tests.support.drives import PAIRS, PSI
from cocotb_tests.support.recordings.bench_logs import Truth, table, with_torque
from cocotb_tests.support.recordings.from_equations import nominal_of
from fluxproof.diagnosis.checks import torque_lost
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.ingest.usual_names import usual

POINTS = [(w, 0.0, q) for w in (80.0, 250.0, 500.0, -300.0) for q in (0.0, 1.0, 2.0, 3.0, 4.5, -2.0)]
EITHER = ("current_scale", "magnet_flux")


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def sheet(psi=1.0, **more) -> dict:
    truth = Truth(psi=psi * PSI)
    columns = with_torque(table(truth, points=POINTS), truth, **more)
    return {name: columns[name] for name in ("omega_e", "i_q", "torque")}


def test_a_healthy_sheet_agrees_and_says_what_was_compared(tmp_path):
    answer = answer_of(tmp_path, sheet())
    assert answer.verdict == "no_mismatch" and not answer.effects
    assert said(answer, "only the torque is compared") and said(answer, "i_d is not recorded and taken to be 0")
    assert (answer.fit.signal, answer.fit.unit) == ("torque", "Nm")


@pytest.mark.parametrize("more", [{"psi": 0.93}, {"psi": 1.1}, {"scale": 1.08}, {"scale": 0.9}])
def test_flux_and_a_scale_of_the_currents_are_an_ambiguity(tmp_path, more):
    answer = answer_of(tmp_path, sheet(**more))
    assert answer.verdict == "ambiguous" and answer.ambiguity == (EITHER,) and not answer.effects


def test_friction_has_its_size_also_beside_another_flux(tmp_path):
    alone = answer_of(tmp_path, sheet(friction=0.3))
    assert alone.verdict == "explained" and [e.name for e in alone.effects] == ["friction"]
    assert found(alone)["coulomb_friction_nm"] == pytest.approx(0.3, abs=0.02)
    both = answer_of(tmp_path, sheet(psi=0.93, friction=0.3))
    assert both.ambiguity == (EITHER,) and [e.name for e in both.effects] == ["friction"]
    assert found(both)["coulomb_friction_nm"] == pytest.approx(0.3, abs=0.03)


def test_shaft_speed_and_small_units(tmp_path):
    columns = sheet(psi=0.93)
    rpm = columns["omega_e"] / PAIRS * 30 / np.pi
    named = {"rpm [rpm]": rpm, "T [N.mm]": 1e3 * columns["torque"], "i_q": columns["i_q"]}
    entries = '\n[columns]\nrpm = "omega_e"\nT = "torque"\n'
    assert answer_of(tmp_path, named, entries).ambiguity == (EITHER,)


def test_a_bus_current_is_no_bus_voltage(tmp_path):
    """ "DC bus" is a usual name of the voltage; its unit tells that it is another signal."""
    columns = sheet(psi=0.93) | {"DC bus [A]": np.ones(len(POINTS))}
    assert answer_of(tmp_path, columns).ambiguity == (EITHER,)
    assert usual("DC bus [A]", "") is None and usual("DC bus", "")[0] == usual("DC bus [kV]", "")[0] == "u_dc"
    assert usual("u_d_ref [u_dc/2]", "") and usual("ud", "%")


def test_rows_without_torque_under_current_are_a_lost_angle(tmp_path):
    columns = sheet()
    last = {"omega_e": [250.0, 200.0], "i_q": [4.5, 4.5], "torque": [0.05, -0.02]}
    answer = answer_of(tmp_path, {name: np.append(values, last[name]) for name, values in columns.items()})
    assert answer.verdict == "no_mismatch"
    (lost,) = [p for p in answer.problems if p.code == "torque_lost"]
    assert (lost.row, lost.count, lost.action) == (len(columns["i_q"]), 2, "rows not used")
    assert "the angle was lost" in answer.details


def test_the_torque_that_accelerates_a_rotor_is_not_lost(nominal):
    """A reversal in a log: the inertia takes the torque, as in 13 of 16 undamaged logs of `make blind` (seed 1712)."""
    n = 4000
    speed = np.concatenate([np.full(n, -400.0), np.linspace(-400.0, 400.0, 400), np.full(n, 400.0)])
    t, current = 1e-4 * np.arange(len(speed)), np.full(len(speed), 3.0)
    torque = 1.5 * PAIRS * PSI * current - 1.5e-4 * np.gradient(speed, t)
    columns = {"t": t, "omega_e": speed, "i_d": 0.0 * t, "i_q": current, "torque": torque}
    recording = from_columns(columns, 1e-4)
    torque_lost.check(recording, nominal)
    assert not recording.problems and recording.usable.all()
    recording.slow = recording.points = True  # of a bench that waits at each of its points, the same rows are a fault
    torque_lost.check(recording, nominal)
    assert [p.code for p in recording.problems] == ["torque_lost"] and not recording.usable.all()


def test_an_unexplained_torque_has_a_best_fit_in_its_own_unit(tmp_path):
    """The residual of a best fit was that of the voltage: zero of a dyno sheet, which then had no best fit."""
    columns = sheet(psi=0.9)
    columns["torque"] = columns["torque"] + 0.6 * np.sin(3.0 * columns["i_q"]) * np.sign(columns["omega_e"])
    answer = answer_of(tmp_path, columns)
    assert answer.verdict == "unexplained" and not answer.effects, answer.sentence
    assert answer.best_fit is not None and 0.0 < answer.best_fit.left < answer.fit.holdout_before
    assert "N m there" in answer.details or "Nm there" in answer.details, answer.details
