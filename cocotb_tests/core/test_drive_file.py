# SPDX-License-Identifier: BSD-3-Clause
"""Every error in drive.toml or on the command line gives one clear line; the table and the JSON file."""

import codecs
import dataclasses
import json
import os
import re
import subprocess
import sys

import pytest

from cocotb_tests.support.drives import DRIVE_FILES, PAPER, check_message, each_drive, edited
from fluxproof.checkout import ROOT
from fluxproof.command import main
from golden_model.board_registers import board_set, has_board
from golden_model.drive import Drive, load, with_carrier
from golden_model.drive_file import read_text
from golden_model.drive_keys import DriveError
from golden_model.fluxproof import REGISTERS
from golden_model.registers import registers

SERVO = next(path for path in DRIVE_FILES if path.stem == "servo_24v")
WRONG = {  # section, line, what the message must contain besides the file's name
    "unknown key": (
        "machine",
        "resistence_ohm = 1",
        "[machine] unknown key resistence_ohm",
        "resistance_ohm",
    ),
    "wrong type": ("machine", 'pole_pairs = "4"', "[machine] pole_pairs", "string", "whole number"),
    "fraction": ("machine", "pole_pairs = 4.5", "[machine] pole_pairs = 4.5", "whole number", "1 up to 63"),
    "boolean": ("machine", "resistance_ohm = true", "[machine] resistance_ohm = true", "boolean"),
    "not boolean": ("sensors", "position_reverse = 1", "[sensors] position_reverse = 1", "true or false"),
    "short list": ("sensors", "current_gain = [1, 2]", "[sensors] current_gain", "a list of 3"),
    "no list": ("sensors", "current_gain = 1", "[sensors] current_gain", "a list of 3"),
    "list of words": ("sensors", 'current_gain = [1, 1, "x"]', "[sensors] current_gain = 'x'", "number"),
    "negative": ("machine", "resistance_ohm = -1", "[machine] resistance_ohm = -1", "1e-07 up to 1000000 ohm"),
    "not a number": ("machine", "resistance_ohm = nan", "[machine] resistance_ohm = nan", "1e-07 up to 1000000 ohm"),
    "infinite": ("machine", "resistance_ohm = inf", "[machine] resistance_ohm = inf", "1e-07 up to 1000000 ohm"),
    "huge": ("machine", f"pole_pairs = {10**400}", "[machine] pole_pairs", "1 up to 63"),
    "huge real": ("machine", f"resistance_ohm = {10**400}", "[machine] resistance_ohm", "up to 1000000 ohm"),
    "extreme": ("machine", "rated_speed_rad_s = 1e-300", "rated_speed_rad_s = 1e-300", "1e-06 up to 1000000 rad/s"),
    "huge inertia": ("machine", "inertia_kgm2 = 1e300", "[machine] inertia_kgm2 = 1e+300", "0 up to 1e+10 kg m2"),
    "huge gain": ("control", "current_kp_d_v_per_a = 1e308", "current_kp_d_v_per_a = 1e+308", "up to 1000000000 V/A"),
    "no gain": ("sensors", "current_gain = [1, 0, 1]", "current_gain = 0 is", "-2 up to -0.5 or 0.5 up to 2"),
    "no bus gain": ("sensors", "u_dc_gain = 0", "[sensors] u_dc_gain = 0 is", "0.5 up to 2"),
    "negative bus": ("sensors", "u_dc_gain = -1", "[sensors] u_dc_gain = -1 is", "0.5 up to 2"),
    "tiny gain": ("sensors", "current_gain = [1, 1, 1e-3]", "current_gain = 0.001 is", "-0.5 or 0.5"),
    "two extremes": ("control", "speed_kp_as_per_rad = 1e9", "register speed_kp", "out of range"),
    "many bits": ("machine", f"pole_pairs = 0x{'f' * 100000}", "= a whole number of 400000 bits", "1 up to 63"),
    "many digits": ("machine", f"pole_pairs = {'9' * 10000}", "not TOML: a number of too many digits"),
    "long key": ("machine", f"{'x' * 100000} = 1", "[machine] unknown key 'xxx", "nearest"),
    "date": ("machine", "resistance_ohm = 2020-01-01", "[machine] resistance_ohm", "number"),
    "adc bits": ("sensors", "adc_bits = 18", "[sensors] adc_bits = 18", "12 up to 16"),
    "reserve": ("control", "voltage_reserve = 1", "[control] voltage_reserve = 1", "0 up to 0.99"),
    "zero inertia": (
        "machine",
        "inertia_kgm2 = 0",
        "[machine] inertia_kgm2 = 0",
        "above 0",
        "speed_bandwidth_hz",
    ),
    "no magnet": ("machine", "magnet_flux_wb = 0", "[machine] magnet_flux_wb = 0", "speed_bandwidth_hz"),
    "sample time": (
        "control",
        "sample_time_s = 5e-5",
        "[control] sample_time_s = 5e-05",
        "0.0001 s",
        "pwm_freq",
    ),
    "clock": (
        "core",
        "clock_hz = 200.001e6",
        "[core] clock_hz",
        "[inverter] pwm_frequency_hz",
        "whole number",
    ),
    "few samples": (
        "machine",
        "rated_speed_rad_s = 2e3",
        "rated_speed_rad_s = 2000 with [inverter] pwm_frequency_hz = 10000 make 7.854 samples in an electrical turn",
        "above 12.57",
        "above 16000 Hz or [core] updates_per_period = 2",
    ),
    "too few for two updates": ("machine", "rated_speed_rad_s = 4e3", "make 3.927 samples", "above 32000 Hz\n"),
    "slow clock": ("core", "clock_hz = 1e5", "[core] clock_hz", "above 160000"),
    "tiny pwm": ("core", "clock_hz = 1e12", "[core] clock_hz", "8 to 32767"),
    "dead time": ("inverter", "dead_time_s = 3e-6", "[inverter] dead_time_s", "below min_pulse_s = 3e-06 s"),
    "dead time in us": ("inverter", "dead_time_s = 300", "[inverter] dead_time_s = 300", "half a PWM period, 5e-05 s"),
    "bootstrap": ("inverter", "bootstrap_charge_s = 1e-3", "[inverter] bootstrap_charge_s", "short the motor"),
    "no dead time": ("inverter", "dead_time_s = 0", "[inverter] dead_time_s = 0", "1e-12 up to 1000000 s"),
    "switch's pulse": (
        "inverter",
        "min_pulse_s = 2.005e-6",
        "min_pulse_s = 2.005e-06 and dead_time_s = 2e-06 leave the switch 5e-09 s",
        "at least 1e-07 s",
    ),
    "two pulses": ("inverter", "min_on_time_s = 1e-6", "min_on_time_s and min_pulse_s are both given"),
    "low side": (
        "sensors",
        "low_side_settle_s = 2e-6",
        "[control] voltage_reserve = 0 is out of range: allowed is at least 0.16",
        "low_side_settle_s = 2e-06 and dead_time_s = 2e-06",
        "before the sample",
    ),
    "shunt too slow": (
        "sensors",
        "low_side_settle_s = 24e-6",
        "[sensors] low_side_settle_s = 2.4e-05 is out of range: allowed is below 2.3e-05 s",
        "a quarter of the PWM period",
    ),
    "trip filter": (
        "core",
        "trip_filter_s = 5.12e-6",
        "[core] trip_filter_s = 5.12e-06",
        "up to 5.115e-06 s, 1023 clocks",
    ),
    "min pulse": ("inverter", "min_pulse_s = 60e-6", "[inverter] min_pulse_s", "5e-05 s"),
    "bus": ("inverter", "dc_bus_v = 900", "[inverter] dc_bus_v = 900", "sqrt(3)", "866.025 V"),
    "bus range": ("inverter", "dc_bus_v = 1100", "[inverter] dc_bus_v = 1100", "u_dc_range_v = 1000 V"),
    "limit": (
        "control",
        "current_limit_a = 13",
        "[control] current_limit_a = 13",
        "current_range_a = 12.5 A",
    ),
    "offset": ("sensors", "current_offset_code = [0, 1, 65536]", "current_offset_code = 65536", "0 to 65535"),
    "bus offset": ("sensors", "u_dc_offset_code = 7e4", "[sensors] u_dc_offset_code = 70000", "0 to 65535"),
    "unstable": (
        "control",
        "current_bandwidth_hz = 2e3",
        "[control] current_bandwidth_hz",
        "below 1666.67 Hz",
    ),
    "flux": ("machine", "inductance_q_h = 0.2", "[machine] inductance_q_h times", "0.796178 Wb", "[bases]"),
    "register base": (
        "machine",
        "magnet_flux_wb = 2",
        "register lambda_mg",
        "[sensors] u_dc_range_v; [machine] pole_pairs",
    ),
    "register high": (
        "control",
        "current_kp_d_v_per_a = 2e4",
        "register kp_d",
        "current_kp_d_v_per_a",
        "16777215",
    ),
    "register trim": ("sensors", "u_dc_gain = 2", "register u_dc_gain", "u_dc_gain", "-131072 to 131071"),
    "register zero": (
        "control",
        "speed_ki_a_per_rad = 1e-9",
        "register speed_ki",
        "rounds to zero",
        "at least",
    ),
    "long pulse": ("inverter", "min_pulse_s = 40e-6", "register min_pulse", "[inverter] min_pulse_s", "4095"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_values_give_a_one_line_error(tmp_path, capsys, case):
    section, line, *words = WRONG[case]
    check_message(capsys, edited(tmp_path, section, line), words)


TEXTS = {
    "syntax": ("[machine]\npole_pairs = = 4\n", ":2: not TOML"),
    "end of file": ("[machine]\npole_pairs = [4", ":2: not TOML"),
    "duplicate": ("[machine]\na = 1\na = 2\n", ":3: not TOML"),
    "empty": ("", "section [machine] is missing", "resistance_ohm"),
    "missing key": (
        "[machine]\npole_pairs = 4\n",
        "[machine] resistance_ohm is missing",
        "number, 1e-07 up to 1000000 ohm",
    ),
    "section name": ("[machines]\n", "unknown section machines", "machine"),
    "odd section name": ('["a\\nb"]\n', "unknown section 'a\\nb'"),
    "key outside": ("pole_pairs = 4\n", "unknown section pole_pairs"),
    "not a section": ("machine = 4\n", "machine must be a section", "whole number"),
    "tables": ("[[machine]]\n", "machine must be a section", "list"),
    "levels": ("[machine" + ".a" * 20 + "]\n", "[machine] unknown key a"),
    "many levels": ("[machine" + ".a" * 5000 + "]\n", ":1: not TOML: A key has more than 32 parts"),
    "deep": ("a = " + "[" * 100000, "not TOML"),
}


@pytest.mark.parametrize("case", TEXTS)
def test_wrong_files_give_a_one_line_error(tmp_path, capsys, case):
    text, *words = TEXTS[case]
    check_message(capsys, edited(tmp_path, None, text=text), words)


def test_files_that_cannot_be_read(tmp_path, capsys):
    check_message(capsys, tmp_path / "none.toml", ["cannot be read"])
    check_message(capsys, tmp_path, ["cannot be read"])
    (tmp_path / "latin.toml").write_bytes(b"# one\n# \xe9\n")
    check_message(capsys, tmp_path / "latin.toml", [":2: not UTF-8"])


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_mark_of_byte_order_is_read_over(tmp_path, capsys, end):
    """Editors of Windows write one; the lines and columns of an error are those without it."""
    marked, text = tmp_path / "marked.toml", PAPER.read_text(encoding="utf-8").replace("\n", end)
    marked.write_bytes(codecs.BOM_UTF8 + text.encode())
    assert load(marked) == load(PAPER)
    assert read_text(marked) == PAPER.read_text(encoding="utf-8")
    marked.write_bytes(codecs.BOM_UTF8 + f"[machine]{end}pole_pairs = = 4{end}".encode())
    check_message(capsys, marked, [":2: not TOML: Invalid value (column 14)"])
    marked.write_bytes(codecs.BOM_UTF8 + b"pole pairs = 4")
    check_message(capsys, marked, [":1: not TOML", "(column 6)"])


@pytest.mark.parametrize("code", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_utf_16_is_named(tmp_path, capsys, code):
    (tmp_path / "wide.toml").write_bytes(PAPER.read_text(encoding="utf-8").encode(code))
    check_message(capsys, tmp_path / "wide.toml", ["UTF-16", "save the file as UTF-8"])


PLANT = {  # lines at the end of the file, what each command must say of them
    "nan": ("[plant.machine]\nresistance_ohm = nan", "[plant] machine.resistance_ohm", "finite number"),
    "word": ("[plant.machine]\ncogging_order = 'six'", "[plant] machine.cogging_order", "finite number"),
    "key": ("[plant.machine]\ncoging_order = 6", "machine.coging_order", "nearest", "machine.cogging_order"),
    "section": ("[plant.motor]\ncogging_order = 6", "[plant.motor]", "machine, inverter"),
    "no section": ("[plant]\ncogging_order = 6", "[plant.machine]"),
    "range": ("[plant.sensors]\ncurrent_noise_a = 1e300", "current_noise_a = 1e+300", "0 up to 1000000 A"),
    "bits": ("[plant.sensors]\ncurrent_bits = 99", "current_bits = 99", "8 up to 24"),
    "fraction": ("[plant.sensors]\nposition_bits = 12.5", "position_bits = 12.5", "whole number"),
    "huge": (f"[plant.machine]\ncogging_order = 0x{'f' * 90000}", "cogging_order", "finite number"),
    "phases": ("[plant.sensors]\ncurrent_gain_error = [0, 0]", "current_gain_error", "three values"),
    "harmonics": ("[plant.machine]\nemf_harmonics = [[6, nan]]", "emf_harmonics", "finite numbers"),
    "map": ("[plant.machine]\nflux_map = 3", "flux_map", "CSV file"),
    "map outside": ("[plant.machine]\nflux_map = '../other/map.csv'", "flux_map", "in the folder of the drive file"),
    "absolute map": ("[plant.machine]\nflux_map = '/etc/passwd'", "flux_map", "in the folder of the drive file"),
    "no map": ("[plant.machine]\nflux_map = 'none.csv'", "flux_map", "no such file"),
    "zero map": ('[plant.machine]\nflux_map = "a\\u0000"', "flux_map"),
    "pipe": ("[plant.machine]\nflux_map = 'pipe'", "flux_map", "no such file"),
    "empty map": ("[plant.machine]\nflux_map = 'empty.csv'", "flux_map", "empty.csv"),
    "one row": ("[plant.machine]\nflux_map = 'row.csv'", "flux_map", "row.csv", "three or more"),
    "falling": ("[plant.machine]\nflux_map = {i_d_a=[3,2,1], i_q_a=[1], psi_d_wb=[[0]], psi_q_wb=[[0]]}", "must rise"),
    "ragged": ("[plant.machine]\nflux_map = {i_d_a=[1,2], i_q_a=[1], psi_d_wb=[[0],[1,2]], psi_q_wb=0}", "flux_map"),
    "column": ("[columns]\ncurrent = 'i_aa'", "[columns] 'current'", "'i_aa'", "i_a"),
    "constant": ("[constants]\nomega = 3", "[constants] omega", "omega_e"),
    "huge constant": ("[constants]\nomega_e = 1e308", "[constants] omega_e = 1e+308", "up to 1e+06 rad/s"),
    "long constant": (f"[constants]\nu_dc = 0x{'f' * 90000}", "[constants] u_dc", "finite number"),
    "wordy constant": ("[constants]\nu_dc = '48'", "[constants] u_dc", "finite number"),
}


@pytest.mark.parametrize("case", PLANT)
def test_mistakes_in_the_other_sections_are_told_by_every_command(tmp_path, capsys, case):
    lines, *words = PLANT[case]
    path = edited(tmp_path, None, text=f"{PAPER.read_text()}\n{lines}\n")
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "empty.csv").write_text("i_d_a,i_q_a,psi_d_wb,psi_q_wb\n")
    (tmp_path / "row.csv").write_text("i_d_a,i_q_a,psi_d_wb,psi_q_wb\n0,0,0,0\n")
    check_message(capsys, path, words)
    others = (
        ["simulate", str(path)],
        ["commission", str(path), "--out", str(tmp_path / "out")],
        ["project", str(path), "--part", "xc7z020clg484-1", "--out", str(tmp_path / "out")],
        ["dump", str(tmp_path / "capture.bin"), "--drive", str(path)],
    )
    for command in others:
        assert main(command) == 2
        assert words[0] in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_nearest_pwm_frequencies_are_named_and_accepted():
    drive = load(SERVO)
    with pytest.raises(DriveError, match=r"3333\.33333 clocks .*: 14997 Hz and 15001.5 Hz") as refused:
        dataclasses.replace(drive, inverter=dataclasses.replace(drive.inverter, pwm_frequency_hz=15e3))
    named = re.findall(r"([0-9.]+) Hz", str(refused.value))
    halves = [
        dataclasses.replace(drive, inverter=dataclasses.replace(drive.inverter, pwm_frequency_hz=float(f))).carrier_half
        for f in named
    ]
    assert halves == [3334, 3333]


def test_a_switch_is_never_on_for_less_than_its_key_says():
    """Both times are rounded up to clocks, and the dead time is taken from the pulse."""
    drive = load(SERVO)
    drive = dataclasses.replace(drive, sensors=dataclasses.replace(drive.sensors, low_side_settle_s=None))
    for dead, on in ((301e-9, 209e-9), (309e-9, 201e-9), (305e-9, 25e-9), (300e-9, 200e-9)):
        inverter = dataclasses.replace(drive.inverter, dead_time_s=dead, min_on_time_s=on)
        values = registers(dataclasses.replace(drive, inverter=inverter)).values
        left = (values.min_pulse - values.dead_time) / drive.core.clock_hz
        assert on <= left * (1 + 1e-9) < on + 1.0 / drive.core.clock_hz * (1 + 1e-9)
    with pytest.raises(DriveError, match="min_on_time_s is missing"):
        dataclasses.replace(drive, inverter=dataclasses.replace(drive.inverter, min_on_time_s=None))
    with pytest.raises(DriveError, match="min_on_time_s = 1.9e-08 .* at least 2e-08 s, a twentieth of dead_time_s"):
        dataclasses.replace(drive, inverter=dataclasses.replace(drive.inverter, min_on_time_s=19e-9))


def test_contradictions_are_found_without_a_file():
    drive = load(PAPER)
    with pytest.raises(DriveError, match="min_pulse_s"):
        dataclasses.replace(drive, inverter=dataclasses.replace(drive.inverter, min_pulse_s=1e-6))
    with pytest.raises(DriveError, match="a PWM period has 14 clocks"):
        with_carrier(drive, 7)
    assert isinstance(with_carrier(drive, 8), Drive)
    with pytest.raises(DriveError, match=r"the current limit = 5.23 .* up to 4.125 A, 1.375 \* \[bases\] current_a"):
        dataclasses.replace(drive, base_choice=dataclasses.replace(drive.base_choice, current_a=3.0))


@each_drive
def test_command_prints_an_aligned_table_and_the_same_as_json(tmp_path, capsys, path):
    target = tmp_path / "registers.json"
    assert main(["registers", str(path), "--json", str(target)]) == 0
    lines = capsys.readouterr().out.splitlines()
    drive = load(path)
    result = board_set(drive)
    assert lines[0].startswith("bases") and f"{drive.bases.current_a:g} A" in lines[0]
    assert f"CARRIER_HALF = {drive.carrier_half}" in lines[1]
    table = lines[5:]
    assert len(table) == len(result.rows) and len({len(line) for line in table}) == 1
    assert (len(result.rows) > len(REGISTERS)) == has_board(drive)
    data = json.loads(target.read_text())
    assert data["generics"] == result.config._asdict() and data["bases"]["flux_wb"] == drive.bases.flux_wb
    for line, row in zip(table, result.rows, strict=True):
        name, value = row.name, row.integer
        assert line.split()[0] == name and str(value) in line.split()
        assert data["registers"][name]["integer"] == value
    assert [p.name for p in tmp_path.iterdir()] == ["registers.json"]


def test_command_line_mistakes_exit_with_2(capsys, tmp_path):
    for arguments in ([], ["nonsense"], ["registers"], ["registers", str(PAPER), "--jsn", "x"]):
        with pytest.raises(SystemExit) as stopped:
            main(arguments)
        assert stopped.value.code == 2
    (tmp_path / "file").write_text("")
    assert main(["registers", str(PAPER), "--json", str(tmp_path / "file" / "below")]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith("fluxproof: ")


def test_command_exits_quietly_on_a_closed_pipe():
    command = [sys.executable, "-m", "fluxproof.command", "registers", str(PAPER)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait() == 0


def test_shunts_in_the_lower_legs_have_a_reserve_and_one_update():
    """The smallest allowed reserve is accepted, one below is not; the sample at the peak would see no current."""
    drive = load(PAPER)
    sensors = dataclasses.replace(drive.sensors, low_side_settle_s=2e-6)

    def described(reserve, **core):
        control = dataclasses.replace(drive.control, voltage_reserve=reserve, sample_time_s=None)
        return dataclasses.replace(
            drive, sensors=sensors, control=control, core=dataclasses.replace(drive.core, **core)
        )

    assert described(0.16).sensors.low_side_settle_s == 2e-6  # 4*(2 us + 2 us)/100 us
    with pytest.raises(DriveError, match="at least 0.16 for"):
        described(0.159)
    with pytest.raises(DriveError, match="no lower switch is on at the peak"):
        described(0.5, updates_per_period=2)


def test_a_motor_larger_than_the_drive_does_not_loosen_its_checks():
    """Limits of the sensors go by the current that the drive works with: a rated current of four times is no excuse."""
    drive = load(PAPER)
    large = dataclasses.replace(drive, machine=dataclasses.replace(drive.machine, rated_current_a=20.0))
    assert large.working_current_a == drive.working_current_a == 5.23
    named = ("sum_trip", "i_open", "offset_max", "residual_light", "residual_sum_max")
    given, kept = (registers(d).values._asdict() for d in (large, drive))
    assert [given[name] for name in named] == [kept[name] for name in named]
