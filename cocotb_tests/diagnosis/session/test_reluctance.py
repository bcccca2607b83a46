# SPDX-License-Identifier: BSD-3-Clause
"""Machines without magnets."""

from __future__ import annotations

import pytest

from cocotb_tests.support.recordings.bench_logs import Truth, table
from cocotb_tests.support.recordings.from_core import recorded
from cocotb_tests.support.recordings.from_equations import DRIVE, write
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.ground.nominal import flux_level, load_nominal

L_D, L_Q, RATED = 0.06, 0.01581, 5.23
CURRENTS = ((1.0, 1.0), (2.0, 3.0), (3.0, -2.0), (4.0, 0.5))
RELUCTANCE = DRIVE.replace("magnet_flux_wb = 0.165", "magnet_flux_wb = 0").replace("0.01607", f"{L_D}")


@pytest.fixture
def drive(tmp_path):
    path = tmp_path / "drive.toml"
    path.write_text(RELUCTANCE)
    return path


def test_a_flux_that_limits_the_speed(drive):
    assert flux_level(load_nominal(drive).machine) == pytest.approx(L_D * RATED)
    drive.write_text(DRIVE)
    assert flux_level(load_nominal(drive).machine) == 0.165


def test_a_table_of_a_reluctance_machine(drive, tmp_path):
    truth = Truth(l_d=L_D, l_q=L_Q, psi=0.0)
    points = [(w, *i) for w in (80.0, 250.0, 500.0, -300.0) for i in CURRENTS]
    healthy = diagnose(write(tmp_path / "points.csv", table(truth, points)), drive)
    assert healthy.verdict == "no_mismatch", healthy.sentence
    truth = Truth(l_d=0.9 * L_D, l_q=L_Q, psi=0.0)
    answer = diagnose(write(tmp_path / "points.csv", table(truth, points)), drive)
    found = {k: e.value for effect in answer.effects for k, e in effect.parameters.items()}
    assert found == {"inductance_d_h": pytest.approx(0.9 * L_D, rel=0.01)}, answer.sentence


def test_a_log_of_a_reluctance_machine(drive):
    points = tuple((w, *i) for w in (60.0, 150.0, -100.0) for i in CURRENTS)
    machine = {"magnet_flux_wb": 0.0, "inductance_d_h": L_D, "inductance_q_h": L_Q}
    answer = diagnose(recorded(points, machine=machine), load_nominal(drive))
    assert answer.verdict == "no_mismatch", answer.sentence
