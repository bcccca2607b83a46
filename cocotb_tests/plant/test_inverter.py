# SPDX-License-Identifier: BSD-3-Clause
"""Dead time, on-state drops, blocked legs: the averaged and the switching plant against formulas and each other.

Every tolerance states where it comes from.  "Rounding" means: nothing but double precision over the number of
steps taken.
"""

import math

import numpy as np
import pytest

from cocotb_tests.support.plant_machines import MACHINE, PERIOD, U_DC, clarke, duties_for
from fluxproof.plant import (
    IMPOSED_SPEED,
    AveragedPlant,
    Inverter,
    SwitchingPlant,
    averaged_leg_voltage,
    centred_gates,
    layout,
    plant_params,
)


def test_dead_time_makes_a_square_wave_along_the_current():
    """Fundamental 4/pi U Td/T along the current, a fifth and a seventh of 1/5 and 1/7."""
    inv = plant_params(MACHINE, Inverter(dead_time_s=2e-6)).inverter
    angle = (np.arange(3600) + 0.5) * 2 * np.pi / 3600
    error = np.array([averaged_leg_voltage(inv, 0.5, U_DC, math.cos(a), PERIOD) - 0.5 * U_DC for a in angle])
    level = U_DC * 2e-6 / PERIOD
    for order, share in ((1, -1.0), (5, -1.0 / 5), (7, 1.0 / 7)):
        part = 2.0 * np.mean(error * np.cos(order * angle))
        assert part == pytest.approx(4 / np.pi * level * share, rel=1e-4)


def test_zero_current_zone_is_linear():
    inv = plant_params(MACHINE, Inverter(2e-6, 1.0, 1.0, zero_current_a=0.2)).inverter
    full = averaged_leg_voltage(inv, 0.4, U_DC, 0.2, PERIOD) - 0.4 * U_DC
    assert full == pytest.approx(-U_DC * 2e-6 / PERIOD - 1.0)
    for share in (-0.75, 0.0, 0.1, 0.5):
        part = averaged_leg_voltage(inv, 0.4, U_DC, 0.2 * share, PERIOD) - 0.4 * U_DC
        assert part == pytest.approx(share * full, abs=1e-12)


def test_dead_time_of_the_gates_equals_the_averaged_formula():
    inverter = Inverter(2e-6, 1.2, 0.8, 0.0, 0.0)
    for angle in np.deg2rad([10.0, 75.0, 140.0, 250.0]):
        i = 3.0 * np.exp(1j * angle)
        plant = SwitchingPlant(MACHINE, inverter, mode=IMPOSED_SPEED, i_d=i.real, i_q=i.imag)
        averaged = AveragedPlant(MACHINE, inverter, mode=IMPOSED_SPEED, i_d=i.real, i_q=i.imag)
        duties = duties_for(0.0, 5.0, 2.0)
        sign = np.sign(plant.i_abc)
        level = U_DC * 2e-6 / PERIOD
        high = duties - sign * 2e-6 / PERIOD
        drop = np.where(sign > 0, high * 1.2 + (1 - high) * 0.8, high * 0.8 + (1 - high) * 1.2)
        expected = clarke(U_DC * duties - sign * (level + drop))
        plant.advance(*centred_gates(duties, 2e-6, PERIOD), U_DC, 0.0, PERIOD)
        averaged.advance(duties, U_DC, 0.0, PERIOD)
        assert (np.sign(plant.i_abc) == sign).all()
        # Both are exact while no current changes its sign: rounding.
        assert complex(*plant.u_alpha_beta) == pytest.approx(expected, abs=1e-9)
        assert complex(*averaged.u_alpha_beta) == pytest.approx(expected, abs=1e-9)


def test_slope_resistances_agree_between_the_plants():
    inverter = Inverter(0.0, 0.0, 0.0, 0.3, 0.1)
    kwargs = {"mode": IMPOSED_SPEED, "i_d": 3.0, "i_q": 0.7}
    switched = SwitchingPlant(MACHINE, inverter, **kwargs)
    averaged = AveragedPlant(MACHINE, inverter, **kwargs)
    duties = duties_for(0.0, 5.0, 2.0)
    switched.advance(*centred_gates(duties, 0.0, PERIOD), U_DC, 0.0, PERIOD)
    averaged.advance(duties, U_DC, 0.0, PERIOD)
    # Ripple of some 20 mA on 0.2 ohm.
    assert switched.u_alpha_beta == pytest.approx(averaged.u_alpha_beta, abs=5e-3)


@pytest.mark.parametrize("duty", [0.0, 0.01, 0.015, 0.5, 0.985, 0.99, 1.0])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_short_pulses_and_resting_legs(duty, sign):
    """The averaged rule for pulses shorter than the dead time, against the gates."""
    i_d = sign * 4.0
    inverter = Inverter(dead_time_s=2e-6)
    duties = np.array([duty, 0.5, 0.5])
    switched = SwitchingPlant(MACHINE, inverter, mode=IMPOSED_SPEED, i_d=i_d)
    averaged = AveragedPlant(MACHINE, inverter, mode=IMPOSED_SPEED, i_d=i_d)
    switched.advance(*centred_gates(duties, 2e-6, PERIOD), U_DC, 0.0, PERIOD)
    averaged.advance(duties, U_DC, 0.0, PERIOD)
    assert switched.u_alpha_beta == pytest.approx(averaged.u_alpha_beta, abs=1e-9)


