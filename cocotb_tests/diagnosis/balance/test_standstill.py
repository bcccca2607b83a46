# SPDX-License-Identifier: BSD-3-Clause
"""Rows at standstill: resistance and inverter loss, whose mean over a turn is not that at an angle."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.diagnoses.answers import answer_of, found, said, without
from cocotb_tests.support.drives import PSI, R
from cocotb_tests.support.recordings.bench_logs import Truth, sampled, table
from cocotb_tests.support.recordings.from_equations import nominal_of, write
from fluxproof.diagnosis.balance.slow_view import slow_view
from fluxproof.diagnosis.loading.load import load_recording

AT_REST = [(0.0, d, 0.0) for d in (-5.0, -4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0, 5.0)]
WEAK = Truth(psi=0.95 * PSI)


def test_standstill_shows_resistance_and_dead_time(tmp_path):
    angle = np.full(len(AT_REST) * 3, 0.4)
    columns = table(Truth(r=2.4), points=AT_REST, repeats=3, theta=angle)
    ohms = answer_of(tmp_path, columns)
    named = {e.name for e in ohms.effects} | set().union(*ohms.ambiguity)
    assert "resistance" in named and "dead_time" not in {e.name for e in ohms.effects}
    loss = answer_of(tmp_path, table(Truth(v_dead=4.0), points=AT_REST, repeats=3, theta=angle))
    assert found(loss)["v_dead_v"] == pytest.approx(4.0, abs=0.3)


def test_standstill_needs_the_angle(tmp_path):
    columns = without(table(Truth(r=2.4), points=AT_REST, theta=np.zeros(len(AT_REST))), "theta_e")
    answer = answer_of(tmp_path, columns)
    assert answer.verdict == "bad_recording" and "record theta_e, or add it to [constants]" in answer.sentence
    assert answer_of(tmp_path, columns, "[constants]\ntheta_e = 0\n").verdict in ("explained", "ambiguous")
    mixed = answer_of(tmp_path, table(WEAK, points=[*AT_REST[:3], *[(w, 0.0, q) for w in (200.0, 400.0) for q in
                                                                   (-4.0, -2.0, 0.0, 2.0, 4.0)]]))  # fmt: skip
    assert said(mixed, "3 rows at standstill are not used") and found(mixed).keys() == {"magnet_flux_wb"}


def test_standstill_counts_in_a_slow_log(tmp_path):
    answer = answer_of(tmp_path, sampled(500.0, Truth(r=2.3), points=AT_REST, hold_s=0.8))
    # A scale of currents or voltages would fit too, but none is off by so much in a usual drive.
    assert found(answer)["resistance_ohm"] == pytest.approx(2.3, abs=0.08)
    nothing = answer_of(tmp_path, sampled(500.0, Truth(r=2.3), points=AT_REST, hold_s=0.8, angle=False))
    assert nothing.verdict == "bad_recording" and "theta_e" in nothing.sentence


def test_loss_at_rest_is_that_of_the_angle(tmp_path):
    from fluxproof.diagnosis.catalogue import CATALOGUE

    angle, nominal = np.linspace(0.05, 0.45, len(AT_REST)), nominal_of(tmp_path)
    truth = Truth(v_dead=1.0)
    recording = load_recording(
        write(tmp_path / "r.csv", table(truth, points=AT_REST, theta=angle, noise_v=0.0)), nominal
    )
    view = slow_view(recording, nominal)
    column = CATALOGUE["dead_time"].core(view)["v_0.02"]["u"].mean(axis=1)
    i = np.array([d for _, d, _ in AT_REST])
    left = (recording["u_d_ref"] + 1j * recording["u_q_ref"] - R * i)[view.rows]
    assert np.abs(column - left).max() < 0.02
