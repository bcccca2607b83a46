# SPDX-License-Identifier: BSD-3-Clause
"""The diagnosis on the project's own plant: injected effects are named with their size, and nothing else is.

The recordings come from the golden core in closed loop on the switching plant (recordings/from_core.py): the current
controller hides every effect from the currents, as in a real drive.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import DRIVE, GRID, MACHINE, POINT, columns, recorded
from cocotb_tests.support.slow import slowly
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance.shaft import is_airgap
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.plant import Harmonic, flux_from_currents, machine_params

NOMINAL = load_nominal(PAPER)
RATED = DRIVE.machine.rated_current_a


def summary(answer) -> str:
    """The main parts of an answer, for the message of a failing test."""
    return f"{answer.verdict}: {answer.sentence} {answer.ambiguity} {answer.fit}"


def psi_change(**changes):
    """(psi_d, psi_q) at rated i_q of a changed machine minus those of the nominal one [Wb]."""
    fluxes = []
    for machine in (dataclasses.replace(MACHINE, **changes), MACHINE):
        fluxes.append(np.array(flux_from_currents(machine_params(machine), MACHINE.magnet_flux_wb, 0.0, RATED)))
    return fluxes[0] - fluxes[1]


SATURATED = {"saturation_q_per_a2": 0.01}
CROSSED = {"cross_saturation_wb_per_a2": 3e-4}
# effect: (deviations from the nominal drive, parameter, value, bound on its error)
CASES = {
    "resistance": (dict(machine={"resistance_ohm": 1.2 * 1.53}), "resistance_ohm", 1.836, 0.01 * 1.836),
    "magnet_flux": (dict(machine={"magnet_flux_wb": 0.15675}), "magnet_flux_wb", 0.15675, 0.005 * 0.15675),
    # 2 us of 100 us at 563 V
    "dead_time": (dict(dead_time_s=2e-6), "v_dead_v", 11.26, 0.08 * 11.26),  # a resistance is possible beside it
    "encoder_offset": (dict(sensors={"position_offset_rad": 0.03 / 4}), "offset_rad", 0.03, 0.02 * 0.03),
    "saturation": (
        dict(machine=SATURATED), "psi_q_change_at_rated_wb", psi_change(**SATURATED)[1], 0.06 * 0.0133,
    ),
    "cross_saturation": (
        dict(machine=CROSSED), "cross_saturation_wb_per_a2", -psi_change(**CROSSED)[0] / RATED**2, 0.06 * 3e-4,
    ),
    "current_gain": (dict(sensors={"current_gain_error": (0.02, -0.01, -0.01)}), "gain_a", 0.02, 0.001),
    "iron_loss": (dict(machine={"iron_conductance_s": 1 / 800.0}), "iron_resistance_ohm", 800.0, 0.04 * 800.0),
}  # fmt: skip


def test_a_healthy_drive_has_no_mismatch():
    answer = diagnose(recorded(), NOMINAL)
    assert answer.verdict == "no_mismatch" and not answer.effects and not answer.ambiguity, summary(answer)
    assert answer.fit.holdout_before < 0.2, summary(answer)
    assert answer.rows == len(GRID) * 800 and answer.problems == ()


@pytest.mark.parametrize("name", [n if n in ("dead_time", "encoder_offset") else slowly(n) for n in CASES])
def test_an_effect_is_named_with_its_size(name):
    deviation, parameter, value, bound = CASES[name]
    answer = diagnose(recorded(**deviation), NOMINAL)
    assert answer.verdict == "explained" and [e.name for e in answer.effects] == [name], summary(answer)
    estimate = answer.effects[0].parameters[parameter]
    assert abs(estimate.value - value) < bound, (estimate, value)
    assert 0.0 < estimate.sigma < bound and answer.effects[0].explains > 0.9
    # These operating points were held out.
    assert answer.fit.holdout_after < 0.5 * answer.fit.holdout_before, summary(answer)


@pytest.mark.slow
def test_device_drops_are_identified():
    answer = diagnose(recorded(inverter={"v_switch_v": 1.5, "v_diode_v": 1.5}), NOMINAL)
    assert answer.verdict == "explained" and [e.name for e in answer.effects] == ["dead_time"], summary(answer)
    assert answer.effects[0].parameters["v_dead_v"].value == pytest.approx(1.5, rel=0.03)


@pytest.mark.slow
def test_noise_floor_equals_the_noise():
    """Whatever the effect, the same converters with the same noise made the recording."""
    healthy, saturated = (diagnose(recorded(machine=m), NOMINAL).fit.noise_floor for m in (None, SATURATED))
    assert 0.5 * healthy < saturated < 2.0 * healthy, (healthy, saturated)


def test_two_effects_are_separated():
    answer = diagnose(recorded(machine={"resistance_ohm": 1.836, "magnet_flux_wb": 0.15675}), NOMINAL)
    found = {e.name: e.parameters for e in answer.effects}
    assert answer.verdict == "explained" and set(found) == {"resistance", "magnet_flux"}, summary(answer)
    assert found["resistance"]["resistance_ohm"].value == pytest.approx(1.836, rel=0.01)
    assert found["magnet_flux"]["magnet_flux_wb"].value == pytest.approx(0.15675, rel=0.005)


@pytest.mark.parametrize("effect", ["magnet_flux", slowly("resistance"), slowly("encoder_offset")])
def test_one_operating_point_never_asserts_a_wrong_name(effect):
    answer = diagnose(recorded(POINT, **CASES[effect][0]), NOMINAL)
    asserted = {e.name for e in answer.effects}
    assert asserted <= {effect}, summary(answer)
    assert answer.verdict in ("ambiguous", "explained", "unexplained"), summary(answer)
    if answer.verdict == "ambiguous":
        assert asserted or any(effect in group for group in answer.ambiguity), summary(answer)
        assert answer.next_recording, summary(answer)


SECOND = {"emf_harmonics": (Harmonic(2.0, 0.01, 0.01, 0.4),)}


def test_an_effect_outside_the_catalogue_is_unknown():
    answer = diagnose(recorded(machine=SECOND), NOMINAL)
    assert answer.verdict == "unexplained" and not answer.effects and not answer.ambiguity, summary(answer)
    assert answer.location.orders[0].order == 2.0, answer.location
    term = answer.unknown_term
    assert "2 theta_e" in term.formula or "8 theta_m" in term.formula, term  # the same with four pole pairs
    # u = d psi / dt of psi = 0.01 psi_m exp(3 j theta_e) in the stator frame
    assert "c * omega *" in term.formula and term.unit == "V s/rad", term
    assert term.value == pytest.approx(3 * 0.01 * 0.165, rel=0.1) and 0.0 < term.sigma < 0.05 * term.value, term
    assert term.explains > 0.9, term


def test_at_the_noise_floor_nothing_is_named():
    """A resistance that is 1 % off is seen in the mean of many blocks, but stands above the noise of none: possible."""
    off = {"resistance_ohm": 1.0105 * MACHINE.resistance_ohm}
    answer = diagnose(recorded(machine=off), load_nominal(PAPER))
    assert answer.fit.train_before < 1.2 * answer.fit.noise_floor
    assert answer.verdict == "no_mismatch" and not answer.effects and not answer.ambiguity, answer.sentence
    (note,) = [n for n in answer.notes if "but recording and simulation already agree within noise" in n]
    assert note.startswith("Winding resistance")


def test_transducer_torque_is_not_mistaken_for_air_gap_torque():
    """The inertial torque is noise at steady speed and must not decide which torque was recorded."""
    rng = np.random.default_rng(5)
    omega_m = np.repeat([-60.0, -20.0, 20.0, 60.0], 500)
    drag, gap = 0.009 * omega_m, rng.uniform(-50.0, 50.0, omega_m.size)
    noise = rng.normal(0.0, 0.05, omega_m.size)
    assert not is_airgap(gap - drag + noise, gap, drag)
    assert is_airgap(gap + noise, gap, drag)
    # At one speed a torque missing in the model may equal the drag.
    one = omega_m == 60.0
    assert not is_airgap((gap - drag + noise + 0.5)[one], gap[one], drag[one])


# 54: 27 slots and an odd number of pole pairs; 2.25: nine slots that are not alike
@pytest.mark.parametrize("order", [2.25, slowly(12), slowly(54)])
def test_torque_ripple_amplitude_is_independent_of_speed_and_direction(order):
    """The transducer is sampled with the currents, the balance is made between samples: 4 % at these speeds."""
    table = dict(columns(GRID))
    theta, p = table["theta_e"], MACHINE.pole_pairs
    alpha = (2.0 * table["i_a"] - table["i_b"] - table["i_c"]) / 3.0
    beta = (table["i_b"] - table["i_c"]) / np.sqrt(3.0)
    i_d, i_q = alpha * np.cos(theta) + beta * np.sin(theta), beta * np.cos(theta) - alpha * np.sin(theta)
    psi = MACHINE.magnet_flux_wb + (MACHINE.inductance_d_h - MACHINE.inductance_q_h) * i_d
    drag = MACHINE.viscous_friction_nms * table["omega_e"] / p
    table["torque"] = 1.5 * p * psi * i_q - drag + 0.4 * np.sin(order * np.unwrap(theta) + 0.7)
    answer = diagnose(from_columns(table, DRIVE.sample_time_s), PAPER)
    assert [e.name for e in answer.effects] == ["cogging"], summary(answer)
    found = answer.effects[0].parameters
    assert found["cogging_order"].value == order * p
    assert found["cogging_nm"].value == pytest.approx(0.4, rel=0.01)


@pytest.mark.slow
def test_rotation_at_zero_current_is_diagnosed():
    """Effects that need current have no column then, and the search must handle this."""
    plan = tuple((speed, 0.0, 0.0) for speed in (160.0, -160.0, 80.0, -80.0, 40.0, -40.0, 120.0, -120.0))
    weak = 0.9 * MACHINE.magnet_flux_wb
    answer = diagnose(recorded(plan, machine={"magnet_flux_wb": weak}), PAPER)
    assert answer.verdict in ("explained", "ambiguous"), summary(answer)
    assert not {e.name for e in answer.effects} - {"magnet_flux"}, summary(answer)
    assert "magnet_flux" in {e.name for e in answer.effects} | {n for group in answer.ambiguity for n in group}


def test_arrays_are_checked_like_a_file():
    """A simulation that diverged gave currents of 1e17 A; their balances had no finite noise, and the search failed."""
    table = {name: values.copy() for name, values in columns(GRID).items()}
    for name in ("i_a", "i_b", "i_c"):
        table[name][10:] = -3e17
    before = {name: values.copy() for name, values in table.items()}
    answer = diagnose(from_columns(table, DRIVE.sample_time_s), PAPER)
    assert answer.verdict == "bad_recording"
    assert "column i_a:" in answer.sentence and "from row 10" in answer.sentence
    assert all(np.array_equal(table[name], values) for name, values in before.items()), "the arrays were changed"
