"""Generators written by others: deterministic, independent of the catalogue, and each fault really in the data."""

from __future__ import annotations

import ast
import dataclasses
from pathlib import Path

import numpy as np
import pytest

from fluxproof.checkout import ROOT
from studies.blind import __main__ as blind
from studies.blind import reliability
from studies.blind.strangers import cases
from studies.blind.strangers.faults import FAULTS, UNKNOWN

GENERATORS = sorted(cases.GENERATORS)


def _short(case):
    """The same case with its first two operating points only."""
    return dataclasses.replace(case, plan=dataclasses.replace(case.plan, points=case.plan.points[:2], rows=300))


def test_no_stranger_imports_the_catalogue_or_its_plant():
    imported = set()
    for path in sorted((Path(ROOT) / "studies/blind/strangers").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            imported |= set(names + ([node.module] if isinstance(node, ast.ImportFrom) else []))
    of_the_project = {n for n in imported if n.split(".")[0] in ("fluxproof", "diagnosis", "plant", "golden_model")}
    assert of_the_project <= {"fluxproof.files"}, of_the_project
    assert {"motulator", "gym_electric_motor"} <= {n.split(".")[0] for n in imported}


@pytest.mark.parametrize("generator", GENERATORS)
def test_every_fault_and_unknown_is_drawn(generator):
    missing, unknown = cases.GENERATORS[generator]
    singles = {cases.make(generator, 3, n, "single", n).effects[0]["name"] for n in range(40)}
    assert singles == set(FAULTS) - missing
    kinds = {cases.make(generator, 3, n, "unknown", n).kind for n in range(40)}
    assert kinds == set(UNKNOWN) - unknown


@pytest.mark.parametrize("generator", GENERATORS)
def test_a_seed_gives_the_same_recording_and_another_seed_does_not(generator):
    def columns(seed):
        return cases.columns_of(_short(cases.make(generator, seed, 4, "healthy", 0)), seed, 4)

    one, same, other = columns(5), columns(5), columns(6)
    assert all(np.array_equal(one[name], same[name], equal_nan=True) for name in one)
    assert len(one["t"]) != len(other["t"]) or not np.array_equal(one["i_a"], other["i_a"])


@pytest.mark.parametrize("generator", GENERATORS)
def test_the_true_resistance_closes_the_voltage_balance(generator):
    """At rest the d voltage over the d current is the real resistance, not the one of the drive file."""
    turn = sorted(set(FAULTS) - cases.GENERATORS[generator][0]).index("resistance")
    case = cases.make(generator, 8, 1, "single", turn)
    assert case.effects[0]["name"] == "resistance"
    i_d = 0.6 * case.drive.current
    case.plan.points, case.plan.rows, case.plan.free = [(0.0, i_d, 0.0, 0.0)] * 2, 600, False
    columns = {name: x[800:] for name, x in cases.columns_of(case, 8, 1).items()}
    turns = np.exp(2j * np.pi / 3 * np.arange(3))
    u = 2 / 3 * np.stack([columns[f"d_{x}"] * columns["u_dc"] for x in "abc"], axis=1) @ turns
    i = 2 / 3 * np.stack([columns[f"i_{x}"] for x in "abc"], axis=1) @ turns
    seen = float((u.mean() / i.mean()).real)
    assert seen == pytest.approx(case.truth.r, rel=0.02)
    assert abs(seen / case.drive.r - 1.0) > 0.1


def test_results_of_generators_are_kept_side_by_side():
    def result(name):
        return {key: name for key in blind.KEPT}

    first = blind.together({"own": result("own")}, {})
    both = blind.together({"gem": result("gem")}, first)
    assert set(both["generators"]) == {"own", "gem"} and both["figures"] == "own"


def test_reliability_compares_what_is_stated_with_what_is_right():
    truth = {"effects": [{"name": "resistance"}]}
    answer = {"effects": [{"name": "resistance", "confidence": 0.97}, {"name": "delay", "confidence": 1.0}]}
    bins = reliability.reliability([(truth, answer)])
    assert [(b["k"], b["n"]) for b in bins] == [(1, 1), (0, 0), (0, 0), (0, 0), (0, 1)]
    assert bins[0]["stated"] == pytest.approx(0.97)
