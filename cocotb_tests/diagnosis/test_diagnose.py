# SPDX-License-Identifier: BSD-3-Clause
"""The diagnosis on the project's own plant: injected effects are named with their size, and nothing else is.

The recordings come from the golden core in closed loop on the switching plant (diagnosed_drives.py): the current
controller hides every effect from the currents, as in a real drive.
"""

from __future__ import annotations

import ast
import dataclasses
import importlib
import sys

import numpy as np
import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import DRIVE, GRID, MACHINE, POINT, columns, recorded
from cocotb_tests.support.slow import slowly
from fluxproof.checkout import ROOT
from fluxproof.diagnosis import catalogue, diagnose, physics
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.shaft import is_airgap
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.plant_keys import check_key, plain
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.physics import known_effects
from fluxproof.plant import Harmonic, flux_from_currents, machine_params

NOMINAL = load_nominal(PAPER)
RATED = DRIVE.machine.rated_current_a
NAMES = """
    dead_time resistance resistance_temperature magnet_flux magnet_temperature inductance_d inductance_q saturation
    cross_saturation iron_loss emf_harmonics delay sampling_skew encoder_offset encoder_eccentricity current_offset
    current_gain current_scale udc_gain phase_resistance_asymmetry cogging friction""".split()


def summary(answer) -> str:
    """The main parts of an answer, for the message of a failing test."""
    return f"{answer.verdict}: {answer.sentence} {answer.ambiguity} {answer.fit}"


def psi_change(**changes):
    """(psi_d, psi_q) at rated i_q of a changed machine minus those of the nominal one [Wb]."""
    fluxes = []
    for machine in (dataclasses.replace(MACHINE, **changes), MACHINE):
        fluxes.append(
            np.array(flux_from_currents(machine_params(machine), MACHINE.magnet_flux_wb, 0.0, RATED))
        )
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


@pytest.fixture(scope="module")
def view():
    """Steady blocks of a healthy drive."""
    return view_of(recorded(), NOMINAL)


def test_a_healthy_drive_has_no_mismatch():
    answer = diagnose(recorded(), NOMINAL)
    assert answer.verdict == "no_mismatch" and not answer.effects and not answer.ambiguity, summary(answer)
    assert answer.fit.holdout_before < 0.2, summary(answer)
    assert answer.rows == len(GRID) * 800 and answer.problems == []


@pytest.mark.parametrize("name", CASES)
def test_an_effect_is_named_with_its_size(name):
    deviation, parameter, value, bound = CASES[name]
    answer = diagnose(recorded(**deviation), NOMINAL)
    assert answer.verdict == "explained" and [e.name for e in answer.effects] == [name], summary(answer)
    estimate = answer.effects[0].parameters[parameter]
    assert abs(estimate.value - value) < bound, (estimate, value)
    assert 0.0 < estimate.sigma < bound and answer.effects[0].explains > 0.9
    # These operating points were held out.
    assert answer.fit.holdout_after < 0.5 * answer.fit.holdout_before, summary(answer)


def test_device_drops_are_identified():
    answer = diagnose(recorded(inverter={"v_switch_v": 1.5, "v_diode_v": 1.5}), NOMINAL)
    assert answer.verdict == "explained" and [e.name for e in answer.effects] == ["dead_time"], summary(answer)
    assert answer.effects[0].parameters["v_dead_v"].value == pytest.approx(1.5, rel=0.03)


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
    assert term.value == pytest.approx(3 * 0.01 * 0.165, rel=0.1) and 0.0 < term.sigma < 0.05 * term.value, (
        term
    )
    assert term.explains > 0.9, term


@pytest.mark.parametrize("name", NAMES)
def test_catalogue_entries_are_complete(name):
    effect = CATALOGUE[name]
    assert effect.name == name and effect.title and effect.signature and effect.separated_by
    assert "=" in effect.equation
    assert effect.confounders and set(effect.confounders) <= set(CATALOGUE) - {name}
    assert effect.parameters and all(
        p.name.isidentifier() and p.unit and p.meaning for p in effect.parameters
    )
    assert np.isfinite(effect.floor(NOMINAL)) and effect.floor(NOMINAL) > 0.0


