# SPDX-License-Identifier: BSD-3-Clause
"""Wrong pole pairs: the right number is told, or none."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.recordings.bench_logs import emf
from cocotb_tests.support.recordings.from_equations import DRIVE, made, write
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
