# SPDX-License-Identifier: BSD-3-Clause
"""Further recordings: where on the course of a drift they belong, how they are cut and what is held out."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import GRID, columns, recorded
from fluxproof.diagnosis.balance.blocks import view_of, views_of
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.physics import held_out
from fluxproof.diagnosis.plan.request import wants_cold

NOMINAL = load_nominal(PAPER)
COLD = NOMINAL.machine.temperature_ref_c


@pytest.fixture(scope="module")
def view():
    return view_of(recorded(), NOMINAL)


def warm(view, temperature):
    return view.replace(temp=np.broadcast_to(np.asarray(temperature, float), view.t.shape).copy())


def test_temperature_places_a_further_recording(view):
    course = lambda *parts: joined_views(list(parts)).course[len(view) :]  # noqa: E731
    heating = warm(view, np.linspace(COLD + 30.0, COLD + 80.0, len(view)))
    assert np.all(course(heating, view) >= 0.5)  # unknown temperature: time continues
    assert np.all(course(heating, warm(view, COLD + 1.0)) == 0.0)
    middle = course(heating, warm(view, COLD + 55.0))
    assert np.ptp(middle) == 0.0 and middle[0] == pytest.approx(0.25, abs=0.03)  # half of the first half
    assert wants_cold({"magnet_flux", "magnet_temperature"}, CATALOGUE, view)
    assert not wants_cold({"delay", "sampling_skew"}, CATALOGUE, view)
    assert not wants_cold({"magnet_temperature", "resistance_temperature"}, CATALOGUE, view)  # both would vanish


def test_cold_winding_does_not_place_a_drift(view):
    """Magnets warm by their own losses: a cold winding does not mean cold magnets."""
    cold = warm(view, COLD + 1.0)
    short = cold.take(view.run == 0).replace(span_s=0.1 * view.span_s)
    assert np.all(joined_views([cold, short]).course[len(view) :] == 1.0)
    assert not wants_cold({"magnet_flux", "magnet_temperature"}, CATALOGUE, cold)


def test_a_short_further_recording_joins_a_long_one():
    """Short dwells are cut into shorter blocks; both recordings must then be."""
    long, short = recorded(), columns(GRID)
    short = from_columns({name: values[:1600] for name, values in short.items()}, NOMINAL.sample_time_s)
    alone = [view_of(r, NOMINAL).u_dc.shape[1] for r in (long, short)]
    assert alone[0] > alone[1]
    joined = joined_views(views_of([long, short], NOMINAL))
    assert joined.u_dc.shape[1] == alone[1] and joined.t.max() > long["t"][-1]


def test_a_further_recording_of_one_point_is_fitted(view):
    """Every fourth dwell of each recording is held out, never the whole requested recording."""
    one = view.take(view.run == 0)
    for dwells in (8, 9, 10, 11):
        held = held_out([view.take(view.run < dwells), one])
        assert held.any() and len(one) > 1 and not held[-len(one) :].all()
