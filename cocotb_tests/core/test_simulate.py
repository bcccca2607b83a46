# SPDX-License-Identifier: BSD-3-Clause
"""`fluxproof simulate`: verdicts and exit status, margins against a simulation of the equations, the report."""

from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.slow import slowly
from fluxproof.checkout import DRIVES
from fluxproof.command import main
from fluxproof.cosim import golden_loop
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.sensor_edges import edges_of
from fluxproof.simulate import scene
from fluxproof.simulate.margins import current_loop, margins, speed_loop, turning_current_loop
from fluxproof.simulate.run import Run
from fluxproof.simulate.run import run as simulated_run
from fluxproof.simulate.session import simulate
from fluxproof.simulate.verdict import judge
from golden_model.board_registers import core_changes
from golden_model.drive import load
from golden_model.drive_keys import DriveError
from golden_model.io import fault_latch
from golden_model.registers import registers
from golden_model.supply import Supply
from golden_model.units import from_si

DRIVE = load(PAPER)


def changed(section, **values):
    """The paper's drive with other values in one section."""
    return dataclasses.replace(DRIVE, **{section: dataclasses.replace(getattr(DRIVE, section), **values)})


def run(tmp_path, capsys, path, *options):
    """(exit status, simulation.json, stdout, stderr) of the command."""
    status = main(["simulate", str(path), "--out", str(tmp_path / "out"), *options])
    out, err = capsys.readouterr()
    return status, json.loads((tmp_path / "out" / "simulation.json").read_text()), out, err


def edited(tmp_path, **changes):
    """The paper's drive file with other values of keys it has, or with keys put before one it has."""
    text = PAPER.read_text()
    for key, value in changes.items():
        text, count = re.subn(rf"^{key} = \S+", f"{key} = {value}", text, flags=re.MULTILINE)
        assert count == 1, key
    path = tmp_path / "drive.toml"
    path.write_text(text)
    return path


# ---------------------------------------------------------------- verdicts


def test_the_trims_of_a_commissioned_file_are_those_of_its_sensors():
    """Encoder and converters mounted as the file says: the step is that of a file without trims."""
    plain = simulated_run(DRIVE, registers(DRIVE), scene.current_step(DRIVE))
    trims = {"theta_offset_rad": 2.0, "position_reverse": True, "current_offset_code": (33000.0, 32000.0, 32768.0)}
    drive = changed("sensors", **trims, current_gain=(1.1, 0.9, 1.0), u_dc_offset_code=20.0, u_dc_gain=1.05)
    told = simulated_run(drive, registers(drive), scene.current_step(drive))
    for name, within in (("i_q", 0.05), ("i_d", 0.05), ("u_max", 0.5)):
        assert told[name][-200:].mean() == pytest.approx(plain[name][-200:].mean(), abs=within), name


LIMITS = {"overspeed": {"omega_trip": 1}, "encoder_lost": {"emf_min": 0, "emf_i": 0, "emf_w": 0, "emf_samples": 1}}


@pytest.mark.parametrize("fault", LIMITS)
def test_a_trip_that_no_code_of_a_sample_makes_is_one(fault):
    """It turns the gates off and is named, unless it is ignored."""
    given = registers(DRIVE)
    values = given.values._replace(**LIMITS[fault])
    told = simulated_run(DRIVE, given._replace(values=values), scene.current_step(DRIVE))
    assert told.faults == (fault,) and told.tripped_at is not None and abs(told["true_i_q"][-1]) < 0.1
    ignored = values._replace(fault_ignore=values.fault_ignore | 1 << fault_latch.NAMES.index(fault))
    assert simulated_run(DRIVE, given._replace(values=ignored), scene.current_step(DRIVE)).faults == ()


