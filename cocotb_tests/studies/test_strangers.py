# SPDX-License-Identifier: BSD-3-Clause
"""Generators written by others: deterministic, independent of the catalogue, and each fault really in the data."""

from __future__ import annotations

import ast
import dataclasses
from pathlib import Path

import numpy as np
import pytest

from cocotb_tests.support.slow import halved
from fluxproof.checkout import ROOT
from studies.blind import __main__ as blind
from studies.blind import reliability
from studies.blind.strangers import cases
from studies.blind.strangers.faults import FAULTS, UNKNOWN
from studies.blind.strangers.motulator import MotulatorPlant

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
    of_the_project = {n for n in imported if n.split(".")[0] in ("fluxproof", "golden_model")}
    assert of_the_project <= {"fluxproof.files"}, of_the_project
    assert {"motulator", "gym_electric_motor"} <= {n.split(".")[0] for n in imported}


@pytest.mark.parametrize("generator", GENERATORS)
def test_every_fault_and_unknown_is_drawn(generator):
    missing, unknown = cases.GENERATORS[generator]
    singles = {cases.make(generator, 3, n, "single", n).effects[0]["name"] for n in range(40)}
    assert singles == set(FAULTS) - missing
    kinds = {cases.make(generator, 3, n, "unknown", n).kind for n in range(40)}
    assert kinds == set(UNKNOWN) - unknown


@pytest.mark.parametrize("generator", halved(GENERATORS))
def test_a_seed_gives_the_same_recording_and_another_seed_does_not(generator):
    def columns(seed):
        return cases.columns_of(_short(cases.make(generator, seed, 4, "healthy", 0)), seed, 4)

    one, same, other = columns(5), columns(5), columns(6)
    assert all(np.array_equal(one[name], same[name], equal_nan=True) for name in one)
    assert len(one["t"]) != len(other["t"]) or not np.array_equal(one["i_a"], other["i_a"])


@pytest.mark.slow
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


def test_harmonics_give_the_torque_of_their_power():
    """Voltage and torque of one flux: its slope in time at constant dq current, and that of its coenergy in angle."""
    case = cases.make("motulator", 3, 1, "healthy", 0)
    truth = dataclasses.replace(case.truth, emf={6: 0.02 + 0.01j, -6: 0.01j}, ripple_l=0.05)
    plant = MotulatorPlant(case.drive, truth, imposed=lambda t: 30.0)
    machine, i, angle = plant.model.machine, (0.3 + 0.8j) * case.drive.current, 0.7

    def flux(theta, i_s):
        """Stator flux linkage of the harmonics [Vs], of magnets and of slots, at a current in the stator frame."""
        magnets = sum(truth.psi * a * np.exp(1j * (h + 1) * theta) for h, a in truth.emf.items())
        return magnets, truth.ripple_l * truth.l_q * np.conj(i_s) * np.exp(-4j * theta)

    def coenergy(theta, i_s):
        magnets, slots = flux(theta, i_s)
        return 1.5 * np.real(np.conj(i_s) * (magnets + 0.5 * slots))

    step, turn, pairs = 1e-6, np.exp(1j * angle), case.drive.pole_pairs
    machine.state.exp_j_theta_m, machine.inp.w_M = turn, 30.0
    machine.state.psi_s = truth.psi + truth.l_d * i.real + 1j * truth.l_q * i.imag
    machine.out.i_s = machine.i_s
    assert machine.i_s == pytest.approx(i)
    ends = [sum(flux(angle + x, i * np.exp(1j * (angle + x)))) for x in (step, -step)]
    volts = pairs * 30.0 * (ends[0] - ends[1]) / (2 * step) / turn
    assert machine.harmonics() == pytest.approx(volts, rel=1e-6)
    fixed = i * turn
    torque = pairs * (coenergy(angle + step, fixed) - coenergy(angle - step, fixed)) / (2 * step)
    smooth = 1.5 * pairs * np.imag(i * np.conj(machine.state.psi_s))
    assert machine.tau_M - smooth == pytest.approx(torque, rel=1e-6)


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
