# SPDX-License-Identifier: BSD-3-Clause
"""Dead time: its loss follows the current in the middle of the pulses; the residual of its curve neither causes false
names nor hides other effects.

The recordings are of the blind benchmark's drives, whose inverter model switches at instants and clamps near zero.
"""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.slow import slowly
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.cells import cells_of
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.diagnosis.catalogue.dead_time import EFFECT, full_loss
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.linearise import Linearisation
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.setup import Setup
from studies.blind import cases
from studies.blind.generate import listing
from studies.mishaps.bases import BASES
from studies.mishaps.bases import columns as columns_of

NOMINAL = load_nominal(PAPER)


def drive_of(seed, number, folder, trace=False):
    """(case, nominal drive, recording, trace or None) of a case of the benchmark."""
    entry = next(e for e in listing(seed, 300, None) if e[0] == number)
    case = cases.make(seed, *entry)
    columns, _, held = cases.record(case, seed, trace=trace)
    path = folder / "drive.toml"
    path.write_text(case.build.nominal.toml())
    nominal = load_nominal(path)
    return case, nominal, from_columns(columns, nominal.sample_time_s), held


@pytest.fixture(scope="module")
def strong(tmp_path_factory):
    """A drive with a loss of 6 % of its bus voltage: its case, its set-up, and this loss as rows of the balance."""
    case, nominal, recording, held = drive_of(27182818, 130, tmp_path_factory.mktemp("strong"), trace=True)
    view = view_of(recording, nominal)
    setup = Setup(view, {"dead_time": EFFECT}, np.ones(len(view), bool))
    rows = view.rows[:, None] + np.arange(view.u_dc.shape[1])
    mean = (held["u_mean_alpha"] + 1j * held["u_mean_beta"])[rows]
    return case, setup, setup.projector.rows({"u": view.to_dq(view.u[:, 1:-1] - mean)})


def across(setup, loss, late_s=0.0):
    """Residual rms [V] of the dead-time curve at order 0, perpendicular to the current, in blocks with current."""
    view = setup.view.replace(late_s=late_s)
    cells = cells_of(view, [EFFECT], setup.projector)
    problem = Problem(setup, Linearisation(view, cells, {}, loss - setup.cells.y, np.zeros(len(loss)), None))
    fit = fit_set(problem, ["dead_time"])
    rows = (problem.cells.order == 0) & (problem.cells.channel == "u")
    left = fit.left()[rows].reshape(-1, 2)
    i = setup.view.i.mean(axis=1)
    loaded = np.abs(i) > 0.1 * setup.view.machine.rated_current_a
    return float(np.sqrt(np.mean(((left @ [1, 1j]) / (i / np.abs(i))).imag[loaded] ** 2))), fit


def test_loss_follows_the_current_in_the_middle_of_the_pulses(strong):
    """One edge of every pulse is late by the dead time, so that the converters sample before its middle."""
    case, setup, loss = strong
    before, fit = across(setup, loss)
    late = EFFECT.late_s(fit.c["dead_time"], setup.view.nominal)
    assert late == pytest.approx(0.5 * case.build.drive.bridge.dead_s, rel=0.15)
    assert across(setup, loss, late)[0] < before / 3.0


def test_every_part_of_the_loss_curve_is_identified(strong):
    """A column rejected as collinear would make the growth of the loss wrong."""
    _, setup, loss = strong
    c = across(setup, loss)[1].c["dead_time"]
    assert all(c.values())
    assert 0.0 < c["growth"] < 0.08 * full_loss(c)  # a diode's logarithm in a loss that is mostly dead time


def test_loss_is_uncertain_near_zero_current(strong):
    view, c = strong[1].view, {"v_0.02": 3.0, "v_0.12": 0.5, "bump_0.05": 0.3}
    assert full_loss(c) == 3.5
    idle = view.replace(i_raw=1e-3 * view.i_raw)
    assert np.allclose(EFFECT.doubt(c, idle), 0.35)
    assert np.median(EFFECT.doubt(c, view)) < 0.03


def test_no_leg_gains_voltage():
    """Noise around zero current would also fit a gain there."""
    c, sure = {"v_0.02": -1.6, "v_0.12": 3.0, "bump_0.005": -0.5}, 1e-4 * np.eye(3)
    assert full_loss(c) > 0.0 and not EFFECT.possible(c, sure, NOMINAL)
    assert EFFECT.possible(c, 1e4 * sure, NOMINAL)
    assert EFFECT.possible({"v_0.02": 1.6, "v_0.12": 0.0}, sure[:2, :2], NOMINAL)