@pytest.mark.parametrize("given_s", [None, 0.02])
def test_a_stop_soon_after_a_start_is_no_runaway_with_hall_sensors(given_s):
    """Their speed is that of the sector before, which the start made slow: a braked shaft seems to speed up."""
    drive = load(DRIVES / "hub_36v.toml")
    drive = dataclasses.replace(drive, protection=dataclasses.replace(drive.protection, runaway_s=given_s))
    n, nothing = 1300, np.zeros(1300, np.int64)
    asked = from_si("omega_ref", -0.5 * drive.machine.pole_pairs * drive.machine.rated_speed_rad_s, drive)
    scenario = Scenario(
        omega_ref=np.where(np.arange(n) < 560, asked, 0), load=np.zeros(n), u_dc=np.full(n, 36.0), i_d_ref=nothing,
        i_q_ext=nothing, speed_mode=nothing + 1, enable=nothing + 1,
    )  # fmt: skip
    values = registers(drive).values._replace(**core_changes(drive))
    given = registers(drive)._replace(values=values)
    seen = golden_loop.simulate(drive, given, scenario, dead_time_s=drive.inverter.dead_time_s, edges=edges_of(drive))
    away = fault_latch.of_sample(seen.observed) >> fault_latch.NAMES.index("runaway") & 1
    assert away.any() == (given_s is not None)


# Physics that the simulation does not use
FOR_DIAGNOSE = "\n[plant.machine]\ncogging_order = 12\ncogging_amplitude_nm = 0.01\n[plant.timing]\ndelay_s = 1e-6\n"


@pytest.mark.parametrize(
    "name",
    ["servo_24v", "spindle_400v"]
    + [pytest.param(name, marks=pytest.mark.study) for name in ("hub_36v", "drone_24v", "paper001", "emrax228")],
)
def test_drives_work(tmp_path, capsys, name):
    """Exit status 0, no trip, margins of a sensible design; everything that is not modelled is said, [plant.*] too."""
    path = tmp_path / f"{name}.toml"
    path.write_text((DRIVES / f"{name}.toml").read_text() + FOR_DIAGNOSE)
    status, data, out, err = run(tmp_path, capsys, path)
    assert status == 0 and err == "" and data["status"] == "ok" and out.startswith(f"{name}.toml: ok")
    for margin in data["margins"].values():
        assert margin["stable"] and margin["phase_margin_deg"] > 45 and margin["gain_margin_db"] > 6
    speed, currents = data["figures"]["Speed"], data["figures"]["Currents"]
    assert 0 <= speed["speed_overshoot"]["value"] < 30 and 0 <= currents["current_overshoot"]["value"] < 20
    assert 0 < currents["ripple_peak_to_peak"]["value"] < load(DRIVES / f"{name}.toml").current_limit_a
    text = " ".join(data["not_modelled"])
    assert "heating" in text and "bus" in text and ("Hall" in text) == (name == "hub_36v")
    html = (tmp_path / "out" / "report.html").read_text()
    for key in ("machine.cogging_order", "machine.cogging_amplitude_nm", "timing.delay_s"):
        assert key in text and key in html
    assert html.count("<svg") == 8 and "http-equiv" in html and "What is not modelled" in html
    assert not re.search(r"<script|(?:src|href)=\"http", html)


def test_unstable_loop(tmp_path, capsys):
    """Three times the gain that the delay allows: a pole outside the circle, said in one line; status 1."""
    text = PAPER.read_text().replace("[control]\n", "[control]\ncurrent_kp_q_v_per_a = 250\n")
    path = tmp_path / "drive.toml"
    path.write_text(text)
    status, data, _, err = run(tmp_path, capsys, path)
    assert status == 1 and data["status"] == "unstable" and err.count("\n") == 1
    assert "current loop, q axis is unstable" in err and str(path) in err
    assert data["margins"]["current loop, q axis"]["pole"] > 1.0
    assert data["margins"]["current loop, d axis"]["stable"]


