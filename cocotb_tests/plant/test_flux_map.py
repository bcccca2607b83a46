# SPDX-License-Identifier: BSD-3-Clause
"""Flux maps: a linear one equals the equations, a measured one inverts to its currents.

Every tolerance states where it comes from.  "Rounding" means: nothing but double precision over the number of
steps taken.
"""

import csv
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cocotb_tests.support.plant_machines import MACHINE, PERIOD, U_DC, duties_for, linear_map
from fluxproof.plant import IMPOSED_SPEED, AveragedPlant, FluxMap, Machine, initial_state, layout, plant_params, refresh


def test_flux_map_of_a_linear_machine_is_the_linear_machine():
    plain = AveragedPlant(MACHINE, substeps=4)
    mapped = AveragedPlant(replace(MACHINE, flux_map=linear_map()), substeps=4)
    for _ in range(300):
        duties = duties_for(plain.theta_e, -10.0, 40.0)
        plain.advance(duties, U_DC, 0.5, PERIOD)
        mapped.advance(duties, U_DC, 0.5, PERIOD)
    # Bicubic interpolation is exact for planes: rounding and Newton's 1e-11 cells.
    assert mapped.i_dq == pytest.approx(plain.i_dq, abs=1e-9)
    assert mapped.omega_m == pytest.approx(plain.omega_m, abs=1e-9)


def test_flux_map_extrapolates_linearly():
    machine = replace(MACHINE, flux_map=linear_map(limit=1.0))
    plant = AveragedPlant(machine, mode=IMPOSED_SPEED, i_d=5.0, i_q=-7.0)
    assert plant.i_dq == pytest.approx([5.0, -7.0], abs=1e-9)


def test_measured_flux_map_inverts_to_its_currents():
    folder = Path(os.environ.get("FLUXPROOF_RECORDINGS", Path(__file__).parents[3] / "shared" / "recordings"))
    file = folder / "brusa_flux_map" / "brusa_meas.csv"
    if not file.exists():
        pytest.skip("no measured flux map: set FLUXPROOF_RECORDINGS")
    with file.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    i_d, i_q, psi_d, psi_q, torque = (
        np.array([float(row[name]) for row in rows]) for name in ("id_A", "iq_A", "psid_Vs", "psiq_Vs", "torque_Nm")
    )
    measured = FluxMap.from_points(i_d, i_q, psi_d, psi_q)
    # The measurement folds around zero current: psi_d falls there while i_d rises.
    machine = Machine(5, 0.01, 1e-3, 1e-3, 0.05, 0.01, flux_map=measured)
    with pytest.raises(ValueError, match="no unique current"):
        plant_params(machine)
    mended = measured.mended()
    params = plant_params(replace(machine, flux_map=mended), mode=IMPOSED_SPEED)
    change = np.maximum(abs(mended.psi_d_wb - measured.psi_d_wb), abs(mended.psi_q_wb - measured.psi_q_wb))
    worst, kept = 0.0, 0
    for k in range(len(i_d)):
        at = np.searchsorted(mended.i_d_a, i_d[k]), np.searchsorted(mended.i_q_a, i_q[k])
        if change[at] > 0.0:
            continue
        state = initial_state(machine, params)  # Newton's start: zero current
        state[layout.LAMBDA_ALPHA], state[layout.LAMBDA_BETA] = psi_d[k], psi_q[k]
        refresh(state, params)
        worst = max(worst, abs(state[layout.I_D] - i_d[k]), abs(state[layout.I_Q] - i_q[k]))
        kept += 1
    print(f"measured map: {kept} of {len(i_d)} points untouched, others by {change.max() * 1e3:.1f} mVs")
    print(f"measured map: worst current after inversion {worst:.1e} A of 145 A")
    assert kept > 0.99 * len(i_d)
    assert worst < 1e-8  # Newton stops at 1e-11 of a 5 A cell
    # The flux was computed from voltages, the torque was measured on a shaft: not our error.
    cross = 1.5 * 5 * (psi_d * i_q - psi_q * i_d)
    print(f"torque from the map against the shaft: rms {np.sqrt(np.mean((cross - torque) ** 2)):.2f} Nm")
