# SPDX-License-Identifier: BSD-3-Clause
"""One operating point: what drifts while it is held, and a constant misfit."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.diagnoses.answers import answer_of, found, said, without
from cocotb_tests.support.drives import PSI
from cocotb_tests.support.recordings.bench_logs import Truth, table, warming
from fluxproof.diagnosis.decide import one_point
from fluxproof.diagnosis.decide.constant_misfit import explaining

WEAK = Truth(psi=0.95 * PSI)


def test_one_point_that_warms_up(tmp_path):
    answer = answer_of(tmp_path, warming())
    assert answer.verdict == "explained"
    values = found(answer)
    assert values["magnet_flux_drift_wb"] == pytest.approx(-0.05 * PSI, rel=0.06)
    assert values["resistance_temp_coeff_per_k"] == pytest.approx(0.0039, rel=0.1)
    assert answer.fit.holdout_after < answer.fit.noise_floor < 0.1 * answer.fit.holdout_before
    assert said(answer, "One operating point") and said(answer, "winding temperature was recorded from")
    faster = found(answer_of(tmp_path, warming(hours=0.2, step_s=0.1)))
    assert faster["magnet_flux_drift_wb"] == pytest.approx(-0.05 * PSI, rel=0.03)
    assert faster["resistance_temp_coeff_per_k"] == pytest.approx(0.0039, rel=0.1)
    steady = answer_of(tmp_path, warming(magnets=0.0, copper=0.0))
    assert steady.verdict == "no_mismatch" and not steady.effects


def test_one_point_without_i_d_cannot_separate_winding_and_magnets(tmp_path):
    blind = answer_of(tmp_path, without(warming(i=4j), "temp_winding"))
    assert blind.verdict == "ambiguous" and blind.ambiguity == (("magnet_temperature", "resistance_temperature"),)
    assert len({(r.omega_e, r.i_d, r.i_q) for r in blind.next_recording}) == 3
    known = answer_of(tmp_path, warming(i=4j))
    (magnets,) = known.effects
    drift = magnets.parameters["magnet_flux_drift_wb"]
    assert abs(drift.value + 0.05 * PSI) < 2.0 * drift.sigma  # copper may hide a part of it


def test_a_constant_misfit_at_one_point_is_an_ambiguity(tmp_path):
    columns = warming(magnets=0.0, copper=0.0)
    columns["u_q_ref"] = 1.04 * columns["u_q_ref"]
    answer = answer_of(tmp_path, columns)
    assert answer.verdict == "ambiguous" and not answer.effects
    assert {"magnet_flux", "udc_gain"} <= set(answer.ambiguity[-1]) and said(answer, "one point cannot show why")
    assert answer.fit.train_before == pytest.approx(2.63, abs=0.02) and answer.explained_share > 0.99
    assert answer.fit.train_after < answer.fit.noise_floor and answer.fit.holdout_after < answer.fit.noise_floor
    sizes = {e.name: e.parameters for e in answer.alternatives}
    assert sizes.keys() == set(answer.ambiguity[-1]) and "magnet flux off the nameplate: flux linkage" in answer.details
    flux, gain = sizes["magnet_flux"]["magnet_flux_wb"], sizes["udc_gain"]["udc_gain"]
    assert abs(flux.value - 1.044 * PSI) < 0.01 * PSI and abs(gain.value - 0.04) < 0.01
    assert len(answer.next_recording) == 3
    two_rows = answer_of(tmp_path, table(WEAK, points=[(300.0, 0.0, 4.0)] * 2))
    assert two_rows.fit.train_before > 2.0 > two_rows.fit.train_after
    assert two_rows.verdict == "ambiguous" and "magnet_flux" in two_rows.ambiguity[0]


def test_the_only_cause_of_a_constant_misfit_is_told_and_not_asserted(tmp_path, monkeypatch):
    """An angle 0.43 rad ahead, or late at this speed; where only one of them can be, one point does not prove it."""
    columns = warming(magnets=0.0, copper=0.0)
    i, u = (columns[f"{x}_d{r}"] + 1j * columns[f"{x}_q{r}"] for x, r in (("i", ""), ("u", "_ref")))
    for x, ref, values in (("i", "", i * np.exp(-0.43j)), ("u", "_ref", u * np.exp(-0.43j))):
        columns |= {f"{x}_d{ref}": values.real, f"{x}_q{ref}": values.imag}
    both = answer_of(tmp_path, columns)
    assert both.verdict == "ambiguous" and {"encoder_offset", "delay"} <= set(both.ambiguity[0])
    alone = lambda *found: tuple(e for e in explaining(*found) if e.name == "encoder_offset")  # noqa: E731
    monkeypatch.setattr(one_point, "explaining", alone)
    answer = answer_of(tmp_path, columns)
    assert answer.verdict == "unexplained" and [e.name for e in answer.best_fit.effects] == ["encoder_offset"]
    assert answer.best_fit.effects[0].parameters["offset_rad"].value == pytest.approx(0.43, abs=0.02)
    assert "one operating point cannot confirm it" in answer.sentence and answer.best_fit.probability > 0.5
    assert len(answer.next_recording) == 3


def test_a_constant_misfit_that_nothing_explains_is_the_remainder(tmp_path):
    columns = warming()
    columns["u_d_ref"] = columns["u_d_ref"] + 60.0
    columns["u_q_ref"] = 0.7 * columns["u_q_ref"]
    answer = answer_of(tmp_path, columns)
    assert answer.verdict == "unexplained" and answer.explained_share == 0.0 and not answer.effects
    assert answer.fit.holdout_after == answer.fit.holdout_before == pytest.approx(63.2, abs=0.5)
    assert [part.size for part in answer.remainder] == [pytest.approx(63.2, abs=0.5)]
    assert said(answer, "would explain the drift; not reported, as")
    assert [p.code for p in answer.problems] == ["slow_sampling"]  # at one point a change of signs fits by chance
