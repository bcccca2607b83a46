# SPDX-License-Identifier: BSD-3-Clause
"""Loggers that hold rows, and angles that Hall sensors hold."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_equations import T, codes, made, nominal_of, write
from fluxproof.diagnosis.checks import limits_met
from fluxproof.diagnosis.loading.load import load_recording


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def held(table, rows):
    """Every column but the time taken at these rows."""
    return {name: values if name == "t" else values[rows] for name, values in table.items()}


def test_rows_that_a_logger_holds_are_read_once(tmp_path, nominal):
    table = made()
    path = write(tmp_path / "r.parquet", held(table, np.arange(4000) // 2 * 2))
    recording = load_recording(path, nominal)
    assert codes(recording) == ["repeated", "slow_sampling"] and len(recording) == 2000
    assert "repeated: 2 equal" in recording.problems[0].message and "sample_time_s" in recording.problems[0].action
    np.testing.assert_allclose(np.diff(recording["t"]), 2 * T)
    np.testing.assert_array_equal(recording["i_a"], table["i_a"][::2])


def test_rows_that_are_written_thrice_but_follow_each_other(tmp_path, nominal):
    table = made()
    thrice = {name: values.repeat(3) for name, values in table.items()} | {"t": np.arange(12000) * T}
    path = write(tmp_path / "r.parquet", thrice)
    recording = load_recording(path, nominal)
    assert codes(recording) == ["repeated"] and recording.joined[:-1].all() and not recording.slow
    for name, values in table.items():
        np.testing.assert_allclose(recording[name], values, rtol=1e-9, atol=1e-9)


def test_a_drive_at_rest_in_coarse_codes_is_no_held_log(tmp_path, nominal):
    table = made(speed=0.0, noise=0.0)
    path = write(tmp_path / "r.parquet", {n: v if n == "t" else np.round(v, 1) for n, v in table.items()})
    assert "repeated" not in codes(load_recording(path, nominal))


@pytest.mark.parametrize("unit", [1.0, 180.0 / np.pi])
def test_the_angle_of_hall_sensors_is_told(tmp_path, nominal, unit):
    table = made()
    steps = (np.floor(np.mod(table["theta_e"], 2 * np.pi) / (np.pi / 3)) + 0.5) * (np.pi / 3)
    recording = load_recording(write(tmp_path / "r.parquet", table | {"theta_e": steps * unit}), nominal)
    (fatal,) = [p for p in recording.problems if p.fatal]
    assert fatal.code == "hall_steps" and "6 steps per turn" in fatal.message and "encoder" in fatal.message


def test_an_angle_that_is_sampled_in_step_with_the_rotor_is_no_hall_angle(tmp_path, nominal):
    table = made()
    theta = np.arange(4000) * 2 * np.pi / 10
    recording = load_recording(write(tmp_path / "r.parquet", table | {"theta_e": theta % (2 * np.pi)}), nominal)
    assert "hall_steps" not in codes(recording)


def oversampled(table, times, first=0):
    """A scope's rows: commands as steps, currents with the ripple of the PWM between the samples of the control."""
    n = len(table["t"])
    fine, coarse = np.arange(n * times) / times, np.arange(n)
    out = {"t": fine * T}
    for name, values in table.items():
        if name.startswith("d_"):
            out[name] = np.repeat(values, times)
        elif name != "t":
            between = np.interp(fine, coarse, np.unwrap(values) if name == "theta_e" else values)
            out[name] = between + (0.3 * np.sin(2 * np.pi * fine) if name.startswith("i_") else 0.0)
    return {name: values[first:] for name, values in out.items()}


@pytest.mark.parametrize("first", [0, 3])
def test_of_several_rows_a_period_that_of_the_control_is_kept(tmp_path, nominal, first):
    table = made()
    recording = load_recording(write(tmp_path / "r.parquet", oversampled(table, 8, first)), nominal)
    assert codes(recording) == ["oversampled"] and recording.joined[:-1].all() and not recording.slow
    kept = len(recording)
    assert kept == 4000 - (first > 0)
    np.testing.assert_allclose(recording["i_a"], table["i_a"][-kept:], atol=1e-9)


def test_several_rows_a_period_without_a_rhythm_are_refused(tmp_path, nominal):
    table = oversampled(made(), 8)
    for name in ("d_a", "d_b", "d_c"):
        table[name] = np.interp(np.arange(32000), np.arange(0, 32000, 8), table[name][::8])
    recording = load_recording(write(tmp_path / "r.parquet", table), nominal)
    assert recording.fatal and "keep those at which the current was sampled" in recording.problems[0].message


def test_a_largest_value_between_two_rows_far_apart_is_no_limit():
    """The quantile is near none of the rows: the median of nothing was a warning on the user's terminal."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert limits_met._level(np.append(np.linspace(0.0, 1.0, 99), 100.0)) is None
