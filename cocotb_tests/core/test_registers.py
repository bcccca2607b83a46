# SPDX-License-Identifier: BSD-3-Clause
"""From drive.toml to the core's integers: closed forms, ranges, round trips, options."""

import dataclasses
import math
import re

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER, each_drive, edited, row_of
from fluxproof.checkout import DRIVES
from fluxproof.command import main
from fluxproof.plant import Machine, machine_params
from golden_model.drive import SECTIONS, load, with_carrier
from golden_model.drive_checks import doubts
from golden_model.drive_keys import DriveError
from golden_model.fluxproof import OBSERVED, REGISTERS, Registers
from golden_model.registers import registers
from golden_model.scaling import ROUND_UP, base_keys
from golden_model.units import SIGNALS, UNITS, from_si, si_per_lsb, to_si, unit


@each_drive
def test_every_register_is_in_range_and_within_half_an_lsb(path):
    drive = load(path)
    result = registers(drive)
    assert [row.name for row in result.rows] == list(REGISTERS) == list(Registers._fields)
    for row, value in zip(result.rows, result.values, strict=True):
        port = REGISTERS[row.name]
        assert row.integer == value and isinstance(value, int)
        assert port.low <= value <= port.high
        lsb = abs(row.represented / value) if value else 0.0
        if row.name in ROUND_UP and row.si:
            assert 0.0 <= row.error + 1e-9 * row.si < lsb
        elif value:
            assert abs(row.error) <= lsb / 2 * (1 + 1e-9)
        else:
            assert row.si == 0.0


def test_registers_of_the_papers_drive():
    """Calculated by hand from Table 2 and the bases 12.5 A, 500 V, 1256 rad/s."""
    drive = load(PAPER)
    values, config, *_ = registers(drive)
    assert (config.adc_bits, config.position_bits, config.carrier_half) == (16, 16, 10000)
    assert drive.bases.flux_wb == pytest.approx(500 / 1256)
    assert values.offset_a == values.offset_b == values.offset_c == 32768
    assert values.gain_a == values.u_dc_gain == 65536
    assert values.k_u_max == round(2**17 / math.sqrt(3))
    assert values.lambda_mg == round(65536 * 0.165 * 1256 / 500)
    assert values.kp_d == round(65536 * 2 * math.pi * 500 * 16.07e-3 * 12.5 / 500)
    assert values.ki_q == round(2**24 * 2 * math.pi * 500 * 1.53 * 1e-4 * 12.5 / 500)
    assert values.l_q == round(2**20 * 15.81e-3 * 12.5 * 1256 / 500)
    assert values.k_speed == round(4096 * 2 * math.pi * 4 / (1e-4 * 1256))
    assert values.k_delay == round(2**17 * 1.5e-4 * 1256 / (2 * math.pi))
    assert (values.dead_time, values.min_pulse) == (400, 600)
    assert (values.i_max, values.pole_pairs, values.reverse) == (round(65536 * 5.23 / 12.5), 4, 0)


@each_drive
def test_speed_gains_place_the_crossover(path):
    """|C*P| at w_s, P = 1.5*p**2*lambda/(J*s): sqrt(1 + (1/5)**2), one but for the integral's small share."""
    drive = load(path)
    m, c = drive.machine, drive.control
    rows = {row.name: row for row in registers(drive).rows}
    w = 2 * math.pi * c.speed_bandwidth_hz
    pi = complex(rows["speed_kp"].si, -rows["speed_ki"].si / w)
    plant = 1.5 * m.pole_pairs**2 * m.magnet_flux_wb / (m.inertia_kgm2 * 1j * w)
    assert abs(pi * plant) == pytest.approx(math.hypot(1.0, 0.2))


@each_drive
def test_observed_signals_round_trip_through_si(path):
    drive = load(path)
    assert set(UNITS) <= set(SIGNALS) and set(OBSERVED) <= set(SIGNALS)
    for name, port in SIGNALS.items():
        middle = (port.low + port.high) // 3
        for integer in (port.low, port.high, middle, 0):
            assert from_si(name, to_si(name, integer, drive), drive) == integer
    np.testing.assert_allclose(to_si("i_a", np.array([0, 65536]), drive), [0.0, drive.bases.current_a])
    assert unit("duty_a") == "1" and to_si("duty_a", 32768, drive) == 0.5


def test_from_si_refuses_out_of_range_and_wraps_angles():
    drive = load(PAPER)
    assert from_si("theta_me", -math.pi, drive) == 2**17
    with pytest.raises(ValueError, match=r"i_q_ext = 26 A is out of range: allowed is -25 to 24\.9998"):
        from_si("i_q_ext", 26.0, drive)
    with pytest.raises(ValueError, match="not a finite number"):
        from_si("i_q_ext", math.nan, drive)
    with pytest.raises(KeyError, match="known are"):
        si_per_lsb("i_x", drive)


