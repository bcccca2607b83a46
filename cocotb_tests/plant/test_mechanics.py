# SPDX-License-Identifier: BSD-3-Clause
"""The shaft against closed forms: coasting, friction, cogging, load profiles."""

import math
from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.plant_machines import HARMONIC, MACHINE, PERIOD, U_DC
from fluxproof.plant import IMPOSED_SPEED, AveragedPlant, SwitchingPlant, profile, profile_at


def test_coast_down_is_exponential_with_viscous_friction():
    plant = SwitchingPlant(MACHINE, omega_m=150.0)
    for k in range(1, 301):
        plant.advance([], [], U_DC, 0.0, PERIOD)
        tau = MACHINE.inertia_kgm2 / MACHINE.viscous_friction_nms
        # Currents below 1e-7 A make below 1e-7 Nm.
        assert plant.omega_m == pytest.approx(150.0 * math.exp(-k * PERIOD / tau), abs=1e-5)


def test_coulomb_friction_stops_the_shaft_and_holds_it():
    machine = replace(MACHINE, coulomb_friction_nm=0.2, magnet_flux_wb=1e-9)
    plant = AveragedPlant(machine, omega_m=2.0)
    b, tc = machine.viscous_friction_nms, machine.coulomb_friction_nm
    tau = machine.inertia_kgm2 / b
    stop = tau * math.log(1.0 + b * 2.0 / tc)
    travel = tau * (2.0 - tc / b * math.log(1.0 + b * 2.0 / tc))
    while plant.time < 2 * stop:
        plant.advance([0.5] * 3, U_DC, 0.0, PERIOD)
        if plant.time < stop:
            expected = (2.0 + tc / b) * math.exp(-plant.time / tau) - tc / b
            assert plant.omega_m == pytest.approx(expected, abs=1e-9)
    assert plant.omega_m == 0.0
    assert plant.theta_m == pytest.approx(travel, abs=1e-7)  # one sub-step: w' h^2 / 2
    for load, moves in ((0.19, False), (-0.19, False), (0.21, True)):
        still = AveragedPlant(machine)
        for _ in range(50):
            still.advance([0.5] * 3, U_DC, load, PERIOD)
        assert (still.omega_m != 0.0) == moves
        assert still.omega_m <= 0.0


def test_cogging_and_harmonic_torque_at_standstill():
    machine = replace(HARMONIC, cogging_amplitude_nm=0.1, cogging_order=24, cogging_phase_rad=0.2)
    for theta in np.linspace(0.0, 1.0, 7):
        plant = AveragedPlant(machine, mode=IMPOSED_SPEED, theta_m=theta, i_d=-1.0, i_q=2.0)
        angle = machine.pole_pairs * theta
        expected = 0.1 * math.sin(24 * theta + 0.2)
        psi, psi_m = plant.lambda_dq, machine.magnet_flux_wb
        expected += 6.0 * (psi[0] * 2.0 - psi[1] * -1.0)
        for h in machine.emf_harmonics:
            n = h.order * angle + h.phase_rad
            slope = h.amplitude_d * math.sin(n) + h.amplitude_q * math.cos(n) * 2.0
            expected += 6.0 * h.order * psi_m * slope
        assert plant.torque == pytest.approx(expected, abs=1e-12)


def test_profiles():
    held, joined = profile([0.0, 1.0], [2.0, 4.0]), profile([0.0, 1.0], [2.0, 4.0], linear=True)
    assert [profile_at(held, t) for t in (-1.0, 0.5, 1.0, 3.0)] == [2.0, 2.0, 4.0, 4.0]
    assert [profile_at(joined, t) for t in (-1.0, 0.5, 1.0, 3.0)] == [2.0, 3.0, 4.0, 4.0]
