"""Late pulses: the ripple that samples see, and how the delay is found when several look alike."""

import numpy as np
import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import recorded
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.late_pulses import beyond_mean, instant, ripple
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.effects.effect import current_error
from fluxproof.diagnosis.nominal import load_nominal

STEPS = 20_000


@pytest.mark.parametrize("at", [0.05, 0.3, 0.5, 0.62, 0.97])
def test_the_time_beyond_the_mean_is_that_of_centred_pulses(at):
    duty = np.array([0.0, 0.11, 0.5, 0.87, 1.0])
    time = (np.arange(STEPS) + 0.5) / STEPS
    high = np.abs(time[:, None] - 0.5) < 0.5 * duty
    passed = (high & (time[:, None] < at)).sum(axis=0) / STEPS
    assert beyond_mean(duty, at) == pytest.approx(passed - at * duty, abs=2.0 / STEPS)


def test_pulses_that_are_a_little_late_change_no_sample():
    """The samples stay in the zero vector between the pulses: without resistance the misfit does not change."""
    view = view_of(recorded(), load_nominal(PAPER))
    late = 0.02
    assert view.duties.max() < 1.0 - 2.0 * late and view.duties.min() > 0.0
    error = ripple(view, late)
    seen = current_error(view, error)["u"] + view.machine.resistance_ohm * 0.5 * (error[:, 1:] + error[:, :-1])
    mean = CATALOGUE["delay"].core(view)["tau"]["u"] * late * view.sample_time_s
    assert np.abs((seen + mean).mean(axis=1)).max() < 0.02 * np.abs(mean.mean(axis=1)).max()


@pytest.mark.parametrize("late", [0.3, 0.45, 0.7])
def test_the_ripple_tells_how_late_pulses_are(late):
    """Exactly while pulses begin or end, else as one that puts the samples in the same zero vector."""
    view = view_of(recorded(), load_nominal(PAPER))
    delay = CATALOGUE["delay"]
    view.memo["late_pulses"] = late  # the chord ends there
    seconds = late * view.sample_time_s
    there = delay.corrected(view, {"gates": -seconds})  # earlier, so that the recording is late
    there.memo.pop("late_pulses")
    found = instant(there, lambda error: current_error(there, error)["u"])
    legs = [beyond_mean(view.duties, 1.0 - x) for x in (late, 0.5 * (late + found), found)]
    bend = np.sqrt(np.mean((legs[1] - 0.5 * (legs[0] + legs[2])) ** 2))  # none within a zero vector
    assert bend < 0.002, (found, late)
    assert late == 0.45 or abs(found - late) < 0.006