@pytest.mark.parametrize("name", NAMES)
def test_columns_of_an_effect_are_finite_and_nonzero(name, view):
    effect = CATALOGUE[name]
    core = effect.core(view)
    assert core
    for key, column in (core | effect.free(view)).items():
        assert column.keys() <= {"u", "sum", "torque"}, key
        assert all(np.isfinite(values).all() for values in column.values()), key
        assert any(np.abs(values).max() > 0.0 for values in column.values()), key
    # The coefficients give parameters that the entry declares, and keys of the plant.
    units = {p.name: p.unit for p in effect.parameters}
    for keys in (core, core | effect.free(view)):
        c = dict.fromkeys(keys, 1e-3)
        found = effect.estimates(c, np.eye(len(c)) * 1e-8, NOMINAL)
        assert found and found.keys() <= units.keys()
        assert all(np.isfinite(e.value) and e.sigma >= 0.0 and e.unit == units[k] for k, e in found.items())
        assert effect.size(c, NOMINAL) > 0.0
        for key, value in effect.plant(c, NOMINAL).items():
            check_key(key)
            plain(key, value)


def test_every_effect_of_the_issue_has_a_file_of_its_own():
    assert set(NAMES) <= set(CATALOGUE)
    for name in CATALOGUE:
        assert (ROOT / "fluxproof" / "diagnosis" / "catalogue" / f"{name}.py").is_file()


NEW_EFFECT = """
import numpy as np
from fluxproof.diagnosis.effects.effect import FluxEffect, Parameter, one, sigma

class SecondHarmonic(FluxEffect):
    def core_psi(self, view):
        turn = np.exp(2j * view.theta)
        waves = {"fc": turn, "fs": 1j * turn, "bc": np.conj(turn), "bs": 1j * np.conj(turn)}
        return {key: view.machine.magnet_flux_wb * wave for key, wave in waves.items()}

    def floor(self, nominal):
        return 0.001

    def size(self, c, nominal):
        return float(np.sqrt(sum(v**2 for v in c.values())))

    def estimates(self, c, covariance, nominal):
        return one("order_2", "1", self.size(c, nominal), sigma(covariance))

EFFECT = SecondHarmonic(
    name="second_harmonic", title="second harmonic of the magnet flux",
    equation="psi = psi_m (1 + a exp(2j theta))", signature="order 2 in dq, proportional to speed",
    confounders=("current_gain",), separated_by="rotation at zero current",
    parameters=(Parameter("order_2", "1", "amplitude relative to the magnet flux"),),
)
"""


def test_at_the_noise_floor_nothing_is_named():
    """A resistance that is 1 % off is seen in the mean of many blocks, but stands above the noise of none: possible."""
    off = {"resistance_ohm": 1.0105 * MACHINE.resistance_ohm}
    answer = diagnose(recorded(machine=off), load_nominal(PAPER))
    assert answer.fit.train_before < 1.2 * answer.fit.noise_floor
    assert answer.verdict == "no_mismatch" and not answer.effects and not answer.ambiguity, answer.sentence
    (note,) = [n for n in answer.notes if "but recording and simulation already agree within noise" in n]
    assert note.startswith("Winding resistance")


def test_no_effect_is_named_outside_of_its_file():
    """Rules for one effect are attributes of it, so that a new one is one file; keys of drive.toml may sound alike."""
    names = set(known_effects()) - set(vars(NOMINAL.sensors))
    for path in sorted((ROOT / "fluxproof" / "diagnosis").rglob("*.py")):
        if path.parent.name not in ("catalogue", "suspects"):
            strings = {n.value for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Constant)}
            assert not {s for s in strings if isinstance(s, str)} & names, path


def test_a_new_file_is_a_new_effect(tmp_path, monkeypatch):
    """A misfit that was unknown above is named after one file is added; nothing else changes."""
    (tmp_path / "second_harmonic.py").write_text(NEW_EFFECT)
    monkeypatch.setattr(catalogue, "__path__", [*catalogue.__path__, str(tmp_path)])
    importlib.invalidate_caches()
    try:
        grown = catalogue.found_in(catalogue.__name__, catalogue.__path__)
        assert set(grown) == set(CATALOGUE) | {"second_harmonic"}
        monkeypatch.setattr(physics, "CATALOGUE", grown)
        answer = diagnose(recorded(machine=SECOND), NOMINAL)
    finally:
        sys.modules.pop(f"{catalogue.__name__}.second_harmonic", None)
        vars(catalogue).pop("second_harmonic", None)
    assert answer.verdict == "explained" and [e.name for e in answer.effects] == ["second_harmonic"], summary(
        answer
    )
    # Equal a_d cos and a_q sin are one forward-rotating harmonic.
    assert answer.effects[0].parameters["order_2"].value == pytest.approx(0.01, rel=0.1)


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
