# SPDX-License-Identifier: BSD-3-Clause
"""Steps fine enough, effects of size zero absent, and fast enough."""

import time
from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from cocotb_tests.support.plant_machines import HARMONIC, MACHINE, PERIOD, SATURATED, U_DC, duties_for
from fluxproof.plant import (
    FREE,
    IMPOSED_SPEED,
    AveragedPlant,
    Harmonic,
    Inverter,
    SwitchingPlant,
    advance_averaged,
    centred_gates,
    initial_state,
    layout,
    plant_params,
    state_names,
)


def test_discretisation_error():
    """Two sub-steps against twenty, at full speed: far below a 16-bit converter's 0.3 mA."""
    worst = {}
    for name, machine in (("linear", MACHINE), ("saturated", SATURATED), ("harmonics", HARMONIC)):
        coarse = AveragedPlant(machine, substeps=2, omega_m=300.0)
        fine = AveragedPlant(machine, substeps=20, omega_m=300.0)
        gap = 0.0
        for _ in range(1000):
            theta = machine.pole_pairs * (fine.theta_m + 0.5 * PERIOD * fine.omega_m)
            duties = duties_for(theta, -60.0, 190.0)
            coarse.advance(duties, U_DC, 1.0, PERIOD)
            fine.advance(duties, U_DC, 1.0, PERIOD)
            gap = max(gap, np.abs(coarse.i_abc - fine.i_abc).max())
        worst[name] = gap
    print("discretisation:", {name: f"{gap:.1e} A" for name, gap in worst.items()})
    assert worst["linear"] < 1e-5
    assert max(worst.values()) < 5e-5


@pytest.mark.parametrize("case", ["conducting", "clamped", "random gates"])
def test_switching_discretisation_error(case):
    """Steps of 10 us against 1 us, also where legs block and are released all the time."""
    rng = np.random.default_rng(3)
    inverter = Inverter(0.0, 1.5, 0.8, 0.1, 0.05)
    start = {"mode": IMPOSED_SPEED, "omega_m": 100.0}
    coarse = SwitchingPlant(MACHINE, inverter, **start)
    fine = SwitchingPlant(MACHINE, inverter, max_step_s=1e-6, **start)
    allowed = [word for word in range(64) if not word & (word >> 3)]
    gap = 0.0
    for _ in range(300):
        theta = MACHINE.pole_pairs * (fine.theta_m + 0.5 * PERIOD * 100.0)
        emf = MACHINE.pole_pairs * 100.0 * MACHINE.magnet_flux_wb
        if case == "random gates":
            edges = np.sort(rng.uniform(0.0, PERIOD, 5)), rng.choice(allowed, 5)
        else:
            u_q = emf + (0.5 if case == "clamped" else 20.0)
            edges = centred_gates(duties_for(theta, 0.0, u_q), 4e-6, PERIOD)
        coarse.advance(*edges, U_DC, 100.0, PERIOD)
        fine.advance(*edges, U_DC, 100.0, PERIOD)
        gap = max(gap, np.abs(coarse.i_abc - fine.i_abc).max())
    print(f"switching, {case}: {gap:.1e} A")
    # A leg is released at the start of a step instead of within it: e w h^2 / 8 L = 3e-5 A.
    assert gap < 1e-4


ABSENT = {
    "temperature without coefficient": {"temperature_winding_c": 90.0, "temperature_magnet_c": 60.0},
    "coefficient at reference": {"resistance_temp_coeff_per_k": 0.0039, "magnet_temp_coeff_per_k": -0.001},
    "harmonics of no amplitude": {"emf_harmonics": (Harmonic(6, 0.0, 0.0, 0.3), Harmonic(12))},
    "cogging of no amplitude": {"cogging_order": 24, "cogging_phase_rad": 0.5},
    "a short without turns": {"shorted_phase": 1, "shorted_resistance_ohm": 0.1, "shorted_leakage_h": 1e-5},
    "explicit zeros": {
        "coulomb_friction_nm": 0.0,
        "saturation_d_per_a2": 0.0,
        "saturation_q_per_a2": 0.0,
        "cross_saturation_wb_per_a2": 0.0,
        "iron_conductance_s": 0.0,
        "phase_resistance_asymmetry": (0.0, 0.0, 0.0),
        "flux_map": None,
    },
}


def short_run(machine, inverter=None, kind=AveragedPlant):
    """Final state of 50 periods of a start."""
    plant = kind(machine, inverter)
    for k in range(50):
        duties = duties_for(0.02 * k, -5.0, 40.0)
        if kind is AveragedPlant:
            plant.advance(duties, U_DC, 0.1, PERIOD)
        else:
            plant.advance(*centred_gates(duties, 1e-6, PERIOD), U_DC, 0.1, PERIOD)
    plant.state[layout.TEMP_WINDING] = plant.state[layout.TEMP_MAGNET] = 0.0
    return plant.state


@pytest.mark.parametrize("kind", [AveragedPlant, SwitchingPlant])
@pytest.mark.parametrize("absent", ABSENT.values(), ids=ABSENT.keys())
def test_zero_effect_equals_an_absent_one_bit_exactly(absent, kind):
    assert (short_run(replace(MACHINE, **absent), kind=kind) == short_run(MACHINE, kind=kind)).all()


def test_zero_inverter_error_equals_an_absent_one_bit_exactly():
    for inverter in (Inverter(), Inverter(zero_current_a=0.3)):
        assert (short_run(MACHINE, inverter) == short_run(MACHINE)).all()


def test_state_names_cover_the_state():
    assert sorted(state_names().values()) == list(range(layout.STATE_SIZE))


@njit
def _loop(state, params, periods):
    duties = np.array([0.5, 0.53, 0.47])
    for _ in range(periods):
        advance_averaged(state, params, duties, 563.0, 0.0, 1e-4)


def test_speed():
    """The averaged plant leaves room for 100,000 control periods a second (measured: 690,000)."""
    params = plant_params(MACHINE, Inverter(2e-6, 1.0, 1.0, 0.1, 0.1, 0.05), FREE)
    state = initial_state(MACHINE, params)
    _loop(state, params, 1)
    start = time.process_time()  # its own: what else the machine does is no property of the plant
    _loop(state, params, 100_000)
    rate = 100_000 / (time.process_time() - start)
    print(f"averaged plant: {rate:,.0f} periods/s")
    plant = SwitchingPlant(MACHINE)
    edges = centred_gates(duties_for(0.0, 5.0, 5.0), 2e-6, PERIOD)
    plant.advance(*edges, U_DC, 0.0, PERIOD)
    start = time.perf_counter()
    for _ in range(500):
        plant.advance(*edges, U_DC, 0.0, PERIOD)
    print(f"switching plant: {(time.perf_counter() - start) / 500 * 1e6:.0f} us a period")
    assert rate > 100_000  # a factor of seven for a loaded machine