def test_trip(tmp_path, capsys):
    """A trip level that the accelerating drive reaches: named with its time, and the gates are off afterwards."""
    text = PAPER.read_text() + "\n[protection]\ncurrent_trip_a = 5.3\n"
    path = tmp_path / "drive.toml"
    path.write_text(text)
    status, data, _, err = run(tmp_path, capsys, path)
    assert status == 1 and data["status"] == "tripped"
    assert re.search(r"tripped by overcurrent at [\d.]+ ms, in the stage '", err)
    off = [data["figures"][group] for group in ("Speed", "Currents", "Voltage and power", "Heat")]
    told = ("load_dip", "speed_error_reversal", "i_q_tracking_reversal", "ripple_rms", "voltage_used_reversal")
    found = {name: value["value"] for group in off for name, value in group.items()}
    assert all(found[name] is None for name in (*told, "copper_loss_in_the_run")), "figures of gates that are off"
    assert found["current_overshoot"] is not None, "this run has not tripped"


def test_the_gates_come_on_a_turning_shaft_as_in_a_drive():
    """With a tenth of the inductance a period of zero voltage at rated speed is 1.5 times the trip."""
    drive = load(DRIVES / "servo_24v.toml")
    m = drive.machine
    low = dataclasses.replace(m, inductance_d_h=0.1 * m.inductance_d_h, inductance_q_h=0.1 * m.inductance_q_h)
    drive = dataclasses.replace(drive, machine=low)
    found = simulated_run(drive, registers(drive), scene.fast_current_step(drive))
    assert found.tripped_at is None, found.faults


def test_every_scene_that_trips_is_named():
    """The main scene first; what braking needs stands beside the trip of the bus alone."""
    drive = load(DRIVES / "servo_24v.toml")

    def tripped(stage, *faults):
        of = scene.Scene(None, (scene.Stage(stage, 0, 9, 0.0),))
        return Run(of, np.arange(9) * 1e-3, {}, np.zeros((9, 3)), 2, faults)

    runs = [tripped("reversal", "u_dc_high"), tripped("before", "overcurrent")]
    status, reason = judge(drive, {}, runs, back="it needs a resistor")
    assert status == "tripped"
    first, second = reason.split("; ")
    assert first.endswith("'reversal': it needs a resistor") and second.endswith("in the stage 'before'")


def fed(name, **keys):
    """A drive of docs/drives with another [supply], without a brake resistor."""
    drive = load(DRIVES / f"{name}.toml")
    protection = dataclasses.replace(drive.protection, brake_on_v=None)
    return dataclasses.replace(drive, supply=Supply(**keys), protection=protection)


@pytest.mark.parametrize("name", [slowly("servo_24v"), pytest.param("spindle_400v", marks=pytest.mark.study)])
def test_a_reversal_behind_a_diode_trips_and_says_what_it_needs(name):
    """1 mF behind a diode: named with joules, volts and a resistor; with this resistor, or a battery, it is ok."""
    drive = fed(name)
    assert drive.supply.source == "diode" and drive.supply.capacitance_f == 1e-3
    data, _ = simulate(drive, name)
    assert data["status"] == "tripped" and "u_dc_high" in data["reason"] and "'reversal'" in data["reason"]
    joule, volts, limit, ohm, on = (
        float(re.search(pattern, data["reason"])[1])
        for pattern in (
            r"feeds back ([\d.]+) J", r"mF to ([\d.]+) V", r"u_dc_max is ([\d.]+) V", r"at most ([\d.]+) ohm",
            r"from ([\d.]+) V on",
        )
    )  # fmt: skip
    bus = drive.inverter.dc_bus_v
    assert volts == pytest.approx(np.sqrt(bus**2 + 2.0 * joule / 1e-3), rel=3e-3) and bus < on < limit < volts
    resistor = dataclasses.replace(drive.supply, brake_resistor_ohm=0.95 * ohm)
    with_brake = dataclasses.replace(drive, protection=dataclasses.replace(drive.protection, brake_on_v=on))
    held, _ = simulate(dataclasses.replace(with_brake, supply=resistor), name)
    found = held["figures"]["Supply"]
    assert held["status"] == "ok" and found["bus_voltage_highest"]["value"] < limit
    assert 0.5 * joule < found["brake_resistor_energy"]["value"] < 1.1 * joule
    large = dataclasses.replace(resistor, brake_resistor_ohm=20.0 * ohm)
    weak, _ = simulate(dataclasses.replace(with_brake, supply=large), name)
    assert weak["status"] == "tripped" and "u_dc_high" in weak["reason"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, start, most, lasts", [("servo_24v", 27.0, 29.2, 0.88), ("spindle_400v", 600.0, 651.5, 11.3)]
)
def test_a_reversal_limited_by_the_bus_does_not_trip(name, start, most, lasts):
    """docs/faults.md: no resistor, 1 mF behind a diode, the braking current on its line; the shaft coasts to rest."""
    drive = fed(name)
    protection = dataclasses.replace(drive.protection, regen_start_v=start)
    data, _ = simulate(dataclasses.replace(drive, protection=protection), name)
    found = data["figures"]["Supply"]
    assert data["status"] == "ok" and start < found["bus_voltage_highest"]["value"] < most
    assert found["braking_limited_by_the_bus"]["value"] == pytest.approx(lasts, rel=0.02)


