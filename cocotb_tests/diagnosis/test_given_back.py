"""Every effect of the catalogue: found in a recording, written into drive_improved.toml, and gone with that drive."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.effect_recordings import NOMINAL, with_effect
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.answer.sizes import Sizes
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.improve import write_improved

MOST_LEFT = 0.05  # of the power of the misfit above its noise floor


def sizes(answer):
    """Sizes of the misfit of the drive as described, over all blocks."""
    setup = answer.search.setup
    return Sizes(setup, setup.cells.y, setup.cells.y, np.ones(len(setup.view), bool), True)


@pytest.mark.parametrize("name", CATALOGUE)
def test_the_improved_drive_leaves_no_misfit(name, tmp_path):
    effect = CATALOGUE[name]
    if effect.stays:
        pytest.skip(effect.stays)
    recording = with_effect(effect)
    answer = diagnose(recording, NOMINAL)
    assert name in {e.name for e in answer.effects}, (answer.sentence, answer.notes)
    improved = write_improved(NOMINAL, answer.effects, tmp_path / "drive_improved.toml")
    again = diagnose(recording, improved)
    before, after = sizes(answer), sizes(again)
    channel = before.primary()
    left = after.channels[channel].excess / max(before.channels[channel].excess, 1e-12)
    assert again.verdict == "no_mismatch" or left < MOST_LEFT, (left, again.sentence)
