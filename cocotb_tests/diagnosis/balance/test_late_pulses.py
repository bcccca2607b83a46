# SPDX-License-Identifier: BSD-3-Clause
"""Late pulses: the ripple that samples see, and how the delay is found when several look alike."""

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import recorded
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.late_pulses import high, instant, late_ripple, off_valley
from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.catalogue import CATALOGUE, delay, sampling_skew
from fluxproof.diagnosis.effects import current_error
from fluxproof.diagnosis.ground.nominal import load_nominal

STEPS = 20_000
NOMINAL = load_nominal(PAPER)
T = NOMINAL.sample_time_s


@pytest.mark.parametrize("at", [0.05, 0.3, 0.5, 0.62, 0.97])
def test_legs_are_high_as_centred_pulses_are(at):
    duty = np.array([0.0, 0.11, 0.5, 0.87, 1.0])
    time = (np.arange(STEPS) + 0.5) / STEPS
    is_high = np.abs(time[:, None] - 0.5) < 0.5 * duty
    passed = (is_high & (time[:, None] < at)).sum(axis=0) / STEPS
    assert high(duty, at) == pytest.approx(passed, abs=2.0 / STEPS)
    assert high(duty, at) + high(duty, 1.0 - at) == pytest.approx(duty)


def test_pulses_that_are_a_little_late_change_no_sample():
    """The samples stay in the zero vector between the pulses: without resistance the misfit does not change."""
    view = view_of(recorded(), NOMINAL)
    late = 0.02
    assert view.duties.max() < 1.0 - 2.0 * late and view.duties.min() > 0.0
    error = late_ripple(view, late)
    seen = current_error(view, error)["u"] + view.machine.resistance_ohm * 0.5 * (error[:, 1:] + error[:, :-1])
    mean = CATALOGUE["delay"].core(view)["tau"]["u"] * late * view.sample_time_s
    assert np.abs((seen + mean).mean(axis=1)).max() < 0.02 * np.abs(mean.mean(axis=1)).max()


@pytest.mark.parametrize("after", [0.2, -0.22])
def test_the_ripple_tells_when_the_currents_were_sampled(after):
    view = view_of(recorded(), NOMINAL)
    skew = CATALOGUE["sampling_skew"]
    view.memo["off_valley"] = after  # the chord ends there
    there = skew.corrected(view, {"tau": 0.0, "pulses": -after * view.sample_time_s})
    there.memo.pop("off_valley")
    seen = lambda view, x: current_error(view, off_valley(view, x))["u"]  # noqa: E731
    assert instant(there, "off_valley", sampling_skew.TRIED, sampling_skew.FINE, seen) == pytest.approx(after, abs=4e-3)


@pytest.mark.parametrize("after", [-0.02, 0.2])
def test_a_sampling_instant_of_the_drive_file_leaves_no_misfit(after, tmp_path):
    """The key was read and had no influence: a described skew was named again."""
    seconds, skew = after * T, CATALOGUE["sampling_skew"]
    drive = tmp_path / "drive.toml"
    drive.write_text(PAPER.read_text() + f"\n[plant.timing]\nsampling_skew_s = {seconds}\n")
    view = view_of(recorded(), NOMINAL).replace(catalogue=CATALOGUE)
    view.memo["off_valley"] = after
    late = skew.corrected(view, {"pulses": -seconds} if after > 0.0 else {"tau": -seconds})
    before, unsaid, said = (
        misfit(v)["u"].mean(axis=1) for v in (view, late, late.replace(nominal=load_nominal(drive)))
    )
    assert np.abs(unsaid - before).max() > 0.05
    assert np.abs(said - before).max() < 0.03 * np.abs(unsaid - before).max()


def test_currents_sampled_in_the_zero_vector_see_no_pulse():
    view = view_of(recorded(), NOMINAL)
    zero = 0.5 * (1.0 - view.duties.max())
    assert not off_valley(view, 0.99 * zero).any() and not off_valley(view, -0.99 * zero).any()
    assert off_valley(view, 1.1 * zero).any() and off_valley(view, -1.1 * zero).any()


@pytest.mark.parametrize("late", [0.3, 0.45, 0.7])
def test_the_ripple_tells_how_late_pulses_are(late):
    """Exactly while pulses begin or end, else as one that puts the samples in the same zero vector."""
    view = view_of(recorded(), NOMINAL)
    view.memo["late_pulses"] = late  # the chord ends there
    seconds = late * view.sample_time_s
    there = CATALOGUE["delay"].corrected(view, {"gates": -seconds})  # earlier, so that the recording is late
    there.memo.pop("late_pulses")
    seen = lambda view, x: current_error(view, late_ripple(view, x))["u"]  # noqa: E731
    found = instant(there, "late_pulses", delay.TRIED, delay.FINE, seen)
    legs = [high(view.duties, 1.0 - x) for x in (late, 0.5 * (late + found), found)]
    bend = np.sqrt(np.mean((legs[1] - 0.5 * (legs[0] + legs[2])) ** 2))  # none within a zero vector
    assert bend < 0.002, (found, late)
    assert late == 0.45 or abs(found - late) < 0.006