@pytest.mark.parametrize("half", (8, 40, 100, 1000, 32767))
def test_with_carrier_changes_clocks_only(half):
    drive = load(PAPER)
    scaled = with_carrier(drive, half)
    old, new = registers(drive).values, registers(scaled)
    assert new.config.carrier_half == half and scaled.sample_time_s == drive.sample_time_s
    clocks = ("dead_time", "min_pulse", "watchdog")
    assert new.values._replace(**{name: getattr(old, name) for name in clocks}) == old
    assert new.values.watchdog == 3 * half
    clock = scaled.core.clock_hz
    assert new.values.dead_time == math.ceil(2e-6 * clock - 1e-6)
    assert new.values.min_pulse == max(math.ceil(3e-6 * clock - 1e-6), new.values.dead_time + 1)
    assert 0 < new.values.dead_time < new.values.min_pulse <= half


def test_machine_section_builds_the_plants_machine():
    names = {f.name for f in dataclasses.fields(Machine)}
    extra = {"rated_current_a", "rated_speed_rad_s"}
    assert {f.name for f in dataclasses.fields(SECTIONS["machine"])} - names == extra
    params = machine_params(Machine.from_mapping(dataclasses.asdict(load(PAPER).machine)))
    assert (params.inductance_d, params.magnet_flux) == (16.07e-3, 0.165)


def test_a_current_loop_that_rings_is_told(tmp_path, capsys):
    """At 1.5 samples of delay 30 degrees are left at a ninth of the sampling frequency; the files here are quiet."""
    path = edited(tmp_path, "control", "current_bandwidth_hz = 1200")
    assert main(["registers", str(path)]) == 0
    said = capsys.readouterr().err
    assert "current_bandwidth_hz = 1200 leaves 25 degrees of phase margin at 1.5 samples" in said and "1111 Hz" in said
    assert not any(doubts(load(file)) for file in DRIVES.glob("*.toml"))
    path.write_text(path.read_text().replace("[control]", "[control]\ncurrent_kp_q_v_per_a = 10"))
    assert not doubts(load(path)), "a given gain has another crossover"


def test_a_clock_in_mhz_is_told_by_the_clock_that_it_needs(tmp_path):
    with pytest.raises(DriveError, match=r"a PWM period has 0.02 clocks: allowed is clock_hz above 160000, in Hz"):
        load(edited(tmp_path, "core", "clock_hz = 200"))


def test_keys_name_where_a_base_comes_from(tmp_path):
    drive = load(PAPER)
    assert base_keys(drive, "current_a") == "[sensors] current_range_a"
    path = edited(tmp_path, None, text=PAPER.read_text() + "[bases]\ncurrent_a = 10\n")
    assert base_keys(load(path), "current_a", "voltage_v") == "[bases] current_a; [sensors] u_dc_range_v"


def test_explicit_gains_offsets_and_bases(tmp_path):
    assert row_of(edited(tmp_path, "control", "current_kp_d_v_per_a = 10"), "kp_d").si == 10.0
    assert row_of(edited(tmp_path, "control", "speed_ki_a_per_rad = 0.5"), "speed_ki").si == 0.5
    path = edited(tmp_path, "sensors", "current_offset_code = [32700, 32768, 32801.5]")
    assert [row_of(path, f"offset_{x}").integer for x in "abc"] == [32700, 32768, 32802]
    path = edited(tmp_path, "sensors", "current_gain = [1.01, -1, 0.5]")
    assert [row_of(path, f"gain_{x}").integer for x in "abc"] == [66191, -65536, 32768]
    path = edited(tmp_path, "sensors", "theta_offset_rad = -0.1")
    assert row_of(path, "theta_offset").integer == round(2**18 * (1 - 0.1 / (2 * math.pi)))
    path = edited(tmp_path, None, text=PAPER.read_text() + "[bases]\ncurrent_a = 10\n[columns]\nx = 'y'\n")
    assert load(path).bases.current_a == 10.0 and row_of(path, "gain_a").integer == 81920


def test_optional_loops(tmp_path):
    optional = "speed_bandwidth_hz|speed_filter_hz|inertia_kgm2|sample_time_s"
    text = re.sub(rf"(?m)^({optional}).*\n", "", PAPER.read_text())
    values = registers(load(edited(tmp_path, None, text=text))).values
    assert (values.speed_kp, values.speed_ki, values.k_filter) == (0, 0, 65536)
    assert row_of(edited(tmp_path, "control", "voltage_reserve = 0.5"), "k_u_max").integer == 37837
