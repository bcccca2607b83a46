# SPDX-License-Identifier: BSD-3-Clause
"""The improved drive file: values survive a round trip, the core still reads it, trims cancel the sensor errors."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest

from cocotb_tests.core.test_registers import PAPER, each_drive, edited
from fluxproof.cosim.closed_loop import described_sensors
from fluxproof.cosim.scenarios import RPM, scenario, steps
from fluxproof.diagnosis.answer.improve import core_values, improved_toml, plant_of, write_improved
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.plant_keys import KEYS
from fluxproof.diagnosis.ground.recording import RecordingError, from_columns
from fluxproof.diagnosis.ground.result import Estimate, NamedEffect
from fluxproof.diagnosis.overlay.compare import closed_loop
from fluxproof.diagnosis.overlay.inputs import dq_currents
from fluxproof.diagnosis.replay.capture import capture
from fluxproof.diagnosis.replay.telemetry import read_dump, write_dump
from fluxproof.plant import (
    IMPOSED_SPEED,
    Harmonic,
    Inverter,
    current_code,
    flux_from_currents,
    machine_params,
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
    "machine.pole_pairs": 5,
    "sensors.position_direction": -1,
    "sensors.seed": 3,
    "sensors.position_counts": 4096,
}
THREE = ("phase_resistance_asymmetry", "current_gain_error", "current_offset_a")
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


@each_drive
def test_the_rest_of_the_file_stays(path, tmp_path):
    nominal = load_nominal(path)
    assert improved_toml(nominal, []) == path.read_text()
    r = nominal.machine.resistance_ohm
    found = effect(
        {"machine.resistance_ohm": 1.1 * r}, "resistance", resistance_ohm=Estimate(1.1 * r, 1e-3, "ohm")
    )
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
        (r, config, _), amp, volt = registers(drive), si_per_lsb("i_a", drive), si_per_lsb("u_dc", drive)
        i = [2.0, -1.5, -0.5]
        seen = current_conditioning.step(
            *(current_code(codes, k, i[k], 0) for k in range(3)),
            r.offset_a, r.offset_b, r.offset_c, r.gain_a, r.gain_b, r.gain_c, 0, config.adc_bits,
        )  # fmt: skip
        wanted = [
            x * (1.0 + error * g) + error * o
            for x, g, o in zip(i, (0.02, 0, -0.03), (0.1, -0.05, 0.02), strict=True)
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
        effect(
            {"sensors.current_gain_error": [0.01, 0.0, 0.0], "machine.emf_harmonics": [[6, 0.01, 0.0, 0.0]]}
        ),
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
    first = write_improved(
        load_nominal(PAPER), [effect({"machine.inductance_q_h": 0.4})], tmp_path / "a.toml"
    )
    second = write_improved(
        load_nominal(first), [effect({"machine.inductance_q_h": 0.017})], tmp_path / "b.toml"
    )
    assert plant_of(second).machine.inductance_q_h == drives.load(second).machine.inductance_q_h == 0.017


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
    path.write_text(f"{line}\n{MINIMAL}" if line.startswith("plant") else f"{MINIMAL}{line}\n")
    with pytest.raises(DriveError) as caught:
        plant_of(path)
    assert words in str(caught.value) and str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_unknown_plant_key_is_rejected():
    with pytest.raises(ValueError, match="nearest known one is machine.resistance_ohm"):
        improved_toml(load_nominal(PAPER), [effect({"machine.resistanc_ohm": 2.0})])


def recorded_drive(machine, inverter, sensors=None, seconds=1.2, noise=0.02):
    """A recording of the core on a drive that is not the nominal one: three loads at four speeds."""
    drive = drives.load(PAPER)
    register_set = registers(drive)
    changes = {0.0: 0.5, 0.1: 3.0, 0.2: 5.0}
    part = seconds / 4
    i_q = {k * part + t * part / 0.3: v * (-1 if k == 2 else 1) for k in range(4) for t, v in changes.items()}
    speeds = {0.0: 60, part: 700, 2 * part: -500, 3 * part: 1100}
    described = described_sensors(drive)
    sensors = dataclasses.replace(sensors or described, current_noise_a=noise)
    plan = scenario(
        drive, seconds, rpm={}, i_q=i_q, i_d={0.0: 0.0, part * 1.5: -2.0}, torque_mode=((0.0, 9.0),)
    )
    turning = (
        np.convolve(np.pad(steps(len(plan), speeds, 1e-4), 200, "edge"), np.full(401, 1 / 401), "valid") * RPM
    )
    plan = dataclasses.replace(plan, load=turning, omega_m=turning[0])
    samples, observed, _ = capture(drive, register_set, plan, machine, inverter, sensors, IMPOSED_SPEED)
    return samples, observed, drive, register_set


LEGS = Inverter(
    dead_time_s=2e-6, zero_current_a=0.1
)  # as the nominal drive has it, and what a leg does near zero


@pytest.fixture(scope="module")
def healthy(tmp_path_factory):
    """A recording of the nominal drive."""
    nominal = load_nominal(PAPER)
    samples, observed, drive, register_set = recorded_drive(plant_of(nominal).machine, LEGS)
    path = write_dump(tmp_path_factory.mktemp("dump") / "a.dump", drive, register_set, samples, observed)
    return nominal, from_columns(read_dump(path)[0], 1e-4)


EFFECTS = {
    "resistance": ({"resistance_ohm": 1.9}, LEGS, {}, {"machine.resistance_ohm": 1.9}),
    "magnet": ({"magnet_flux_wb": 0.155}, LEGS, {}, {"machine.magnet_flux_wb": 0.155}),
    "saturation": ({"saturation_q_per_a2": 0.008}, LEGS, {}, {"machine.saturation_q_per_a2": 0.008}),
    "dead_time": ({}, dataclasses.replace(LEGS, dead_time_s=4e-6), {}, {"inverter.dead_time_s": 4e-6}),
    "encoder": ({}, LEGS, {"position_offset_rad": 0.02}, {"sensors.position_offset_rad": 0.02}),
    "offset": ({}, LEGS, {"current_offset_a": (0.3, -0.2, 0.1)}, {"sensors.current_offset_a": [0.3, -0.2, 0.1]}),
    "gain": ({}, LEGS, {"current_gain_error": (0.1, 0.1, 0.1)}, {"sensors.current_gain_error": [0.1] * 3}),
    "bus": ({}, LEGS, {"u_dc_gain_error": 0.06}, {"sensors.u_dc_gain_error": 0.06}),
    "harmonics": (
        {"emf_harmonics": (Harmonic(6.0, 0.02, 0.03, 0.4),)}, LEGS, {},
        {"machine.emf_harmonics": [[6, 0.02, 0.03, 0.4]]},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", list(EFFECTS))
def test_improved_drive_reproduces_the_recording(name, healthy, tmp_path):
    """With the effect, the simulation is as close to the recording as that of the healthy drive to its own."""
    nominal, own = healthy
    machine, legs, sensors, plant = EFFECTS[name]
    made = recorded_drive(
        dataclasses.replace(plant_of(nominal).machine, **machine),
        legs,
        dataclasses.replace(plant_of(nominal).sensors, **sensors),
    )
    samples, observed, drive, register_set = made
    columns, _ = read_dump(write_dump(tmp_path / "a.dump", drive, register_set, samples, observed))
    found = [effect(plant), effect({"inverter.zero_current_a": 0.1})]
    improved = write_improved(nominal, found, tmp_path / "improved.toml")
    data = closed_loop(from_columns(columns, 1e-4), nominal, improved)
    floor = closed_loop(own, nominal)["rms_before"]
    before, after = (
        np.hypot(data[run]["u_d_ref"], data[run]["u_q_ref"]) for run in ("rms_before", "rms_after")
    )
    least = np.hypot(floor["u_d_ref"], floor["u_q_ref"])
    assert least < 2.0, "volts, on a drive of several hundred"
    # The core's own compensation of the dead time and its flux estimator answer to these two; the float loop has none.
    assert after < {"dead_time": 2.0, "harmonics": 1.4}.get(name, 1.2) * least
    assert before > 1.2 * after
    assert len(data["t"]) <= 4000 and data["rows"] <= 20000 and (np.diff(data["t"]) > 0).all()
    for run in ("recorded", "simulated_before", "simulated_after"):
        assert all(len(v) == len(data["t"]) and np.isfinite(v).all() for v in data[run].values())


def typical(data):
    return np.median(np.abs(data["simulated_before"]["u_q_ref"] - data["recorded"]["u_q_ref"]))


def test_overlay_with_missing_columns(healthy):
    """Without phases, references and angle, and as operating points of a slow log."""
    nominal, own = healthy
    whole = closed_loop(own, nominal)
    volts = {k: np.interp(own["t"], whole["t"], whole["recorded"][k]) for k in ("u_d_ref", "u_q_ref")}
    currents = dq_currents(own)
    columns = {
        "t": own["t"],
        "omega_e": own["omega_e"],
        "i_d": currents[:, 0],
        "i_q": currents[:, 1],
        **volts,
    }
    few = closed_loop(from_columns(columns, 1e-4), nominal)
    # Steps of the reference are smoothed away with the noise, so the typical difference counts.
    assert typical(few) < 1.5 and "simulated_after" not in few
    # One row each 10 ms, means as a slow logger gives them.
    slow = from_columns({k: v.reshape(-1, 100).mean(axis=1) for k, v in columns.items()}, 1e-2)
    slow.slow = True
    points = closed_loop(slow, nominal)
    assert len(points["t"]) == 66 and typical(points) < 3.0
    for missing in (("omega_e",), ("i_d",), ("u_d_ref",)):
        with pytest.raises(RecordingError):
            closed_loop(from_columns({k: v for k, v in columns.items() if k not in missing}, 1e-4), nominal)
    holed = {k: v.copy() for k, v in columns.items()}
    for name in ("omega_e", "i_q", "u_d_ref"):
        holed[name][1000:1003] = np.nan
    holed = closed_loop(from_columns(holed, 1e-4), nominal)
    assert np.isfinite(holed["simulated_before"]["u_q_ref"]).all() and holed["rms_before"]["u_q_ref"] < 6.0
    with pytest.raises(RecordingError, match="consecutive rows"):
        closed_loop(from_columns(columns, 2e-4), nominal)
