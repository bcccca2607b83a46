# SPDX-License-Identifier: BSD-3-Clause
"""Angle sensors that fail in steps: a slip, lost counts, uneven sectors, each with its size; healthy ones do not."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.recordings.from_equations import T, made, nominal_of
from fluxproof.diagnosis.checks import angle_course, check_recording
from fluxproof.diagnosis.ground.recording import from_columns

DEGREE, PAIRS = np.pi / 180.0, 4
SLIP_AT = 3300
EDGES = np.array([6.0, -5.0, 2.0, 7.0, -8.0, -2.0]) * DEGREE
FORMS = ("phases", "dq")


@pytest.fixture(scope="module")
def nominal(tmp_path_factory):
    return nominal_of(tmp_path_factory.mktemp("drive"))


def checked(nominal, error, form="phases", **drive):
    """The checked recording whose angle is wrong by error(angle from the first row on (n,)) [rad]."""
    columns = made(n=6000, speed=500.0, **drive)
    theta = np.unwrap(columns["theta_e"])
    wrong = error(theta - theta[0])
    columns["theta_e"] = np.mod(theta + wrong, 2 * np.pi)
    if form == "dq":
        columns = in_dq(columns, nominal)
    recording = from_columns(columns, T)
    check_recording(recording, nominal)
    left = np.angle(np.exp(1j * (recording["theta_e"] - theta)))
    return [p for p in recording.problems if p.code.startswith("angle_")], left, recording


def in_dq(columns, nominal):
    """The same as the control logs it, seen from the wrong angle."""
    delay, out = (
        nominal.control.duty_applied_after_samples,
        {n: columns[n] for n in ("t", "theta_e", "omega_e", "u_dc")},
    )
    axes = np.exp(2j * np.pi / 3 * np.arange(3))
    turn = np.exp(1j * columns["theta_e"])
    i = 2 / 3 * np.stack([columns[f"i_{x}"] for x in "abc"], axis=1) @ axes / turn
    u = 2 / 3 * np.stack([columns[f"d_{x}"] for x in "abc"], axis=1) @ axes * columns["u_dc"] / turn
    u = u * np.exp(-1j * columns["omega_e"] * T * (delay + 0.5))
    return out | {"i_d": i.real, "i_q": i.imag, "u_d_ref": u.real, "u_q_ref": u.imag}


def uneven(angle):
    return np.interp(np.mod(angle, 2 * np.pi), np.arange(7) * np.pi / 3, np.append(EDGES, EDGES[0]))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("degrees", [6.0, -20.0])
def test_a_slip_is_told_with_its_instant_and_size(nominal, degrees, form):
    slip = np.where(np.arange(6000) >= SLIP_AT, degrees * DEGREE, 0.0)
    (found,), left, recording = checked(nominal, lambda angle: slip, form)
    assert (found.code, found.row, found.action) == ("angle_step", SLIP_AT, "corrected")
    assert f"at {SLIP_AT * T:g} s" in found.message
    size = float(found.message.split("jumps by ")[1].split()[0])
    assert size == pytest.approx(degrees, abs=0.3)
    assert np.abs(left - np.median(left))[recording.usable].max() < 0.4 * DEGREE


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("degrees", [1.0, -0.4])
def test_counts_that_are_lost_are_told_by_turn(nominal, degrees, form):
    """The shaft makes eleven turns."""
    (found,), left, _ = checked(nominal, lambda angle: degrees * DEGREE * angle / (2 * np.pi * PAIRS), form)
    assert found.code == "angle_drift" and ("gains" in found.message) == (degrees > 0)
    assert float(found.message.split()[3]) == pytest.approx(abs(degrees), rel=0.1)
    assert np.ptp(left) < 0.15 * abs(degrees) * 11 * DEGREE


@pytest.mark.parametrize("form", FORMS)
def test_uneven_sectors_are_told_and_taken_away(nominal, form):
    (found,), left, _ = checked(nominal, uneven, form)
    assert found.code == "angle_uneven"
    assert np.std(left) < 0.25 * np.std(uneven(np.linspace(0, 40, 4000)))


HEALTHY = {
    "as it is": {}, "an offset of the angle": {"encoder": 0.3}, "gains": {"gain": (1.03, 0.98, 1.0)},
    "an offset of a current": {"offset": 0.2}, "a bus sensor": {"u_dc_gain": 0.9},
}  # fmt: skip


@pytest.mark.parametrize("drive", HEALTHY)
def test_other_causes_are_no_failure_of_the_angle(nominal, drive):
    found, _, _ = checked(nominal, np.zeros_like, **HEALTHY[drive])
    assert found == []


def test_a_lost_sample_is_no_slip(nominal):
    """The angle jumps, and the voltages with it."""
    columns = {name: np.delete(values, slice(3000, 3003)) for name, values in made(n=6000, speed=500.0).items()}
    columns["t"] = np.arange(len(columns["t"])) * T
    recording = from_columns(columns, T)
    check_recording(recording, nominal)
    assert [p.code for p in recording.problems] == ["dropped"]


def test_an_eccentric_encoder_is_left_to_the_catalogue(nominal):
    found, _, _ = checked(nominal, lambda angle: 5.0 * DEGREE * np.sin(angle / PAIRS))
    assert found == []


@pytest.mark.parametrize("rising", [0.5, 0.8])
def test_an_eccentric_encoder_that_leans_loses_no_counts(nominal, rising):
    """A wave that rises slowly and falls fast: the median row of a turn loses 2 degrees, the whole turn nothing."""
    wave = lambda angle: np.interp(np.mod(angle / (2 * np.pi * PAIRS), 1.0), [0.0, rising, 1.0], [-1.0, 1.0, -1.0])  # noqa: E731
    found, _, _ = checked(nominal, lambda angle: 1.0 * DEGREE * wave(angle))
    assert found == []


def test_a_course_between_bins_is_that_of_their_means():
    """Means over a bin weaken an order, as a line between them does: a fifth of the fifth order would stay."""
    bins, fine = angle_course.BINS, 40
    theta = (np.arange(bins * fine) + 0.5) * 2 * np.pi / (bins * fine)
    course = 0.1 * np.cos(theta + 0.3) - 0.05 * np.sin(4 * theta) + 0.05 * np.cos(5 * theta + 1.0)
    waves = np.fft.rfft(course.reshape(bins, fine).mean(axis=1))
    np.testing.assert_allclose(angle_course._between(waves, theta), course, atol=1e-4)
