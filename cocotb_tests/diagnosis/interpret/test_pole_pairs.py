# SPDX-License-Identifier: BSD-3-Clause
"""Wrong pole pairs behind a table of operating points: the right number is named, or none."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import L_D, L_Q, PSI, R
from cocotb_tests.support.recordings.bench_logs import Truth, table
from cocotb_tests.support.recordings.from_equations import DRIVE, write
from fluxproof.diagnosis import diagnose

RPM = 30 / np.pi


def in_rpm(columns, pairs=4):
    """The columns with the speed of the shaft."""
    kept = {name: values for name, values in columns.items() if name != "omega_e"}
    return kept | {"speed_rpm": columns["omega_e"] / pairs * RPM}


def answer_of(folder, truth, stated):
    """The answer to a table of operating points with a speed in rpm."""
    (folder / "drive.toml").write_text(DRIVE.replace("pole_pairs = 4", f"pole_pairs = {stated}"))
    return diagnose(write(folder / "points.csv", in_rpm(table(truth))), folder / "drive.toml")


@pytest.mark.parametrize("stated", [2, 3, 8])
def test_a_table_tells_the_pole_pairs(tmp_path, stated):
    answer = answer_of(tmp_path, Truth(), stated)
    assert [(c.code, c.factor) for c in answer.conventions] == [("pole_pairs", pytest.approx(stated / 4))]
    assert f"4 pole pairs, not {stated}" in answer.sentence and not answer.effects, answer.sentence


def test_weak_magnets_behind_wrong_pole_pairs_have_their_size(tmp_path):
    answer = answer_of(tmp_path, Truth(psi=0.95 * PSI), 3)
    assert [c.code for c in answer.conventions] == ["pole_pairs"], answer.sentence
    found = {k: e.value for effect in answer.effects for k, e in effect.parameters.items()}
    assert found == {"magnet_flux_wb": pytest.approx(0.95 * PSI, rel=0.005)}


def test_a_resistance_behind_wrong_pole_pairs_is_no_bus_sensor(tmp_path):
    """A bus that reads a third too much, and a resistance of its own, leave the same."""
    answer = answer_of(tmp_path, Truth(r=1.2 * R), 3)
    assert [c.code for c in answer.conventions] == ["pole_pairs"], answer.sentence
    found = {k: e.value for effect in answer.effects for k, e in effect.parameters.items()}
    assert found == {"resistance_ohm": pytest.approx(1.2 * R, rel=0.01)}


@pytest.mark.parametrize("truth", [Truth(psi=0.75 * PSI), Truth(l_d=0.75 * L_D, l_q=0.75 * L_Q)])
def test_one_scale_of_a_machine_is_no_number_of_pole_pairs(tmp_path, truth):
    assert "pole_pairs" not in [c.code for c in answer_of(tmp_path, truth, 4).conventions]


def test_an_electrical_speed_tells_no_pole_pairs(tmp_path):
    """The same machine values off by a common factor, but the pole pairs do not enter."""
    (tmp_path / "drive.toml").write_text(DRIVE)
    columns = table(Truth(psi=0.75 * PSI, l_d=0.75 * L_D, l_q=0.75 * L_Q))
    assert not diagnose(write(tmp_path / "points.csv", columns), tmp_path / "drive.toml").conventions
