# SPDX-License-Identifier: BSD-3-Clause
"""Logs of speed-controlled drives with a free shaft, from simulators that are not the project's: named as they are."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cocotb_tests.support.slow import slowly
from fluxproof import diagnose
from fluxproof.checkout import recordings
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns
from studies.blind.strangers import cases, rows
from studies.blind.strangers.drives import DRIVES
from studies.blind.strangers.faults import truth_of
from studies.blind.strangers.sensors import Sensors

# In `make test` the one of which only the shaft, whose torque nobody measured, shows the effect.
FIRST = ("friction_36v",)
OTHERS = (
    "current_offset_563v", "dead_time_36v", "dead_time_ipm", "encoder_offset_36v", "healthy_36v", "healthy_563v",
    "healthy_ipm", "magnet_flux_563v", "magnet_flux_ipm", "saturation_563v", "saturation_ipm",
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


@pytest.mark.slow
@pytest.mark.parametrize("draw", range(4))
def test_noise_that_goes_round_a_fast_current_loop_names_nothing(draw, tmp_path):
    """Converter noise returns in the recorded voltage, and was told as a delay, a skew and an iron loss: 4 of 8 draws.

    A joint of 24 V in gym-electric-motor, 12 bits, current loop of 400 Hz, speed loop; the winding has 25 % more.
    """
    drive = next(d for d in DRIVES if d.name == "24 V joint")
    truth = truth_of(drive)
    truth.r *= 1.25
    speeds = 2.0 * np.pi * 0.07 / drive.period * 0.5 * np.array([0.15, -0.2, 0.6, -0.7, 1.0, -0.9])
    load = 1.5 * drive.pole_pairs * drive.psi * drive.current * np.array([0.6, -0.5, 0.2, 0.0])
    plan = rows.Plan(
        [(w, 0.0, 0.0, m) for w in speeds for m in load], int(0.11 / drive.period), True, torque=False,
        temperature=False, switching=False, current_bits=12, angle_bits=14, bandwidth=2.0 * np.pi * 400.0,
    )  # fmt: skip
    columns = rows.record(*cases.parts("gem"), Sensors, drive, truth, plan, np.random.default_rng([77, draw]))
    (tmp_path / "drive.toml").write_text(drive.toml())
    answer = diagnose(from_columns(columns, drive.period), load_nominal(tmp_path / "drive.toml"))
    assert [e.name for e in answer.effects] == ["resistance"] and not answer.ambiguity, answer.sentence
    assert answer.effects[0].parameters["resistance_ohm"].value == pytest.approx(truth.r, rel=0.01)
