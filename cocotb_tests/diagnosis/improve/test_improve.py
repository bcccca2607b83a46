# SPDX-License-Identifier: BSD-3-Clause
"""The improved drive file: values survive a round trip, the core still reads it, trims cancel the sensor errors."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER, each_drive, edited
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.effects import plausible_range
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.result import Estimate, NamedEffect
from fluxproof.diagnosis.improve.improve import core_values, improved_toml, plant_of, to_write, write_improved
from fluxproof.diagnosis.improve.untrimmed import without_trims
from fluxproof.plant import (
    current_code,
    position_code,
    sensor_params,
    u_dc_code,
)
from golden_model import drive as drives
from golden_model.drive_keys import DriveError
from golden_model.fixed import wrap_s
from golden_model.io import current_conditioning, position, u_dc_conditioning
from golden_model.registers import registers
from golden_model.units import si_per_lsb

MINIMAL = """[machine]
pole_pairs = 4
resistance_ohm = 1.53  # cold
inductance_d_h = 0.016
inductance_q_h = 0.0158
magnet_flux_wb = 0.165
rated_current_a = 5.23
[inverter]
dc_bus_v = 563.0
pwm_frequency_hz = 10000.0
[columns]
current_a = "i_a"
"""


def effect(plant, name="effect", **parameters):
    return NamedEffect(name, 0.99, parameters, 0.9, plant)


@each_drive
def test_the_rest_of_the_file_stays(path, tmp_path):
    nominal = load_nominal(path)
    assert improved_toml(nominal, []) == path.read_text()
    r = nominal.machine.resistance_ohm
    found = effect({"machine.resistance_ohm": 1.1 * r}, "resistance", resistance_ohm=Estimate(1.1 * r, 1e-3, "ohm"))
    before, after = path.read_text().splitlines(), improved_toml(nominal, [found]).splitlines()
    changed = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert len(changed) == 1
    assert "resistance_ohm" in changed[0][0] and "was " in changed[0][1] and "0.001 ohm" in changed[0][1]
    improved = drives.load(write_improved(nominal, [found], tmp_path / "improved.toml"))
    assert improved.machine.resistance_ohm == pytest.approx(1.1 * r)
    values = {v.key: v.value for v in core_values(nominal, [found])}
    assert values["register r_s"] == registers(improved).values.r_s != registers(drives.load(path)).values.r_s


@pytest.mark.parametrize("reverse", ["false", "true"])
def test_trims_cancel_the_sensor_errors(reverse, tmp_path):
    """The hardware of the improved file, read with its registers, gives the true values."""
    text = PAPER.read_text().replace(
        "\n[sensors]\n",
        "\n[sensors]\ncurrent_offset_code = [33000, 32000, 32768]\ncurrent_gain = [-1.1, 0.9, 1.0]\n"
        f"theta_offset_rad = 0.7\nu_dc_gain = 0.95\nposition_reverse = {reverse}\n",
    )
    nominal = load_nominal(edited(tmp_path, "", text=text))
    found = [
        effect({"sensors.current_offset_a": [0.1, -0.05, 0.02], "sensors.position_offset_rad": 0.03}),
        effect({"sensors.current_gain_error": [0.02, 0.0, -0.03], "sensors.u_dc_gain_error": -0.04}),
    ]
    old_trims, improved = nominal, write_improved(nominal, found, tmp_path / "improved.toml")
    hardware = plant_of(improved).sensors
    codes = sensor_params(dataclasses.replace(hardware, current_noise_a=0.0))
    for path, error in ((improved, 0.0), (old_trims.path, 1.0)):
        drive = drives.load(path)
        r, config, *_ = registers(drive)
        amp, volt = si_per_lsb("i_a", drive), si_per_lsb("u_dc", drive)
        i = [2.0, -1.5, -0.5]
        seen = current_conditioning.step(
            *(current_code(codes, k, i[k], 0) for k in range(3)),
            r.offset_a, r.offset_b, r.offset_c, r.gain_a, r.gain_b, r.gain_c, 0, config.adc_bits,
        )  # fmt: skip
        wanted = [
            x * (1.0 + error * g) + error * o for x, g, o in zip(i, (0.02, 0, -0.03), (0.1, -0.05, 0.02), strict=True)
        ]
        np.testing.assert_allclose(np.array(seen[:3]) * amp, wanted, atol=6 * amp)
        u, _, _ = u_dc_conditioning.step(
            u_dc_code(codes, 500.0, 0), r.u_dc_offset, r.u_dc_gain, r.k_u_max, config.adc_bits
        )
        assert u * volt == pytest.approx(500.0 * (1.0 - 0.04 * error), abs=3 * volt)
        for theta_m in (0.3, 2.0, 5.0):
            code = position_code(codes, theta_m, 0)
            (angle,) = position.step(code, r.reverse, r.pole_pairs, r.theta_offset, config.position_bits)
            true = round((4 * (theta_m + 0.03 * error)) / (2 * math.pi) * 2**18)
            assert abs(wrap_s(angle - true, 18)) <= 10, (path, theta_m)


def test_identified_dead_time_does_not_change_the_gates(tmp_path):
    nominal = load_nominal(PAPER)
    found = [effect({"inverter.dead_time_s": 1e-6, "inverter.v_switch_v": -1e-3}, "dead_time")]
    path = write_improved(nominal, found, tmp_path / "improved.toml")
    before, after = (registers(drives.load(p)).values for p in (PAPER, path))
    assert after.dead_time == before.dead_time and after.min_pulse == before.min_pulse
    assert plant_of(path).inverter.dead_time_s == 1e-6
    assert plant_of(path).inverter.v_switch_v == 0.0, "a negative drop is noise and rejected by the plant"
    loss = {v.key: v.value for v in core_values(nominal, found)}["V_dead"]
    assert loss == pytest.approx(1e-6 * 1e4 * 563)
    more = core_values(nominal, [effect({"inverter.dead_time_s": 4e-6}, "dead_time")])
    assert {v.key: v.value for v in more}["[control] v_dead_limit_v"] == pytest.approx(3 * 4e-2 * 563 + 3)


def test_values_outside_the_core_formats_go_to_the_plant(tmp_path):
    """Ten times the inductance does not fit the core's flux format."""
    nominal = load_nominal(PAPER)
    found = [effect({"machine.inductance_q_h": 0.4, "machine.resistance_ohm": 1.6})]
    path = write_improved(nominal, found, tmp_path / "improved.toml")
    drive, plant = drives.load(path), plant_of(path)
    registers(drive)
    assert drive.machine.inductance_q_h == 15.81e-3 and drive.machine.resistance_ohm == 1.6
    assert plant.machine.inductance_q_h == 0.4 and plant.machine.resistance_ohm == 1.6


