# SPDX-License-Identifier: BSD-3-Clause
"""The registers' integers correspond to the SI values: one sample through the blocks."""

import dataclasses
import math

import pytest

from cocotb_tests.support.drives import DRIVE_FILES, each_drive
from golden_model.control import current_pi, decoupling, speed_pi
from golden_model.drive import Sampling, load
from golden_model.drive_keys import DriveError
from golden_model.estimators import flux_estimate, flux_models
from golden_model.io import current_conditioning, speed, u_dc_conditioning
from golden_model.modulation import svm_delay_compensation
from golden_model.registers import registers
from golden_model.units import from_si, si_per_lsb, to_si


@each_drive
def test_sensor_codes_convert_to_amperes_and_volts(path):
    drive = load(path)
    v, config, *_ = registers(drive)
    s, full = drive.sensors, 2**drive.sensors.adc_bits
    code = full // 2 + full // 5
    amperes = (code - full / 2) / (full / 2) * s.current_range_a
    scaling = (v.offset_a, v.offset_b, v.offset_c, v.gain_a, v.gain_b, v.gain_c)
    i_a, i_b, i_c, _ = current_conditioning.step(code, full // 2, 0, *scaling, v.two_sensors, config.adc_bits)
    if drive.current_sensors == 2:  # that of phase a is what b and c lack: 0 and the lower end of the range
        amperes = s.current_range_a
    assert to_si("i_a", i_a, drive) == pytest.approx(amperes, abs=si_per_lsb("i_a", drive))
    assert (i_b, to_si("i_c", i_c, drive)) == (0, -s.current_range_a)
    code = round(full * drive.inverter.dc_bus_v / s.u_dc_range_v)
    u_dc, u_max, _ = u_dc_conditioning.step(code, v.u_dc_offset, v.u_dc_gain, v.k_u_max, config.adc_bits)
    volts = s.u_dc_range_v / full * code
    assert to_si("u_dc", u_dc, drive) == pytest.approx(volts, abs=si_per_lsb("u_dc", drive))
    circle = volts * (1 - drive.control.voltage_reserve) / math.sqrt(3)
    assert to_si("u_max", u_max, drive) == pytest.approx(circle, abs=2 * si_per_lsb("u_max", drive))


@each_drive
def test_current_regulator_products_are_volts(path):
    """kp*err in volts and ki*T_s*err in volts, per sample; errors: register half an LSB, result one."""
    drive = load(path)
    v = registers(drive).values
    m, w_c = drive.machine, 2 * math.pi * drive.control.current_bandwidth_hz
    err = from_si("i_d", 0.1 * drive.sensors.current_range_a, drive)
    amperes = to_si("i_d", err, drive)
    inputs = current_pi.Inputs(0, 0, err, err, 0, 0, 0, 0, 0, 0, 1)
    _, (u_d, u_q, int_d, int_q) = current_pi.step(current_pi.State(), inputs, v)
    for axis, u, integral in (("d", u_d, int_d), ("q", u_q, int_q)):
        rise = w_c * m.resistance_ohm * drive.sample_time_s * amperes
        total = w_c * getattr(m, f"inductance_{axis}_h") * amperes + rise
        assert to_si(f"u_int_{axis}", integral, drive) == pytest.approx(rise, rel=1e-4)
        assert to_si(f"u_{axis}", u, drive) == pytest.approx(total, abs=2 * si_per_lsb("u_d", drive))


@each_drive
def test_speed_regulator_product_is_amperes(path):
    drive = load(path)
    result = registers(drive)
    v, kp = result.values, next(row.si for row in result.rows if row.name == "speed_kp")
    err = from_si("omega_ref", 0.5 * drive.current_limit_a / kp, drive)
    _, (i_q_ref, limited) = speed_pi.step(speed_pi.State(), err, 0, 0, v.i_max, 0, 1, 0, 1, 0, v.speed_kp, v.speed_ki)
    expected = kp * to_si("omega_ref", err, drive)
    assert limited == 0
    assert to_si("i_q_ref", i_q_ref, drive) == pytest.approx(expected, rel=1e-4)


@each_drive
def test_flux_and_rotational_voltage(path):
    drive = load(path)
    v, m = registers(drive).values, drive.machine
    amperes, omega = 0.5 * m.rated_current_a, 0.5 * m.pole_pairs * m.rated_speed_rad_s
    i = from_si("i_q", amperes, drive)
    models = flux_models.step(-i, i, 0, 0, 0, 1, 0, flux_models.CURRENT_MODEL, v.l_d, v.l_q, v.lambda_mg)
    lambda_d, lambda_q, _ = flux_estimate.step(*models, 0, 0)
    tolerance = 2 * si_per_lsb("lambda_d", drive)
    flux_d, flux_q = m.magnet_flux_wb - m.inductance_d_h * amperes, m.inductance_q_h * amperes
    assert to_si("lambda_d", lambda_d, drive) == pytest.approx(flux_d, abs=tolerance)
    assert to_si("lambda_q", lambda_q, drive) == pytest.approx(flux_q, abs=tolerance)
    u_d, u_q = decoupling.step(from_si("omega_me", omega, drive), lambda_d, lambda_q)
    tolerance = 3 * si_per_lsb("u_d", drive)
    assert to_si("u_dec_d", u_d, drive) == pytest.approx(-omega * flux_q, abs=tolerance)
    assert to_si("u_dec_q", u_q, drive) == pytest.approx(omega * flux_d, abs=tolerance)


@each_drive
def test_position_steps_give_speed_and_angle_advance(path):
    """One code a sample, a settled filter; then the angle that this speed turns during the delay."""
    drive = load(path)
    v, config, *_ = registers(drive)
    state, code = speed.State(), 0
    for code in range(0, 3000, 10):
        state, (omega_me, *_) = speed.step(state, code, v.reverse, v.k_speed, v.k_filter, 0, 0, 0, config.position_bits)
    turns = 10 / 2**drive.sensors.position_bits
    omega = turns * 2 * math.pi * drive.machine.pole_pairs / drive.sample_time_s
    assert to_si("omega_me", omega_me, drive) == pytest.approx(omega, abs=2 * si_per_lsb("omega_me", drive))
    (theta,) = svm_delay_compensation.step(0, omega_me, v.k_delay)
    advance = omega * 1.5 * drive.sample_time_s
    assert to_si("theta_me", theta, drive) == pytest.approx(advance, abs=2 * si_per_lsb("theta_me", drive))


@pytest.mark.parametrize("delay_s", [0.0, 4e-6, -3e-6])
@each_drive
def test_voltage_acts_at_the_same_angle_wherever_the_sample_is(path, delay_s):
    """Position and currents taken delay_s late: the output angle belongs to the middle of the next period."""
    drive = load(path)
    sensors = dataclasses.replace(drive.sensors, low_side_settle_s=None)  # which allows no other instant
    drive = dataclasses.replace(drive, sampling=Sampling(delay_s), sensors=sensors)
    v, m = registers(drive).values, drive.machine
    omega = 0.7 * m.pole_pairs * m.rated_speed_rad_s
    omega_me, lsb = from_si("omega_me", omega, drive), si_per_lsb("theta_me", drive)
    sampled = from_si("theta_me", 1.0 + omega * delay_s, drive)  # 1 rad at the valley
    (theta_out,) = svm_delay_compensation.step(sampled, omega_me, v.k_delay)
    middle = 1.0 + omega * 1.5 * drive.sample_time_s
    error = (to_si("theta_me", theta_out, drive) - middle + math.pi) % (2 * math.pi) - math.pi
    assert abs(error) <= 3 * lsb
    # paper 000 eq. (6): directions of the currents at the middle of the voltage that the next sample commands
    rows = {row.name: row for row in registers(drive).rows}
    assert rows["k_ahead"].si == pytest.approx(2.5 * drive.sample_time_s - delay_s)
    assert rows["k_ahead"].represented == pytest.approx(rows["k_ahead"].si, rel=1e-3)


def test_sampling_delay_is_read_and_limited(tmp_path):
    """The key of the drive file reaches the register; a sample nearer to another valley is refused."""
    text = DRIVE_FILES[0].read_text()
    path = tmp_path / "drive.toml"
    path.write_text(f"{text}\n[sampling]\ndelay_s = 5e-6\n")
    rows = {row.name: row for row in registers(load(path)).rows}
    plain = {row.name: row for row in registers(load(DRIVE_FILES[0])).rows}
    assert plain["k_delay"].si - rows["k_delay"].si == pytest.approx(5e-6)
    assert {n for n in rows if rows[n].integer != plain[n].integer} == {"k_delay", "k_ahead"}
    path.write_text(f"{text}\n[sampling]\ndelay_s = 1.0\n")
    with pytest.raises(DriveError, match=r"\[sampling\] delay_s = 1 is out of range: allowed is between"):
        load(path)
