# SPDX-License-Identifier: BSD-3-Clause
"""The plant's transients against an independent simulator of the same machine."""

from dataclasses import replace

import numpy as np
import pytest
from motulator.drive.model import StiffMechanicalSystem, SynchronousMachine
from motulator.drive.utils import SynchronousMachinePars
from scipy.integrate import solve_ivp

from cocotb_tests.support.plant_machines import MACHINE, PERIOD, U_DC, clarke, duties_for
from fluxproof.plant import AveragedPlant


def motulator_run(machine, curve, voltages, load):
    """Currents (alpha, beta) and speed at the period ends, from motulator's machine and shaft."""
    pars = SynchronousMachinePars(
        n_p=machine.pole_pairs,
        R_s=machine.resistance_ohm,
        L_d=machine.inductance_d_h,
        L_q=machine.inductance_q_h,
        psi_f=machine.magnet_flux_wb,
    )
    motor = SynchronousMachine(pars, i_s=curve, psi_s0=machine.magnet_flux_wb)
    shaft = StiffMechanicalSystem(machine.inertia_kgm2, machine.viscous_friction_nms, lambda t: load)

    def outputs(t, y):
        motor.state.psi_s, motor.state.exp_j_theta_m = y[0], y[1]
        shaft.state.w_M, shaft.state.exp_j_theta_M = y[2].real, y[3]
        motor.set_outputs(t)
        shaft.set_outputs(t)
        motor.inp.w_M, shaft.inp.tau_M = shaft.out.w_M, motor.out.tau_M

    def rhs(t, y):
        outputs(t, y)
        return np.array(motor.rhs() + shaft.rhs(), dtype=complex)

    y, found = np.array([machine.magnet_flux_wb, 1, 0, 1], dtype=complex), []
    for k, u in enumerate(voltages):
        motor.inp.u_ss = u
        span = (k * PERIOD, (k + 1) * PERIOD)
        y = solve_ivp(rhs, span, y, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        outputs(span[1], y)
        found.append((motor.out.i_ss.real, motor.out.i_ss.imag, shaft.out.w_M))
    return np.array(found)


@pytest.mark.parametrize("saturated", [False, True], ids=["linear", "saturated"])
def test_transient_equals_motulator(saturated):
    """A start under load with a voltage step and a reversal, 60 ms, same stator-frame voltages."""
    machine = replace(MACHINE, saturation_q_per_a2=0.006) if saturated else MACHINE

    def curve(psi):
        x = (psi.real - machine.magnet_flux_wb) / machine.inductance_d_h
        y = psi.imag / machine.inductance_q_h
        return complex(x, y + 0.006 * y**3)

    plant, voltages, ours = AveragedPlant(machine), [], []
    for k in range(600):
        u_d, u_q = (-5.0, 40.0) if k < 200 else ((-20.0, 90.0) if k < 400 else (10.0, -30.0))
        duties = duties_for(plant.theta_e, u_d, u_q)
        plant.advance(duties, U_DC, 0.8, PERIOD)
        voltages.append(clarke(duties * U_DC))
        i = clarke(plant.i_abc)
        ours.append((i.real, i.imag, plant.omega_m))
    theirs = motulator_run(machine, curve if saturated else None, voltages, 0.8)
    gap = np.abs(np.array(ours) - theirs).max(axis=0)
    print(f"against motulator: currents {gap[:2].max():.1e} A, speed {gap[2]:.1e} rad/s")
    assert np.abs(theirs[:, :2]).max() > 8.0
    assert theirs[:, 2].max() > 50.0
    # Both integrate the same equations; theirs at 1e-11, ours with two steps a period (see
    # test_discretisation_error).  The bound leaves a factor of a few.
    assert gap[:2].max() < 2e-6
    assert gap[2] < 2e-6
