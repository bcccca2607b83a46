# SPDX-License-Identifier: BSD-3-Clause
"""A factor on several quantities: what leaves the same is told together, and no exact factor takes the data away."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.diagnoses.answers import answer_of, found, without
from cocotb_tests.support.drives import L_D, L_Q, PAPER, PSI, RATED, R
from cocotb_tests.support.recordings.bench_logs import GRID, Truth, table
from cocotb_tests.support.recordings.from_equations import nominal_of, write
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.conventions.table import READINGS
from fluxproof.diagnosis.effects.drive_file import restated
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import Recording
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.search import search
from fluxproof.diagnosis.inference.setup import Setup
from fluxproof.diagnosis.interpret import judge
from fluxproof.diagnosis.interpret.mistake import is_simpler
from fluxproof.diagnosis.loading.load import load_recording
from fluxproof.diagnosis.physics import rows_of, view_and_held
from fluxproof.diagnosis.plan.request import requests

STANDSTILL = [(0.0, 0.0, float(q)) for q in np.linspace(0.2, 1.0, 16) * RATED for _ in range(2)]
FEW = GRID[1::2]
CURRENT, FILE = "common gain error of the current sensors", "constants of the drive file off by one factor"


def fits_of(tmp_path, factor, noise_v=0.05):
    """The two single causes of R, L_d and L_q by one factor, judged on the recording as it is."""
    columns = table(Truth(r=R / factor, l_d=L_D / factor, l_q=L_Q / factor), noise_v=noise_v)
    nominal = nominal_of(tmp_path)
    view, held = view_and_held([load_recording(write(tmp_path / "r.csv", columns), nominal)], nominal)
    problem = Problem(Setup.of(rows_of(view, held)))
    return [fit_set(problem, (name,)) for name in ("current_scale", "machine_scale")]


def test_two_causes_that_leave_the_same_are_as_probable(tmp_path):
    currents, machine = fits_of(tmp_path, 1.5)
    assert machine.value == pytest.approx(currents.value, abs=1.0)
    assert machine.c["machine_scale"]["impedance"] == pytest.approx(-1 / 3, abs=0.02)
    assert requests(machine.problem.setup, (currents, machine), 0.05) == ()


def test_a_few_per_cent_are_a_tolerance_of_the_sensors(tmp_path):
    """No mistake of a drive file makes R, L_d and L_q wrong by five per cent alike."""
    currents, machine = fits_of(tmp_path, 1.05, noise_v=0.01)
    assert currents.value > machine.value + 5.0


@pytest.mark.slow
def test_one_factor_on_r_and_l_is_a_scale_of_the_currents_or_of_the_drive_file(tmp_path):
    """Either leaves the same voltages at every point: no further one is requested, but another instrument."""
    answer = answer_of(tmp_path, table(Truth(r=R / 1.5, l_d=L_D / 1.5, l_q=L_Q / 1.5), points=FEW))
    assert answer.verdict == "ambiguous" and answer.ambiguity == (("current_scale", "machine_scale"),), answer.sentence
    assert CURRENT in answer.sentence and FILE in answer.sentence
    assert not answer.next_recording and "ammeter" in answer.advice and "DC resistance" in answer.advice


@pytest.mark.slow
def test_a_resistance_whose_size_depends_on_the_scale_is_a_part_of_the_ambiguity(tmp_path):
    answer = answer_of(tmp_path, table(Truth(r=2.0 * 1.3 * R, l_d=2.0 * L_D, l_q=2.0 * L_Q), points=FEW))
    assert not answer.effects and not answer.conventions, answer.sentence
    assert {"current_scale", "machine_scale", "resistance"} <= {n for group in answer.ambiguity for n in group}


@pytest.mark.slow
def test_half_is_either_the_currents_or_the_drive_file(tmp_path):
    answer = answer_of(tmp_path, table(Truth(r=2.0 * R, l_d=2.0 * L_D, l_q=2.0 * L_Q), points=FEW))
    (convention,) = answer.conventions
    assert {convention.code, *convention.rivals} == {"currents_half", "machine_half_rl"}


def test_sizes_beside_a_factor_refer_to_the_constants_that_it_restores():
    nominal = load_nominal(PAPER)
    right = restated(CATALOGUE, {"machine_scale": {"impedance": 1.0, "all": 0.0}, "resistance": {}}, nominal)
    assert right.machine.resistance_ohm == 2.0 * nominal.machine.resistance_ohm
    assert right.machine.magnet_flux_wb == nominal.machine.magnet_flux_wb


@pytest.mark.parametrize("form", ["one axis", "both axes in time"])
def test_a_locked_rotor_shows_its_resistance_and_no_turned_angle(tmp_path, form):
    """The d voltage that nobody recorded was the reading without misfit; zeros of it weighed without limit."""
    columns = table(Truth(r=1.3 * R), points=STANDSTILL, noise_a=0.0)
    constants = "[constants]\ni_d = 0\nomega_e = 0\ntheta_e = 0\n"
    if form == "one axis":
        columns, more = {"i_q": columns["i_q"], "u_q_ref": columns["u_q_ref"]}, constants
    else:
        columns = {name: np.repeat(values, 20) for name, values in columns.items()}
        noise = 0.01 * np.random.default_rng(1).standard_normal((2, 640))
        columns["i_q"], columns["u_q_ref"] = columns["i_q"] + noise[0], columns["u_q_ref"] + noise[1]
        columns |= {"u_d_ref": np.zeros(640), "theta_e": np.zeros(640), "t": 0.02 * np.arange(640)}
        more = ""
    answer = answer_of(tmp_path, columns, more)
    assert not answer.conventions and [e.name for e in answer.effects] == ["resistance"], answer.sentence


def test_few_points_with_two_wrong_constants_are_no_exact_factor(tmp_path):
    """L_d at 2.6 times and 13 % more flux, with 2 % that no formula has, were 'currents recorded at half'."""
    points = [(w, d, 0.0) for d in (0.0, -1.0, -2.0, -3.5, -5.0) for w in (150.0, 250.0, 350.0, 450.0)]
    columns = without(table(Truth(l_d=2.6 * L_D, psi=1.13 * PSI), points=points), "u_d_ref")
    columns["u_q_ref"] = columns["u_q_ref"] * (1.0 + 0.02 * np.sin(columns["i_d"]))
    assert not answer_of(tmp_path, columns).conventions


def test_a_documented_unit_is_not_off_by_a_factor():
    half = next(r for r in READINGS if r.code == "currents_half")
    rms = next(r for r in READINGS if r.code == "currents_rms")
    plain = Recording("r", {n: np.zeros(4) for n in ("t", "i_d", "i_q", "u_d_ref", "u_q_ref")}, np.ones(4), np.ones(4))
    documented = replace(plain, meta={"documented_units": ["i_q"]})
    assert half.possible([plain]) and not half.possible([documented]) and rms.possible([documented])


def test_a_turned_angle_needs_both_voltages():
    turned = next(r for r in READINGS if r.code == "angle_90")
    one = Recording("r", {n: np.zeros(4) for n in ("t", "i_d", "i_q", "u_q_ref")}, np.ones(4), np.ones(4))
    assert not turned.possible([one])
    assert turned.possible([replace(one, columns=one.columns | {"u_d_ref": np.zeros(4)})])


@pytest.mark.parametrize("factor", [1.5**0.5, 1.5**-0.5, 2**0.5, 2**-0.5, 3**0.5])
def test_a_locked_rotor_whose_resistance_is_off_by_a_usual_factor_shows_a_resistance(tmp_path, factor):
    """Nothing else makes a voltage there: a factor on a column is one point of what the resistance covers.

    A real actuator of 0.35 instead of 0.28 ohm, with plateaus of some per cent of noise, was told that its voltages are
    line-to-line rms values.
    """
    rng = np.random.default_rng(4)
    i_q = np.repeat([1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0, -4.0, 5.0, -5.0], 3)
    u = factor * R * i_q * (1.0 + 0.01 * rng.standard_normal(len(i_q)))
    more = "\n[constants]\ni_d = 0\nomega_e = 0\ntheta_e = 0\n"
    answer = answer_of(tmp_path, {"i_q": i_q, "u_q_ref": u}, more)
    assert not answer.conventions and [e.name for e in answer.effects] == ["resistance"], answer.sentence
    assert found(answer)["resistance_ohm"] == pytest.approx(factor * R, rel=0.02)


def test_a_convention_that_loses_alone_is_not_searched(tmp_path, monkeypatch):
    """Half of the time of a diagnosis went into sets of effects of which none may stand beside the convention."""
    nominal = nominal_of(tmp_path)
    recording = load_recording(write(tmp_path / "r.csv", table(Truth(psi=1.9 * PSI))), nominal)
    view, held = view_and_held([recording], nominal)
    posterior = search(Setup.of(rows_of(view, held)))
    read = []
    monkeypatch.setattr(judge, "_read", lambda *args, kept=judge._read: (read.append(args), kept(*args))[1])
    monkeypatch.setattr(judge, "search", lambda *args: pytest.fail("searched"))
    assert judge.preferred([recording], posterior, True)[0] == () and read


def test_two_factors_are_not_simpler_than_one_constant():
    """A magnet flux of half its value in the drive file was told as voltages and R, L at twice the true ones.

    L_d and psi of a real motor, both off, were told as dq values in rms beside R and L at half.
    """
    one, two = (tuple(SimpleNamespace(pole_pairs=0) for _ in range(n)) for n in (1, 2))
    assert is_simpler(one, (), 1, absurd=False) and not is_simpler(two, (), 1, absurd=False)
    assert not is_simpler(two, (), 2, absurd=False) and is_simpler(two, (), 3, absurd=False)
    assert is_simpler(two, (), 1, absurd=True)