@pytest.mark.parametrize(
    ("seed", "number", "names"),
    [
        slowly(27182818, 130, ["dead_time"]),  # no d-axis inductance for the residual of late pulses
        slowly(27182818, 229, ["dead_time", "phase_resistance_asymmetry"]),  # a dominant effect does not replace both
        # A resistance of a tenth of the loss may be a device's: it is named or left out, and nothing else is.
        slowly(27182818, 30, ["dead_time", "resistance"]),
        slowly(14142135, 24, ["dead_time", "encoder_eccentricity", "resistance"]),
        slowly(14142135, 263, ["dead_time"]),  # a diode's logarithm, which resembles a resistance
    ],
)
def test_effects_with_strong_dead_time(seed, number, names, tmp_path):
    _, nominal, recording, _ = drive_of(seed, number, tmp_path)
    answer = diagnose(recording, nominal)
    found = {e.name for e in answer.effects}
    assert "dead_time" in found <= set(names) and answer.verdict in ("explained", "partly_explained", "ambiguous")
    assert len(names) > 2 or found == set(names) or {"resistance"} == set(names) - found


def test_within_the_ripple_of_the_current_the_loss_has_no_sign(strong):
    """A loss that is a gain at 2 % of rated current: possible only where the ripple is larger than that current."""
    _, setup, _ = strong
    nominal = setup.view.nominal
    keys = EFFECT.core(setup.view) | EFFECT.free(setup.view)
    c = {key: 0.0 for key in keys} | {"v_0.12": 0.01 * nominal.inverter.dc_bus_v}
    c["bump_0.005"] = -0.5 * c["v_0.12"]
    sure = 1e-12 * np.eye(len(c))
    for period, possible in ((1e-6, False), (2e-4, True)):
        control = dataclasses.replace(nominal.control, sample_time_s=period)
        small = dataclasses.replace(nominal.machine, inductance_d_h=1e-3, inductance_q_h=1e-3)
        drive = dataclasses.replace(nominal, control=control, machine=small)
        assert EFFECT.possible(c, sure, drive) is possible


def test_a_loss_that_rises_up_to_rated_current_may_be_a_resistance():
    """A winding 20 % warmer beside a dead time was told as 9.16 +- 0.14 V of loss, where 6.5 V are true."""
    c = {"v_0.02": 8.9, "v_0.12": -1.9, "log": 2.0, "fade": -2.0, "growth": -0.1}
    found = EFFECT.estimates(c, np.zeros((5, 5)), NOMINAL)["v_dead_v"]
    rise = full_loss(c) - 7.0
    assert found.value == pytest.approx(9.4, abs=0.1) and found.sigma == pytest.approx(rise)
    machine = dataclasses.replace(NOMINAL.machine, rated_current_a=24.0, resistance_ohm=0.62)
    said = EFFECT.caveat(SimpleNamespace(machine=machine), c)
    assert said.startswith("The loss of the inverter rises by 2.4 V") and "0.14 Ohm larger" in said
    assert not EFFECT.caveat(SimpleNamespace(machine=machine), {"v_0.02": 7.0})


def test_a_rated_current_of_ten_times_the_true_one_leaves_a_resistance_a_resistance(tmp_path):
    """A ramp that no current leaves was named in its place, beside blocks that held steps between operating points."""
    base, path = BASES["robot"], tmp_path / "drive.toml"
    document = base.drive()
    document["machine"]["rated_current_a"] *= 10.0
    path.write_text("".join(f"[{s}]\n" + "".join(f"{k} = {v}\n" for k, v in d.items()) for s, d in document.items()))
    nominal = load_nominal(path)
    view = view_of(from_columns(columns_of("robot"), nominal.sample_time_s), nominal)
    swing = np.ptp(view.i.real, axis=1) + np.ptp(view.i.imag, axis=1)
    assert swing.max() < 0.2 * base.machine["rated_current_a"] and len(view) > 20
    setup = Setup(view, {"dead_time": EFFECT, "resistance": CATALOGUE["resistance"]}, np.ones(len(view), bool))
    problem = Problem(setup)
    assert fit_set(problem, ["resistance"]).value > fit_set(problem, ["dead_time"]).value + 100.0