def test_a_battery_takes_back_what_braking_gives():
    data, _ = simulate(fed("servo_24v", source="battery"), "servo")
    found = data["figures"]["Supply"]
    assert data["status"] == "ok" and 24.0 < found["bus_voltage_highest"]["value"] < 25.0
    assert "brake_resistor_at_most" not in found and any("a battery of 24 V" in line for line in data["modelled"])


def test_few_samples_a_turn_show():
    """13 samples in a turn at rated speed: the single axes' margins say nothing of it, the turning loop's do."""
    drive = load(DRIVES / "servo_24v.toml")
    machine = dataclasses.replace(
        drive.machine, magnet_flux_wb=0.5e-3, rated_speed_rad_s=2400.0, resistance_ohm=0.1, inductance_d_h=0.06e-3,
        inductance_q_h=0.06e-3,
    )  # fmt: skip
    control = dataclasses.replace(drive.control, speed_bandwidth_hz=None)
    few = dataclasses.replace(
        drive, machine=machine, control=control, supply=Supply("battery"),
        encoder=dataclasses.replace(drive.encoder, counts=400, filter_s=None),
    )  # fmt: skip
    data, _ = simulate(few, "few samples")
    currents, margin = data["figures"]["Currents"], data["margins"]
    assert currents["current_overshoot"]["value"] < 12 < 20 < currents["current_overshoot_at_top_speed"]["value"]
    assert margin["current loop, q axis"]["phase_margin_deg"] > 60
    assert margin["current loop, top speed"]["phase_margin_deg"] < 35
    assert "current loop, top speed" in data["reason"]


def test_unsettled_speed():
    """A speed loop that hunts: its filter is a hundred times too slow."""
    data, _ = simulate(changed("control", speed_filter_hz=2.0, speed_bandwidth_hz=60.0), "hunting")
    assert data["status"] in ("unstable", "not_settled") and "speed" in data["reason"]


def test_torque_drive():
    """Without a speed loop the shaft is driven: steps of torque, no figures of speed."""
    data, pages = simulate(changed("control", speed_bandwidth_hz=None), "torque")
    assert data["status"] == "ok" and "Speed" not in data["figures"] and "speed loop" not in data["margins"]
    assert [s["name"] for s in data["scene"]][1] == "torque step" and data["reference_unit"] == "A"
    assert "torque reversal" in pages()


