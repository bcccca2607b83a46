# SPDX-License-Identifier: BSD-3-Clause
"""Operating points, the course of a drift, and the current between samples."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import MACHINE, recorded
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.balance.misfit import bulge
from fluxproof.diagnosis.balance.operating_points import point_numbers
from fluxproof.diagnosis.balance.point_rows import block_points, whole_turns
from fluxproof.diagnosis.ground.nominal import load_nominal

NOMINAL = load_nominal(PAPER)


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


def test_the_mean_current_of_a_period_is_that_of_the_stator_frame(view):
    """The flux is linear in time while the rotor turns; here the current is integrated numerically."""
    m, omega, i = MACHINE, 900.0, -2.0 + 4.0j
    period = NOMINAL.sample_time_s
    theta = np.array([[-0.5, 0.5]]) * omega * period
    psi = m.inductance_d_h * i.real + m.magnet_flux_wb + 1j * m.inductance_q_h * i.imag
    begin, end = psi * np.exp(1j * theta[0])
    share = (np.arange(20000) + 0.5) / 20000
    turn = np.exp(1j * (theta[0, 0] + share * omega * period))
    linked = (begin + share * (end - begin)) / turn
    mean = np.mean(turn * ((linked.real - m.magnet_flux_wb) / m.inductance_d_h + 1j * linked.imag / m.inductance_q_h))
    made = view.replace(theta=theta, i=np.full((1, 2), i), omega=np.full((1, 2), omega))
    plain = i - bulge(made)[0, 0]
    assert abs(made.i_mid[0, 0] - bulge(made)[0, 0] - mean) < 0.02 * abs(plain - mean)


def test_short_further_recording_has_no_drift(view):
    short = view.take(view.run == 2).replace(span_s=0.1 * view.span_s)
    course = joined_views([view, short, short]).course
    assert np.all(course[len(view) :] == 1.0) and course[len(view) - 1] == pytest.approx(view.course[-1])
    as_long = joined_views([view, view]).course
    assert as_long[len(view) - 1] == pytest.approx(0.5 * view.course[-1]) and as_long[-1] > 0.9


def points_view(*points):
    """A stub view for counting points, with blocks at (speed, i_q) in per unit."""
    omega, i_q = 500.0 * np.array(points)[:, :1], NOMINAL.machine.rated_current_a * np.array(points)[:, 1:]
    return SimpleNamespace(machine=NOMINAL.machine, omega=np.repeat(omega, 3, axis=1), i=np.repeat(1j * i_q, 3, axis=1))


def test_operating_point_is_not_split():
    """Blocks scatter around their point; fixed bins would split some points."""
    for i_q in np.linspace(0.1, 0.9, 81):
        scattered = [(1.0, i_q + 0.004 * (-1) ** n) for n in range(6)]
        assert point_numbers(points_view(*scattered), 0.08).tolist() == [0] * 6
    apart = points_view((1.0, 0.2), (1.0, 0.6), (1.0, 0.21), (-1.0, 0.2))
    assert point_numbers(apart, 0.08).tolist() == [0, 1, 0, 2]


def test_points_of_fast_rows_cover_a_turn(view):
    """The loss of the inverter changes with the angle; a point is balanced with its mean over a turn."""
    points = block_points(recorded(), NOMINAL)
    turned = (points.end - points.first) * np.abs(points.omega) * NOMINAL.sample_time_s
    assert np.ptp(view.theta, axis=1).min() < 2.0 and 0 < len(points) < len(view)
    assert not np.isfinite(points.rest).any() and (turned > 0.8 * 2.0 * np.pi).all()


def test_blocks_of_one_dwell_are_a_turn_together():
    groups = whole_turns(np.array([0, 0, 0, 0, 0, 1, 1, 1, 2]), np.array([2.2] * 8 + [7.0]))
    assert [g.tolist() for g in groups] == [[0, 1, 2], [5, 6, 7], [8]]
    assert [g.tolist() for g in whole_turns(np.array([0, 1]), np.array([2.2, 2.2]))] == [[0], [1]]