def test_sensors_that_are_finer_than_the_core_takes_are_described(tmp_path):
    """A 23-bit encoder is usual; only the core's own drive file has its formats' limits."""
    path = tmp_path / "fine.toml"
    text = PAPER.read_text()
    path.write_text(re.sub(r"position_bits = \d+", "position_bits = 23", text))
    assert path.read_text() != text
    nominal = load_nominal(path)
    assert nominal.sensors.position_bits == 23
    assert load_nominal(write_improved(nominal, [], tmp_path / "improved.toml")).sensors.position_bits == 23
    with pytest.raises(DriveError, match="position_bits = 23 is out of range: allowed is 8 up to 18"):
        drives.load(path)


def test_a_drive_without_the_core(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(MINIMAL)
    nominal = load_nominal(path)
    found = [
        effect({"machine.resistance_ohm": 1.7, "inverter.dead_time_s": 2e-6}),
        effect({"sensors.current_gain_error": [0.01, 0.0, 0.0], "machine.emf_harmonics": [[6, 0.01, 0.0, 0.0]]}),
        effect(
            {
                "sensors.current_gain_error": [0.02, 0.02, 0.02],
                "machine.emf_harmonics": [[12, 0.01, 0.0, 0.0]],
            }
        ),
    ]
    improved = write_improved(nominal, found, tmp_path / "improved.toml")
    assert load_nominal(improved).columns == {"current_a": "i_a"}
    assert "resistance_ohm = 1.7 # was 1.53; effect; cold" in improved.read_text()
    plant = plant_of(improved)
    assert plant.machine.resistance_ohm == 1.7 and plant.inverter.dead_time_s == 2e-6
    np.testing.assert_allclose(plant.sensors.current_gain_error, [1.01 * 1.02 - 1, 0.02, 0.02])
    assert [h.order for h in plant.machine.emf_harmonics] == [6.0, 12.0]
    values = core_values(nominal, found)
    assert not [v for v in values if v.key.startswith("register")]
    assert {"[machine] resistance_ohm", "V_dead"} <= {v.key for v in values}
    # The same from arrays, without a file behind it.
    bare = dataclasses.replace(nominal, path="")
    again = tmp_path / "again.toml"
    again.write_text(improved_toml(bare, found))
    assert plant_of(again) == plant


def test_an_improved_drive_can_be_improved(tmp_path):
    first = write_improved(load_nominal(PAPER), [effect({"machine.inductance_q_h": 0.4})], tmp_path / "a.toml")
    second = write_improved(load_nominal(first), [effect({"machine.inductance_q_h": 0.017})], tmp_path / "b.toml")
    assert plant_of(second).machine.inductance_q_h == drives.load(second).machine.inductance_q_h == 0.017


def test_unknown_plant_key_is_rejected():
    with pytest.raises(ValueError, match="nearest known one is machine.resistance_ohm"):
        improved_toml(load_nominal(PAPER), [effect({"machine.resistanc_ohm": 2.0})])


@pytest.mark.parametrize("name", sorted(n for n, e in CATALOGUE.items() if e.plausible))
def test_an_implausible_size_is_not_written(name):
    """A scale of the currents of -30 % was noted as implausible and written; drawn within and beyond every range."""
    nominal, rng = load_nominal(PAPER), np.random.default_rng(len(name))
    for key, limits in CATALOGUE[name].plausible.items():
        low, high = plausible_range(limits, nominal)
        width = high - low
        for share in rng.uniform(-1.0, 2.0, 20).tolist():
            within = 0.0 <= share <= 1.0
            found = NamedEffect(name, 0.99, {key: Estimate(low + share * width, 1e-6 * width, "1")}, 0.9)
            assert bool(to_write(nominal, [found], CATALOGUE)) is within


@pytest.mark.parametrize("left, twice", [(0.0347, True), (0.012, False), (-0.0334, False)])
def test_a_trim_is_not_applied_twice(left, twice):
    """A recording without registers has the error that a trim of the file cancels: it was made without the trim."""
    nominal = load_nominal(PAPER)
    sensors = dataclasses.replace(nominal.sensors, theta_offset_rad=-0.0334, current_gain=(1.0, 0.98, 1.0))
    nominal = dataclasses.replace(nominal, sensors=sensors, path="")
    found = [effect({"sensors.position_offset_rad": left / nominal.machine.pole_pairs})]
    used, lacking = without_trims(nominal, found)
    assert lacking == ["theta_offset_rad"] * twice and used.sensors.current_gain == sensors.current_gain
    trims = [v.value for v in core_values(used, found) if v.key == "[sensors] theta_offset_rad"]
    assert trims == [pytest.approx(-left - (0.0 if twice else 0.0334))]
