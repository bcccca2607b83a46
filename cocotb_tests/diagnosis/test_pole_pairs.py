# SPDX-License-Identifier: BSD-3-Clause
"""Wrong pole pairs: the right number is told, or none."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.bench_logs import L_D, L_Q, PSI, R, Truth, emf, table
from cocotb_tests.support.recordings_made import DRIVE, made, write
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.conventions.apply import read_recording
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.loading.load import load_recording

RPM = 30 / np.pi


def read(folder, columns, pairs):
    """The recording as read with a drive file of ``pairs`` pole pairs."""
    (folder / "drive.toml").write_text(DRIVE.replace("pole_pairs = 4", f"pole_pairs = {pairs}"))
    return load_recording(write(folder / "r.parquet", columns), load_nominal(folder / "drive.toml"))


def in_rpm(columns, pairs=4):
    """The columns with the speed of the shaft."""
    kept = {name: values for name, values in columns.items() if name != "omega_e"}
    return kept | {"speed_rpm": columns["omega_e"] / pairs * RPM}


@pytest.mark.parametrize("stated", [1, 2, 3, 5, 8])
def test_a_speed_of_the_shaft_tells_the_pole_pairs(tmp_path, stated):
    recording = read(tmp_path, in_rpm(made()), stated)
    assert recording.meta["restated"].value == 4
    assert "angle_speed" not in {p.code for p in recording.problems}


def test_a_recording_that_was_read_again_is_not_scaled_once_more(tmp_path):
    recording = read(tmp_path, in_rpm(made()), 3)
    again = read_recording(recording, [recording.meta["restated"]])
    np.testing.assert_array_equal(again["omega_e"], recording["omega_e"])


def test_one_pole_pair_is_singular(tmp_path):
    assert "1 pole pair, not 2 " in read(tmp_path, in_rpm(made(), 1), 2).meta["restated"].says


@pytest.mark.parametrize("scale", [1.13, 0.7, 1.4])
def test_a_speed_that_no_pole_pairs_explain_tells_none(tmp_path, scale):
    columns = made()
    columns["omega_e"] = scale * columns["omega_e"]
    recording = read(tmp_path, in_rpm(columns), 4)
    assert "restated" not in recording.meta and "angle_speed" in {p.code for p in recording.problems}


def test_terminal_voltages_and_a_speed_of_the_shaft(tmp_path):
    assert read(tmp_path, in_rpm(emf(seconds=0.2)), 6).meta["restated"].value == 4


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
