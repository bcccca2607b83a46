# SPDX-License-Identifier: BSD-3-Clause
"""Causes that the simulation has no parameter for: described with their size, never named, beside what is named."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import DRIVE, GRID, MACHINE, columns
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.suspects import SUSPECTS

T = DRIVE.sample_time_s


def late(table, tau):
    """Phase currents behind a first-order filter of the time constant tau [s], exact for straight lines in between."""
    keep = np.exp(-T / tau)
    share = 1.0 - (1.0 - keep) * tau / T
    out = dict(table)
    for name in ("i_a", "i_b", "i_c"):
        x, y = table[name], np.empty_like(table[name])
        y[0] = x[0]
        for k in range(1, len(x)):
            y[k] = keep * y[k - 1] + (1.0 - keep - share) * x[k - 1] + share * x[k]
        out[name] = y
    return out


def answer_of(table):
    return diagnose(from_columns(table, T, "test bench"), PAPER)


def test_late_currents_are_described():
    tau = 0.2 * T
    answer = answer_of(late(columns(GRID), tau))
    assert answer.verdict == "unexplained" and not answer.effects and not answer.ambiguity
    term = answer.unknown_term
    assert "filter" in term.meaning and "filter" in answer.sentence and term.unit == "s"
    assert term.value == pytest.approx(tau, rel=0.1) and term.explains > 0.8


def test_what_is_known_is_named_beside_late_currents():
    psi = 0.98 * MACHINE.magnet_flux_wb
    answer = answer_of(late(columns(GRID, (("magnet_flux_wb", psi),)), 0.3 * T))
    assert [e.name for e in answer.effects] == ["magnet_flux"] and answer.verdict == "partly_explained"
    assert answer.effects[0].parameters["magnet_flux_wb"].value == pytest.approx(psi, rel=5e-3)
    assert "filter" in answer.unknown_term.meaning and 0.5 < answer.explained_share < 0.97


@pytest.mark.slow
def test_a_small_lag_is_noted_beside_an_explanation():
    answer = answer_of(late(columns(GRID, (("magnet_flux_wb", 0.9 * MACHINE.magnet_flux_wb),)), 0.1 * T))
    assert [e.name for e in answer.effects] == ["magnet_flux"] and answer.verdict == "explained"
    assert any("filter" in note for note in answer.notes)


def test_a_leg_of_its_own_voltage_is_no_offset_of_a_sensor():
    table = dict(columns(GRID))
    table["d_b"] = table["d_b"] + 0.006
    answer = answer_of(table)
    assert answer.verdict == "unexplained" and not answer.effects
    assert "legs" in answer.unknown_term.meaning
    assert answer.unknown_term.value == pytest.approx(0.006 * DRIVE.inverter.dc_bus_v, rel=0.05)


def test_offsets_of_the_sensors_are_named():
    table = dict(columns(GRID))
    table["i_a"] = table["i_a"] + 0.05 * DRIVE.machine.rated_current_a
    answer = answer_of(table)
    assert [e.name for e in answer.effects] == ["current_offset"] and answer.verdict == "explained"


def test_sensors_that_bend_are_no_scale_and_no_saturation():
    table, rated = dict(columns(GRID)), DRIVE.machine.rated_current_a
    for name in ("i_a", "i_b", "i_c"):
        table[name] = table[name] * (1.0 - 0.05 * (table[name] / rated) ** 2)
    answer = answer_of(table)
    assert answer.verdict == "unexplained" and not answer.effects and "full scale" in answer.sentence
    assert answer.unknown_term.value == pytest.approx(-0.05, abs=0.01)


def test_a_soft_shaft_is_no_inductance():
    table = dict(columns(GRID))
    i_q = table["i_a"] * -np.sin(table["theta_e"]) + (table["i_b"] - table["i_c"]) / 3**0.5 * np.cos(table["theta_e"])
    smooth = np.convolve(np.pad(i_q, 20, mode="edge"), np.full(41, 1 / 41), "valid")
    table["theta_e"] = (table["theta_e"] + 0.05 * smooth / DRIVE.machine.rated_current_a) % (2 * np.pi)
    answer = answer_of(table)
    assert answer.verdict == "unexplained" and not answer.effects and "soft shaft" in answer.sentence
    assert answer.unknown_term.value == pytest.approx(0.05, rel=0.1)


def test_shorted_turns(phase=1, conductance=0.02):
    """The current of the short flows in the terminals of its phase and does not magnetise."""
    table = dict(columns(GRID))
    axis = 2.0 * np.pi / 3.0 * phase
    emf = -DRIVE.machine.magnet_flux_wb * table["omega_e"] * np.sin(table["theta_e"] - axis)
    for n, x in enumerate("abc"):
        table[f"i_{x}"] = table[f"i_{x}"] + conductance * emf * (2.0 / 3.0 if n == phase else -1.0 / 3.0)
    answer = answer_of(table)
    assert answer.verdict == "unexplained" and not answer.effects and "turns of one phase" in answer.sentence
    assert answer.unknown_term.formula.startswith("conductance_b_s")
    assert answer.unknown_term.value == pytest.approx(conductance, rel=0.1)


def test_a_resolver_with_unequal_signals():
    """Sine 4 % larger than cosine: at the highest speed, the mean of the angle over some samples hides it."""
    table = dict(columns(GRID))
    theta = table["theta_e"]
    table["theta_e"] = (theta + 0.02 * np.sin(2.0 * theta)) % (2 * np.pi)
    answer = answer_of(table)
    assert answer.verdict == "unexplained" and not answer.effects and "resolver" in answer.sentence
    assert answer.unknown_term.value == pytest.approx(0.02, rel=0.05)


def test_suspects_are_not_in_the_catalogue():
    assert SUSPECTS and not set(SUSPECTS) & set(CATALOGUE)
    assert not any(e.named for e in SUSPECTS.values()) and all(e.named for e in CATALOGUE.values())