def test_mistakes(tmp_path, capsys):
    """Bad input: one line, status 2, no folder."""
    for path, words in (
        (tmp_path / "none.toml", ["cannot be read"]),
        (edited(tmp_path, speed_bandwidth_hz="0.05"), ["speed_bandwidth_hz", "PWM periods"]),
    ):
        assert main(["simulate", str(path), "--out", str(tmp_path / "out")]) == 2
        out, err = capsys.readouterr()
        assert out == "" and err.count("\n") == 1 and all(word in err for word in words)
        assert not (tmp_path / "out").exists()


# ---------------------------------------------------------------- margins


def stepped(drive, gain: float, samples: int = 3000) -> np.ndarray:
    """The error of a q current loop with ``gain`` times its gains, computed sample by sample without z."""
    gains = {row.name: row.represented for row in registers(drive).rows}
    kp, ki = gain * gains["kp_q"], gain * gains["ki_q"] * drive.sample_time_s
    m, t_s = drive.machine, drive.sample_time_s
    decay = np.exp(-m.resistance_ohm * t_s / m.inductance_q_h)
    i = integral = waiting = 0.0
    errors = []
    for _ in range(samples):
        error = 1.0 - i
        integral += ki * error
        u, waiting = waiting, kp * error + integral  # acts in the next period
        i = decay * i + (1.0 - decay) / m.resistance_ohm * u
        errors.append(error)
    return np.abs(errors)


def test_gain_margin_is_where_the_loop_becomes_unstable():
    margin = 10.0 ** (margins(current_loop(DRIVE, registers(DRIVE), "q")).gain_margin_db / 20.0)
    inside, outside = stepped(DRIVE, 0.99 * margin), stepped(DRIVE, 1.01 * margin)
    assert inside[-50:].max() < 1e-3 < 1.0 < outside[-50:].max()


def turned(drive, omega_m: float, gain: float, samples: int = 4000) -> np.ndarray:
    """The error of the turning loop with ``gain`` times its gains, computed in the stator's frame sample by sample."""
    gains = {row.name: row.represented for row in registers(drive).rows}
    kp, ki = (gain * np.mean([gains[f"{name}_d"], gains[f"{name}_q"]]) for name in ("kp", "ki"))
    m, t_s = drive.machine, drive.sample_time_s
    henry, phi = 0.5 * (m.inductance_d_h + m.inductance_q_h), m.pole_pairs * omega_m * t_s
    decay = np.exp(-m.resistance_ohm * t_s / henry)
    current = integral = waiting = 0.0 + 0.0j  # current and waiting voltage in the stator's frame
    errors = []
    for k in range(samples):
        seen = current * np.exp(-1j * phi * k)
        error = 1.0 - seen
        integral += ki * t_s * error
        rotational = gain * 1j * phi / t_s * (1.0 - phi**2 / 24.0) * henry * seen
        applied = (kp * error + integral + rotational) * np.exp(1j * phi * (k + 1.5))
        current = decay * current + (1.0 - decay) / m.resistance_ohm * waiting
        waiting = applied
        errors.append(error)
    return np.abs(errors)


def test_the_turning_loop_is_that_of_the_stators_frame():
    """The poles in the rotor's frame against the currents in the stator's: growth and decay of the error agree."""
    for speed in (0.0, 314.0, 800.0):
        loop = turning_current_loop(DRIVE, registers(DRIVE), speed)
        error = turned(DRIVE, speed, 1.0)
        rate = (error[1200] / error[200]) ** 1e-3
        assert rate == pytest.approx(loop.pole(), abs=2e-3) and loop.pole() < 1.0
    still = margins(turning_current_loop(DRIVE, registers(DRIVE), 0.0))
    single = [margins(current_loop(DRIVE, registers(DRIVE), axis)) for axis in "dq"]
    assert still.phase_margin_deg == pytest.approx(np.mean([m.phase_margin_deg for m in single]), abs=0.5)
    assert still.gain_margin_db == pytest.approx(np.mean([m.gain_margin_db for m in single]), abs=0.1)


