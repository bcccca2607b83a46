# SPDX-License-Identifier: BSD-3-Clause
"""[plant.*] of a drive file: every key comes back as written, a wrong one gives one line."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER, PLAIN
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.plant_keys import KEYS
from fluxproof.diagnosis.ground.result import NamedEffect
from fluxproof.diagnosis.improve.improve import plant_of, write_improved
from fluxproof.plant import flux_from_currents, machine_params
from golden_model import drive as drives
from golden_model.drive_keys import DriveError

GRID = np.linspace(-6.0, 6.0, 5)
SPECIAL = {
    "machine.emf_harmonics": [[6.0, 0.01, -0.02, 0.3], [12.0, 0.001, 0.0, 0.0]],
    "machine.flux_map": {
        "i_d_a": GRID,
        "i_q_a": GRID,
        "psi_d_wb": 0.165 + np.outer(0.016 * GRID, np.ones(5)),
        "psi_q_wb": np.outer(np.ones(5), 0.0158 * GRID - 1e-5 * GRID**3),
    },
    "machine.cogging_order": 24,
    "machine.shorted_phase": 2,
    "machine.pole_pairs": 5,
    "sensors.position_direction": -1,
    "sensors.seed": 3,
    "sensors.position_counts": 4096,
    "sensors.position_pole_pairs": 2,
}
THREE = ("phase_resistance_asymmetry", "current_gain_error", "current_offset_a")


def effect(plant, name="effect", **parameters):
    return NamedEffect(name, 0.99, parameters, 0.9, plant)


def some_value(key):
    """A legal value for a plant key that is not the nominal one."""
    if key in SPECIAL:
        return SPECIAL[key]
    if key.endswith("_bits"):
        return 14
    return [0.011, -0.007, 0.002] if key.split(".")[1] in THREE else 0.0123456


@pytest.mark.parametrize("key", list(KEYS))
def test_every_plant_key_comes_back(key, tmp_path):
    nominal = load_nominal(PAPER)
    path = write_improved(nominal, [effect({key: some_value(key)})], tmp_path / "improved.toml")
    drives.load(path)  # the core's tools still read it
    section, name = key.split(".")
    got, old = (
        getattr(getattr(plant_of(path), section), name),
        getattr(getattr(plant_of(nominal), section), name),
    )
    if key == "machine.flux_map":
        for field, grid in SPECIAL[key].items():
            np.testing.assert_allclose(getattr(got, field), grid, rtol=1e-8, atol=1e-9)
    elif key == "machine.emf_harmonics":
        np.testing.assert_allclose([dataclasses.astuple(h) for h in got], SPECIAL[key])
    else:
        np.testing.assert_allclose(got, some_value(key), rtol=1e-8)
        assert not np.array_equal(got, old)


def test_flux_map_is_used_by_the_plant(tmp_path):
    path = write_improved(load_nominal(PAPER), [effect({"machine.flux_map": SPECIAL["machine.flux_map"]})],
                          tmp_path / "improved.toml")  # fmt: skip
    psi = flux_from_currents(machine_params(plant_of(path).machine), 0.165, 3.0, -3.0)
    assert psi == pytest.approx((0.165 + 0.048, -0.0474 + 2.7e-4), abs=1e-8)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("[plant.machin]\nx = 1", "[plant.machin]"),
        ("[plant.machine]\nresistence_ohm = 1", "nearest known one is machine.resistance_ohm"),
        ("[plant.sensors]\ncurrent_offset_a = [1, 2]", "three values"),
        ("[plant.timing]\ndelay_s = nan", "finite"),
        ("[plant.machine.flux_map]\ni_d_a = [0, 1]", "plant"),
        ("plant = 3", "[plant.machine]"),
    ],
)
def test_a_wrong_plant_section_is_one_line(line, words, tmp_path):
    path = tmp_path / "drive.toml"
    path.write_text(f"{line}\n{PLAIN}" if line.startswith("plant") else f"{PLAIN}{line}\n")
    with pytest.raises(DriveError) as caught:
        plant_of(path)
    assert words in str(caught.value) and str(path) in str(caught.value) and "\n" not in str(caught.value)
