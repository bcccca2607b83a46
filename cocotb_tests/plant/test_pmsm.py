# SPDX-License-Identifier: BSD-3-Clause
"""The electrical equations against closed forms: steady states, EMF, balance of flux, resistances.

Every tolerance states where it comes from.  "Rounding" means: nothing but double precision over the number of
steps taken.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.plant_machines import HARMONIC, MACHINE, PERIOD, SATURATED, U_DC, duties_for
from fluxproof.plant import IMPOSED_SPEED, AveragedPlant, Inverter, SwitchingPlant, centred_gates, layout


def test_locked_rotor_step_is_an_exponential():
    plant = AveragedPlant(MACHINE, mode=IMPOSED_SPEED)
    u, tau = 12.0, MACHINE.inductance_d_h / MACHINE.resistance_ohm
    for k in range(1, 301):
        plant.advance(duties_for(0.0, u, 0.0), U_DC, 0.0, PERIOD)
        expected = u / MACHINE.resistance_ohm * (1.0 - math.exp(-k * PERIOD / tau))
        # Runge-Kutta: (h/tau)^5/120 a step, h = 50 us, tau = 10.5 ms: 2e-13 A a step, 210 steps a tau.
        assert plant.i_dq == pytest.approx([expected, 0.0], abs=1e-10)


def test_steady_state_with_held_voltage_is_the_sampled_closed_form():
    """Ld = Lq: the stator equation is linear with a rotating source, exact for held voltages."""
    machine = replace(MACHINE, inductance_q_h=MACHINE.inductance_d_h)
    w_m = 200.0
    w = machine.pole_pairs * w_m
    r, ell, psi = machine.resistance_ohm, machine.inductance_d_h, machine.magnet_flux_wb
    u = -40.0 + 140.0j
    decay, turn = math.exp(-r / ell * PERIOD), np.exp(1j * w * PERIOD)
    emf = 1j * w * psi / ell * (turn - decay) / (1j * w + r / ell)
    expected = ((1.0 - decay) / r * u - emf) / (turn - decay)
    plant = AveragedPlant(machine, mode=IMPOSED_SPEED, omega_m=w_m, substeps=8, i_d=expected.real, i_q=expected.imag)
    for _ in range(500):
        plant.advance(duties_for(plant.theta_m * machine.pole_pairs, u.real, u.imag), U_DC, w_m, PERIOD)
        # (w h)^5/120 with h = 12.5 us is 8e-13 of the flux (10 A equivalent) per step.
        assert complex(*plant.i_dq) == pytest.approx(expected, abs=1e-8)


def test_salient_steady_state_meets_the_dq_equations():
    machine = replace(MACHINE, inductance_q_h=2.0 * MACHINE.inductance_d_h, resistance_ohm=5.0)
    w_m, i_d, i_q, period = 150.0, -2.0, 4.0, 2e-6
    w = machine.pole_pairs * w_m
    u_d = machine.resistance_ohm * i_d - w * machine.inductance_q_h * i_q
    u_q = machine.resistance_ohm * i_q + w * (machine.inductance_d_h * i_d + machine.magnet_flux_wb)
    plant = AveragedPlant(machine, mode=IMPOSED_SPEED, omega_m=w_m)
    for _ in range(50_000):
        theta = machine.pole_pairs * (plant.theta_m + 0.5 * w_m * period)
        plant.advance(duties_for(theta, u_d, u_q), U_DC, w_m, period)
    # A vector held over w T = 1.2e-3 rad is short by (w T)^2/24 = 6e-8 of 150 V; after 0.1 s, at
    # least 0.1 / 6.4 ms = 15 time constants, 2e-7 of a few A of the start is left.
    assert plant.i_dq == pytest.approx([i_d, i_q], abs=1e-5)


@pytest.mark.parametrize("machine", [MACHINE, HARMONIC], ids=["sine", "harmonics"])
def test_open_circuit_voltage_is_the_change_of_magnet_flux(machine):
    w_m = 150.0
    plant = SwitchingPlant(machine, mode=IMPOSED_SPEED, omega_m=w_m)
    for _ in range(200):
        before = plant.state[layout.LAMBDA_ALPHA : layout.LAMBDA_BETA + 1].copy()
        plant.advance([], [], U_DC, w_m, PERIOD)
        theta = machine.pole_pairs * plant.theta_m
        psi = complex(machine.magnet_flux_wb)
        for h in machine.emf_harmonics:
            angle = h.order * theta + h.phase_rad
            psi += machine.magnet_flux_wb * complex(h.amplitude_d * math.cos(angle), h.amplitude_q * math.sin(angle))
        psi *= np.exp(1j * theta)
        assert plant.i_abc == pytest.approx(0.0, abs=1e-7)  # the model's own zero
        # 1e-7 A of leftover current is 2e-9 Wb.
        assert plant.state[:2] == pytest.approx([psi.real, psi.imag], abs=1e-8)
        # A blocked leg's voltage is held for a step h: between the ends the current strays by
        # e w h^2 / 8 L = 5e-5 A, on R.
        assert plant.u_alpha_beta == pytest.approx((plant.state[:2] - before) / PERIOD, abs=5e-4)
    if machine is MACHINE:
        emf = machine.pole_pairs * w_m * machine.magnet_flux_wb
        held = np.sinc(machine.pole_pairs * w_m * PERIOD / (2 * np.pi))
        assert np.hypot(*plant.u_alpha_beta) == pytest.approx(emf * held, rel=1e-6)


def test_coasting_machine_rectifies_only_above_the_bus_voltage():
    emf_line = math.sqrt(3.0) * MACHINE.pole_pairs * 200.0 * MACHINE.magnet_flux_wb
    powers = []
    for u_dc in (1.02 * emf_line, 0.8 * emf_line):
        plant = SwitchingPlant(MACHINE, mode=IMPOSED_SPEED, omega_m=200.0)
        power = 0.0
        for _ in range(300):
            plant.advance([], [], u_dc, 200.0, PERIOD)
            power += plant.state[layout.P_IN] / 300
        powers.append(power)
    assert abs(powers[0]) < 1e-4
    assert powers[1] < -10.0


def test_flux_balance_holds_every_period():
    """psi(T) - psi(0) = T (u_mean - R mean(i)), to rounding, whatever the inverter does."""
    inverter = Inverter(2e-6, 1.1, 0.9, 0.05, 0.04, 0.1)
    plants = [AveragedPlant(SATURATED, inverter), SwitchingPlant(SATURATED, inverter)]
    for plant in plants:
        for _ in range(100):
            before = plant.state[:2].copy()
            duties = duties_for(plant.theta_e, -5.0, 30.0)
            if isinstance(plant, AveragedPlant):
                plant.advance(duties, U_DC, 0.5, PERIOD)
            else:
                plant.advance(*centred_gates(duties, 2e-6, PERIOD), U_DC, 0.5, PERIOD)
            mean = plant.state[layout.I_ALPHA_MEAN : layout.I_BETA_MEAN + 1]
            change = PERIOD * (plant.u_alpha_beta - SATURATED.resistance_ohm * mean)
            assert plant.state[:2] - before == pytest.approx(change, abs=1e-14)


def test_temperatures_act_on_resistance_and_magnet():
    machine = replace(
        MACHINE,
        resistance_temp_coeff_per_k=0.0039,
        magnet_temp_coeff_per_k=-0.001,
        temperature_winding_c=80.0,
        temperature_magnet_c=70.0,
    )
    plant = AveragedPlant(machine, mode=IMPOSED_SPEED)
    assert plant.lambda_dq[0] == pytest.approx(0.165 * (1 - 0.05), rel=1e-15)
    for _ in range(3000):
        plant.advance(duties_for(0.0, 10.0, 0.0), U_DC, 0.0, PERIOD)
    hot = machine.resistance_ohm * (1 + 0.0039 * 60)
    assert plant.i_dq[0] == pytest.approx(10.0 / hot, rel=1e-12)


def test_unequal_phase_resistances_at_standstill():
    machine = replace(MACHINE, phase_resistance_asymmetry=(0.1, -0.05, 0.02))
    plant = AveragedPlant(machine, mode=IMPOSED_SPEED)
    for _ in range(4000):
        plant.advance(duties_for(0.0, 6.0, 3.0), U_DC, 0.0, PERIOD)
    r = machine.resistance_ohm * (1.0 + np.array(machine.phase_resistance_asymmetry))
    # Star point floats: solve u_k - n = r_k i_k with sum(i) = 0.
    u = (duties_for(0.0, 6.0, 3.0) - 0.5) * U_DC
    star = np.sum(u / r) / np.sum(1.0 / r)
    assert plant.i_abc == pytest.approx((u - star) / r, abs=1e-10)