def test_crossover_and_phase_are_those_of_the_continuous_loop():
    """kp = w_c*L, ki = w_c*R cancel the pole: crossover near w_c, phase -90 degrees less 1.5 samples of delay."""
    drive = changed("control", current_bandwidth_hz=200.0)
    got = margins(current_loop(drive, registers(drive), "d"))
    assert got.crossover_hz == pytest.approx(200.0, rel=0.01)
    assert got.phase_margin_deg == pytest.approx(90.0 - 360.0 * 200.0 * 1.5e-4, abs=1.5)
    speed = margins(speed_loop(drive, registers(drive)))
    assert speed.crossover_hz == pytest.approx(30.0, rel=0.05) and 50 < speed.phase_margin_deg < 79


def test_sampling_before_the_valley_costs_phase():
    got = [
        margins(current_loop(d, registers(d), "q")).phase_margin_deg
        for d in (changed("sampling", delay_s=-10e-6), DRIVE)
    ]
    crossover = margins(current_loop(DRIVE, registers(DRIVE), "q")).crossover_hz
    assert got[1] - got[0] == pytest.approx(360.0 * crossover * 10e-6, abs=0.05)


# ---------------------------------------------------------------- scene


def test_reach_fills_the_voltage_circle():
    for i_q in (0.0, 5.23):
        speed = scene.reach(DRIVE, i_q)
        assert scene.voltage(DRIVE, speed, i_q) == pytest.approx(scene.voltage_limit(DRIVE), rel=1e-9)
    assert scene.reach(changed("machine", resistance_ohm=1000.0), 5.23) == pytest.approx(0.0, abs=1e-6)


def test_speed_loop_needs_an_inertia():
    """Gains that are given need no inertia, the simulation does."""
    drive = changed("control", speed_bandwidth_hz=None, speed_kp_as_per_rad=0.01)
    drive = dataclasses.replace(drive, machine=dataclasses.replace(drive.machine, inertia_kgm2=0.0))
    with pytest.raises(DriveError, match="inertia_kgm2 = 0 .* above 0"):
        scene.main_scene(drive)


def test_heavy_drive_stays_at_low_speeds():
    """An inertia a hundred times as large: the scene says that it does not go to the top speed."""
    heavy = scene.main_scene(changed("machine", inertia_kgm2=0.16))
    assert heavy.shortened and not scene.main_scene(DRIVE).shortened
    assert heavy.stage("speed step").reference < 0.2 * scene.main_scene(DRIVE).stage("speed step").reference


def test_torque_with_hall_sensors():
    """At 100 rpm and 5 A the angle between the edges leaves little ripple; after a step at rest the shaft stands."""
    drive = load(DRIVES / "hub_36v.toml")
    settings = registers(drive)
    settings = settings._replace(values=settings.values._replace(**core_changes(drive)))
    load_nm = 5.0 * scene.torque_per_a(drive)

    def plant(rpm: float, load_nm: np.ndarray) -> dict[str, np.ndarray]:
        omega_m, n = rpm * 2.0 * np.pi / 60.0, len(load_nm)
        zeros, ones = np.zeros(n, np.int64), np.ones(n, np.int64)
        reference = ones * from_si("omega_ref", omega_m * drive.machine.pole_pairs, drive)
        given = Scenario(reference, load_nm, np.full(n, 36.0), zeros, zeros, ones, ones, omega_m=omega_m)
        edges = edges_of(drive)
        return golden_loop.simulate(drive, settings, given, dead_time_s=drive.inverter.dead_time_s, edges=edges).plant

    torque = plant(100.0, np.full(16_000, load_nm))["torque"][-4_000:]
    assert np.ptp(torque) < 0.03 * torque.mean()
    speed = plant(0.0, load_nm * (np.arange(28_000) > 1000))["omega_m"]  # the loop of 4 Hz settles for a second
    turns = np.sum(np.abs(speed[-8000:])) * drive.sample_time_s / (2.0 * np.pi)
    assert turns < 1.0 / (6 * drive.machine.pole_pairs)  # a sector
