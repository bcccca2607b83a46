# SPDX-License-Identifier: BSD-3-Clause
"""What every effect of the catalogue keeps: one file, complete, with columns, parameters and keys of the plant."""

from __future__ import annotations

import ast
import importlib
import sys

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import recorded
from fluxproof.checkout import ROOT
from fluxproof.diagnosis import catalogue, diagnose, physics
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.cells import cells_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.effects.free_curve import free_columns
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.plant_keys import check_key, plain
from fluxproof.diagnosis.physics import known_effects
from fluxproof.plant import Harmonic

NOMINAL = load_nominal(PAPER)
NAMES = """
    dead_time resistance resistance_temperature magnet_flux magnet_temperature inductance_d inductance_q saturation
    cross_saturation iron_loss emf_harmonics delay sampling_skew encoder_offset encoder_eccentricity current_offset
    current_gain current_scale udc_gain phase_resistance_asymmetry cogging friction""".split()


def summary(answer) -> str:
    """The main parts of an answer, for the message of a failing test."""
    return f"{answer.verdict}: {answer.sentence} {answer.ambiguity} {answer.fit}"


@pytest.fixture(scope="module")
def view():
    """Steady blocks of a healthy drive."""
    return view_of(recorded(), NOMINAL)


SECOND = {"emf_harmonics": (Harmonic(2.0, 0.01, 0.01, 0.4),)}


@pytest.mark.parametrize("name", NAMES)
def test_catalogue_entries_are_complete(name):
    effect = CATALOGUE[name]
    assert effect.name == name and effect.title and effect.signature and effect.separated_by
    assert "=" in effect.equation
    assert effect.parameters and all(p.name.isidentifier() and p.unit and p.meaning for p in effect.parameters)
    assert np.isfinite(effect.floor(NOMINAL)) and effect.floor(NOMINAL) > 0.0


@pytest.mark.parametrize("name", NAMES)
def test_columns_of_an_effect_are_finite_and_nonzero(name, view):
    effect = CATALOGUE[name]
    core, every = effect.core(view), effect.columns(view)
    assert core and not set(core) & set(free_columns(effect, view)), "a coefficient of both"
    for key, column in every.items():
        assert column.keys() <= {"u", "sum", "torque"}, key
        assert all(np.isfinite(values).all() for values in column.values()), key
        assert any(np.abs(values).max() > 0.0 for values in column.values()), key
    # The coefficients give parameters that the entry declares, and keys of the plant.
    units = {p.name: p.unit for p in effect.parameters}
    for keys in (core, every):
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
from fluxproof.diagnosis.effects import FluxEffect, Parameter, one, sigma

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
    separated_by="rotation at zero current",
    parameters=(Parameter("order_2", "1", "amplitude relative to the magnet flux"),),
)
"""


def test_no_effect_is_named_outside_of_its_file():
    """Rules for one effect are attributes of it, so that a new one is one file; keys of drive.toml may sound alike.

    The example states which effects it hides: that is the truth of a recording, and no rule.
    """
    names = set(known_effects()) - set(vars(NOMINAL.sensors))
    for path in sorted((ROOT / "fluxproof" / "diagnosis").rglob("*.py")):
        if path.parent.name not in ("catalogue", "suspects", "example"):
            strings = {n.value for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Constant)}
            assert not {s for s in strings if isinstance(s, str)} & names, path


def test_free_columns_are_a_declared_set(view):
    """A free column is one of ``Cells.free``, whatever its key looks like."""
    cells = cells_of(view, CATALOGUE.values())
    for effect in CATALOGUE.values():
        free = {key for name, key in cells.free if name == effect.name}
        assert free == set(free_columns(effect, view)) and not free & set(effect.core(view))
        assert list(cells.columns[effect.name]) == list(effect.columns(view))
    for path in sorted((ROOT / "fluxproof" / "diagnosis").rglob("*.py")):
        assert '"~' not in path.read_text(), f"{path}: a mark of free columns that nothing sets"


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
    assert answer.verdict == "explained" and [e.name for e in answer.effects] == ["second_harmonic"], summary(answer)
    # Equal a_d cos and a_q sin are one forward-rotating harmonic.
    assert answer.effects[0].parameters["order_2"].value == pytest.approx(0.01, rel=0.1)


def test_a_recording_with_torque_is_not_asked_for_a_transducer():
    """A dyno sheet was told to record what its first column had."""
    assert "transducer" in CATALOGUE["current_scale"].experiment(torque=False)
    assert [e.name for e in CATALOGUE.values() if "transducer" in e.experiment(torque=True)] == []
