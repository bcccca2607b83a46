"""Logs of speed-controlled drives with a free shaft, from a simulator that is not the project's: named as they are."""

from __future__ import annotations

import json

import pytest

from cocotb_tests.support.slow import slowly
from fluxproof import diagnose
from fluxproof.checkout import recordings

# In `make test` the healthy drive and the one of which only the shaft, whose torque nobody measured, shows the effect.
FIRST = ("healthy_36v", "friction_36v")
OTHERS = (
    "current_offset_563v", "dead_time_36v", "dead_time_ipm", "encoder_offset_36v", "healthy_563v", "healthy_ipm",
    "magnet_flux_563v", "magnet_flux_ipm", "saturation_563v", "saturation_ipm",
)  # fmt: skip


@pytest.mark.parametrize("name", [*FIRST, *map(slowly, OTHERS)])
def test_closed_loop(name):
    folder = recordings() / "closed_loop"
    if not folder.is_dir():
        pytest.skip(f"{folder} is missing; FLUXPROOF_RECORDINGS names the folder above it")
    truth = json.loads((folder / "truth.json").read_text())
    answer = diagnose(folder / f"{name}.parquet", folder / f"{name}.toml")
    assert [e.name for e in answer.effects] == truth[name] and not answer.ambiguity, answer.sentence
    assert answer.verdict == ("explained" if truth[name] else "no_mismatch")