def test_plants_agree_with_an_ideal_inverter():
    switched, averaged = SwitchingPlant(MACHINE), AveragedPlant(MACHINE)
    worst = 0.0
    for _ in range(1000):
        duties = duties_for(averaged.theta_e, -5.0, 25.0)
        switched.advance(*centred_gates(duties, 0.0, PERIOD), U_DC, 0.2, PERIOD)
        averaged.advance(duties, U_DC, 0.2, PERIOD)
        worst = max(worst, np.abs(switched.i_abc - averaged.i_abc).max())
    print(f"averaged against switching, sampled at the centre: {worst * 1e3:.2f} mA")
    # Centre sampling cancels the ripple but for its decay and rotation: ripple (0.1 A) x w T.
    assert worst < 5e-3
    assert switched.omega_m == pytest.approx(averaged.omega_m, rel=1e-4)


def test_zero_crossing_is_located():
    """All gates off: diodes drive the current to zero after t0 = L/R ln(1 + R i0 / u), then nothing."""
    inverter = Inverter(v_diode_v=0.8)
    u = 2.0 / 3.0 * (U_DC + 2 * 0.8)
    r, ell = MACHINE.resistance_ohm, MACHINE.inductance_d_h
    for i_0 in (0.3, 1.1, 2.017):
        plant = SwitchingPlant(MACHINE, inverter, mode=IMPOSED_SPEED, i_d=i_0)
        plant.advance([], [], U_DC, 0.0, PERIOD)
        stop = ell / r * math.log(1.0 + r * i_0 / u)
        assert stop < PERIOD
        # 1e-7 A x L / T = 2e-5 V.
        assert plant.u_alpha_beta == pytest.approx([-u * stop / PERIOD, 0.0], abs=5e-5)
        assert np.abs(plant.i_abc).max() < 1e-6
        plant.advance([], [], U_DC, 0.0, PERIOD)
        assert plant.u_alpha_beta == pytest.approx([0.0, 0.0], abs=5e-5)


def test_zero_current_clamping_weakens_the_dead_time_error():
    """Small current: it dies within each dead time, so the error is not the sign's full step."""
    level = U_DC * 4e-6 / PERIOD
    errors, dead = {}, {}
    for i_0 in (0.02, 3.0):
        plant = SwitchingPlant(MACHINE, mode=IMPOSED_SPEED, i_d=i_0)
        duties = duties_for(0.0, 1.0, 0.0)
        times, words = centred_gates(duties, 4e-6, PERIOD)
        end_of_dead_time = 0.5 * (1.0 - duties[0]) * PERIOD + 3.9e-6
        plant.advance(times, words, U_DC, 0.0, PERIOD, end_of_dead_time)
        errors[i_0] = plant.u_alpha_beta[0] - clarke(duties * U_DC).real
        dead[i_0] = plant.state[layout.PROBE_A]
    assert errors[3.0] == pytest.approx(-4 / 3 * level, abs=1e-6)
    assert abs(errors[0.02]) < 0.5 * abs(errors[3.0])
    assert abs(dead[0.02]) < 1e-6
    assert dead[3.0] > 2.0


def test_floating_phase_carries_no_current():
    """Leg c's gates off, a high, b low: c floats at mid-bus plus its EMF; a and b are in series."""
    plant = SwitchingPlant(MACHINE, mode=IMPOSED_SPEED)
    word = 0b010_001
    plant.advance([0.0], [word], 100.0, 0.0, PERIOD)
    a, b, c = plant.i_abc
    line = 0.5 * (MACHINE.inductance_d_h + MACHINE.inductance_q_h)
    assert abs(c) < 1e-6
    assert a == -b or abs(a + b) < 1e-6
    assert a == pytest.approx(100.0 / (2 * line) * PERIOD, rel=0.02)


def test_shoot_through_is_refused():
    plant = SwitchingPlant(MACHINE)
    with pytest.raises(ValueError, match="shoot-through"):
        plant.advance([0.0], [0b001_001], U_DC, 0.0, PERIOD)


def test_skewed_sampling_follows_the_zero_vector():
    """The averaged plant's skewed sample against the switching plant's probe."""
    kwargs = {"mode": IMPOSED_SPEED, "omega_m": 100.0, "i_d": -1.0, "i_q": 3.0}
    averaged, switched = AveragedPlant(MACHINE, **kwargs), SwitchingPlant(MACHINE, **kwargs)
    skew = 3e-6
    seen = averaged.skewed_currents(skew)
    times, words = centred_gates(duties_for(0.0, -10.0, 60.0), 0.0, PERIOD)
    switched.advance(times, words, U_DC, 100.0, PERIOD, skew)
    assert switched.state[layout.PROBE_A : layout.PROBE_C + 1] == pytest.approx(seen, abs=1e-9)
    assert np.abs(seen - averaged.i_abc).max() > 1e-3
    assert averaged.skewed_currents(0.0) == pytest.approx(averaged.i_abc, abs=1e-14)
