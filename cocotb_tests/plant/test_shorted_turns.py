# SPDX-License-Identifier: BSD-3-Clause
"""Shorted turns of a phase: the current of the short at rest, the energy, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from cocotb_tests.support.plant_machines import MACHINE, PERIOD, U_DC, duties_for
from fluxproof.plant import (
    IMPOSED_SPEED,
    AveragedPlant,
    Inverter,
    SwitchingPlant,
    centred_gates,
    layout,
    plant_params,
)

MU, LEAKAGE = 0.05, 2e-5
R = MACHINE.resistance_ohm
SHORTED = {"shorted_share": MU, "shorted_resistance_ohm": 0.1, "shorted_leakage_h": LEAKAGE}


@pytest.mark.parametrize("phase", [0, 1, 2])
def test_a_resting_short_is_a_resistor_over_its_turns(phase):
    """With direct voltage no flux moves: i_f = mu u_phase/(R_f + mu (1 - mu) R), and the windings carry the rest."""
    machine = replace(MACHINE, shorted_phase=phase, **SHORTED)
    u = 6.0 + 3.0j
    plant, healthy = (AveragedPlant(m, mode=IMPOSED_SPEED) for m in (machine, MACHINE))
    for _ in range(4000):
        for each in (plant, healthy):
            each.advance(duties_for(0.0, u.real, u.imag), U_DC, 0.0, PERIOD)
    axis = np.exp(2j * np.pi / 3 * phase)
    wanted = MU * (u * axis.conjugate()).real / (0.1 + MU * (1.0 - MU) * R)
    assert plant.state[layout.I_SHORT] == pytest.approx(wanted, rel=1e-12)
    extra = complex(*plant.i_dq) - complex(*healthy.i_dq)
    assert extra == pytest.approx(2.0 / 3.0 * MU * wanted * axis, abs=1e-10)


def test_the_energy_of_a_shorted_machine_balances():
    """Power in = copper with the short + air gap + what the fields of machine and short have gained."""
    machine = replace(MACHINE, shorted_phase=1, **SHORTED)
    plant = SwitchingPlant(
        machine, Inverter(2e-6, 1.1, 0.9, 0.05, 0.04, 0.1), IMPOSED_SPEED, max_step_s=2e-6, omega_m=150.0
    )

    def stored():
        x = (plant.lambda_dq[0] - machine.magnet_flux_wb) / machine.inductance_d_h
        y = plant.lambda_dq[1] / machine.inductance_q_h
        of_machine = 0.75 * (machine.inductance_d_h * x * x + machine.inductance_q_h * y * y)
        return of_machine + 0.5 * LEAKAGE * plant.state[layout.I_SHORT] ** 2

    before, work = stored(), np.zeros(3)
    for _ in range(400):
        edges = centred_gates(duties_for(machine.pole_pairs * plant.theta_m, -20.0, 110.0), 2e-6, PERIOD)
        plant.advance(*edges, U_DC, 150.0, PERIOD)
        work += PERIOD * plant.state[layout.P_IN : layout.P_AIRGAP + 1]
    supplied, copper, airgap = work
    assert abs(supplied) > 1.0 and abs(plant.state[layout.I_SHORT]) > 1.0
    # Runge-Kutta quadrature: (h/tau)^4/120 a step with h/tau = 2e-6/1.1e-4, below 1e-9 of some joules; what is left
    # is the work of a blocked leg's remaining current.
    assert supplied - copper - airgap == pytest.approx(stored() - before, abs=2e-6)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"shorted_share": 1.0}, "a short has"),
        ({"shorted_phase": 3}, "a short has"),
        ({"shorted_leakage_h": 0.0}, "shorted_leakage_h must be positive"),
        ({"shorted_leakage_h": 1e-6}, "time constant of the short"),
    ],
)
def test_a_short_that_is_none_is_refused(changes, said):
    with pytest.raises(ValueError, match=said):
        plant_params(replace(MACHINE, **(SHORTED | changes)))
