# SPDX-License-Identifier: BSD-3-Clause
"""Magnets that lose flux at once in the middle of a recording, and a change for which there is no effect."""

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import GRID, MACHINE, columns
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.joined import joined_views
from fluxproof.diagnosis.balance.operating_points import instant_of_change, log_prior
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns

NOMINAL = load_nominal(PAPER)
LOST = 0.1  # of the magnet flux
PAUSE_S = 0.5


@pytest.fixture(scope="module")
def halves():
    """Columns of the same operating points with all of the flux and, after a pause, with what is left of it."""
    first = columns(GRID)
    second = dict(columns(GRID, (("magnet_flux_wb", (1.0 - LOST) * MACHINE.magnet_flux_wb),)))
    second["t"] = second["t"] + first["t"][-1] + PAUSE_S
    return first, second


@pytest.fixture(scope="module")
def recording(halves):
    first, second = halves
    table = {name: np.concatenate([first[name], second[name]]) for name in first}
    return from_columns(table, NOMINAL.sample_time_s)


def test_the_lost_flux_and_its_instant_are_named(halves, recording):
    answer = diagnose(recording, NOMINAL)
    assert answer.verdict == "explained", answer.sentence
    (effect,) = answer.effects
    step = effect.parameters["magnet_flux_step_wb"]
    assert effect.name == "demagnetisation"
    assert step.value == pytest.approx(-LOST * MACHINE.magnet_flux_wb, rel=0.02)
    begins = halves[1]["t"][0]
    assert begins <= instant_of_change(view_of(recording, NOMINAL)) < begins + 0.2
    assert any("loss occurred just before" in note for note in answer.notes)


@pytest.mark.slow
def test_without_these_effects_no_constant_one_takes_their_place(recording, monkeypatch):
    """The mean of both halves looks like a wrong magnet flux, or like a bus gain: neither is there."""
    for name in ("demagnetisation", "magnet_temperature"):
        monkeypatch.delitem(CATALOGUE, name)
    answer = diagnose(recording, NOMINAL)
    assert answer.verdict == "unexplained" and not answer.effects, answer.sentence
    assert answer.remainder[0].signal == "u_dq" and answer.remainder[0].order == 0.0


def test_two_recordings_have_no_instant_between_them(halves):
    """What happened in between may have been slow."""
    views = [view_of(from_columns(dict(half), NOMINAL.sample_time_s), NOMINAL) for half in halves]
    both = joined_views(views)
    instant = instant_of_change(both)
    assert instant is not None and instant not in (views[0].span_s + views[1].t[0], both.t[0])
    assert log_prior(both) == pytest.approx(-np.log(2 * len(GRID)), abs=0.3)


def test_points_that_do_not_repeat_have_no_instant(recording):
    view = view_of(recording, NOMINAL)
    firsts = np.unique(view.run, return_index=True)[1][: len(GRID)]
    once = view.take(firsts).replace(memo={})
    assert instant_of_change(once) is None and log_prior(once) == 0.0
    assert not CATALOGUE["demagnetisation"].core_psi(once)["step"].any()
