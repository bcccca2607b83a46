# SPDX-License-Identifier: BSD-3-Clause
"""Flux and energy of saturated and harmonic machines.

Every tolerance states where it comes from.  "Rounding" means: nothing but double precision over the number of
steps taken.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.plant_machines import HARMONIC, MACHINE, PERIOD, SATURATED, U_DC, duties_for
from fluxproof.plant import IMPOSED_SPEED, AveragedPlant, flux_from_currents, layout, machine_params


@pytest.mark.parametrize("i_d", [-4.0, 0.0, 3.0])
@pytest.mark.parametrize("i_q", [-4.0, 0.5, 5.0])
def test_flux_is_reciprocal(i_d, i_q):
    m, step = machine_params(SATURATED), 1e-4
    psi = {
        (a, b): flux_from_currents(m, MACHINE.magnet_flux_wb, i_d + a * step, i_q + b * step)
        for a, b in ((0, 1), (0, -1), (1, 0), (-1, 0))
    }
    d_by_q = (psi[0, 1][0] - psi[0, -1][0]) / (2 * step)
    q_by_d = (psi[1, 0][1] - psi[-1, 0][1]) / (2 * step)
    # Central differences: step^2 x third derivative, and rounding 1e-16 / step.
    assert d_by_q == pytest.approx(q_by_d, abs=1e-10)
    if i_q != 0.5:
        assert abs(d_by_q) > 1e-4  # the effect is there


def test_small_currents_show_the_catalogue_terms():
    """psi_q = Lq (iq - s iq^3) - 2 c id iq and psi_d = Ld id + psi_m - c iq^2 to first order."""
    m = machine_params(SATURATED)
    i_d, i_q, c = -0.3, 0.4, SATURATED.cross_saturation_wb_per_a2
    psi_d, psi_q = flux_from_currents(m, MACHINE.magnet_flux_wb, i_d, i_q)
    first_d = MACHINE.inductance_d_h * (i_d - 0.003 * i_d**3) + MACHINE.magnet_flux_wb - c * i_q**2
    first_q = MACHINE.inductance_q_h * (i_q - 0.006 * i_q**3) - 2 * c * i_d * i_q
    # The terms are 1 % of the flux here, so their squares are 1e-4 of it.
    assert (psi_d, psi_q) == pytest.approx((first_d, first_q), abs=2e-6)


def field_energy(machine, psi):
    """Stored energy [J] of the functional model, from its documented W."""
    x = (psi[0] - machine.magnet_flux_wb) / machine.inductance_d_h
    y = psi[1] / machine.inductance_q_h
    c = machine.cross_saturation_wb_per_a2
    limit = machine.inductance_q_h / (4 * abs(c)) if c else math.inf
    r = x / math.sqrt(1.0 + (x / limit) ** 2)
    w = machine.inductance_d_h * (x**2 / 2 + machine.saturation_d_per_a2 * x**4 / 4)
    w += machine.inductance_q_h * (y**2 / 2 + machine.saturation_q_per_a2 * y**4 / 4)
    return 1.5 * (w + c * r * y**2)


@pytest.mark.parametrize("machine", [MACHINE, SATURATED, HARMONIC], ids=["linear", "saturated", "harmonics"])
def test_energy_is_conserved(machine):
    """Input = copper + field + kinetic + friction + load, over a start against a load."""
    plant = AveragedPlant(machine, substeps=8)
    psi_0, spent, friction = plant.lambda_dq, np.zeros(3), 0.0
    load_work = 0.0

    def bare(p):
        if not machine.emf_harmonics:
            return p.lambda_dq
        psi = p.lambda_dq
        for h in machine.emf_harmonics:
            angle = h.order * p.theta_m * machine.pole_pairs + h.phase_rad
            psi = psi - machine.magnet_flux_wb * np.array(
                [h.amplitude_d * math.cos(angle), h.amplitude_q * math.sin(angle)]
            )
        return psi

    psi_0 = bare(plant)
    for _ in range(400):
        w_0, theta_0 = plant.omega_m, plant.theta_m
        plant.advance(duties_for(plant.theta_e, -10.0, 60.0), U_DC, 1.0, PERIOD)
        spent += PERIOD * plant.state[layout.P_IN : layout.P_AIRGAP + 1]
        load_work += plant.theta_m - theta_0
        squared = (w_0**2 + w_0 * plant.omega_m + plant.omega_m**2) / 3
        friction += PERIOD * machine.viscous_friction_nms * squared
    supplied, copper, airgap = spent
    field = field_energy(machine, bare(plant)) - field_energy(machine, psi_0)
    kinetic = 0.5 * machine.inertia_kgm2 * plant.omega_m**2
    assert supplied > 1.0
    # Runge-Kutta quadrature of fourth order: 1e-8 of 10 J.
    assert supplied - copper - airgap == pytest.approx(field, abs=2e-7)
    # Friction is summed by this test with a speed linear in each period: 1e-5 of 0.1 J.
    assert airgap == pytest.approx(kinetic + load_work + friction, abs=2e-6)


def test_iron_loss_closes_the_power_balance():
    g, w_m = 1.0 / 800.0, 200.0
    machine = replace(MACHINE, iron_conductance_s=g)
    plant = AveragedPlant(machine, mode=IMPOSED_SPEED, omega_m=w_m, i_d=-1.0, i_q=3.0)
    assert plant.i_dq == pytest.approx([-1.0, 3.0], abs=1e-12)
    means = np.zeros(3)
    for k in range(4000):
        theta = machine.pole_pairs * (plant.theta_m + 0.5 * w_m * PERIOD)
        plant.advance(duties_for(theta, -40.0, 140.0), U_DC, w_m, PERIOD)
        if k >= 3000:
            means += plant.state[layout.P_IN : layout.P_AIRGAP + 1] / 1000
    loss = 1.5 * g * (machine.pole_pairs * w_m) ** 2 * np.sum(plant.lambda_dq**2)
    # The held voltage ripples by (w T)^2/8 = 8e-4, and the loss holds its mean square.
    assert means[0] - means[1] - means[2] == pytest.approx(loss, rel=2e-3)
