# SPDX-License-Identifier: BSD-3-Clause
"""The marginal likelihood of a set of effects (inference/evidence.py)."""

from types import SimpleNamespace

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import recorded
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.decide.off_orders import stray_swing
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.inference.evidence import evidence
from fluxproof.diagnosis.inference.fit import fit_set
from fluxproof.diagnosis.inference.model import BalanceRows, Columns, Prior
from fluxproof.diagnosis.inference.points import Grouping, condense, repeated_dwells
from fluxproof.diagnosis.inference.problem import Problem
from fluxproof.diagnosis.inference.setup import Setup, is_driven
from fluxproof.diagnosis.physics import known_effects

ROWS, NOISE = 60, 0.01


def value_of(y, doubt, x=None, curve=None, formula=0.01):
    """Log evidence of rows y with the errors ``doubt`` of curves and, if x is given, one effect with this column.

    curve: a column of the effect's curve; formula: share of the effect's contribution that may be wrong.
    """
    columns = np.array([c for c in (x, curve) if c is not None]).reshape(-1, len(y))
    k = len(columns)
    effects = min(k, 1)
    level, group = np.full(len(y), 1e-4), np.zeros(len(y), np.int64)
    rows = BalanceRows(y, np.full(len(y), NOISE**2), level, doubt, group, groups=1, loads=-1, load=0.0)
    most, wrong = np.full(effects, 100.0), np.full(effects, formula)
    effect = Columns(columns, np.ones(k), np.zeros(k, np.int64), np.arange(k) == 0, most, wrong)
    return evidence(rows, effect, Prior(typical=3.0, steep=1.0, least=1.0, straight=0.01, always=1.0), np.inf)


def test_a_curve_that_is_not_needed_is_no_reason_against_its_effect():
    """It is known to a ten-thousandth of what it may be, which cost eight nats; one that is needed is found whole."""
    rng, x = np.random.default_rng(6), np.linspace(-1.0, 1.0, ROWS)
    curve, none = x**3 - 0.6 * x, np.zeros(ROWS)
    y = 50.0 * x + NOISE * rng.standard_normal(ROWS)
    straight, free = (value_of(y, none, x, c, formula=0.0) for c in (None, curve))
    assert free[0] > straight[0] - 4.0 and abs(free[1][1]) < 4.0 * np.sqrt(free[2][1, 1]) + 0.02
    bent = value_of(y + 20.0 * curve, none, x, curve, formula=0.0)
    assert bent[1] == pytest.approx([50.0, 20.0], abs=0.05) and bent[0] > free[0] - 6.0


def test_what_may_be_wrong_of_a_contribution_grows_with_it():
    """Of a scale nothing may be: of two causes that leave the same, the larger one is not worse for its size."""
    x, y = np.linspace(-1.0, 1.0, ROWS), np.zeros(ROWS)
    y = 50.0 * x + NOISE * np.random.default_rng(7).standard_normal(ROWS)
    exact, doubtful = (value_of(y, np.zeros(ROWS), x, formula=f) for f in (0.0, 0.01))
    assert exact[0] > doubtful[0] + 50.0


def test_a_curve_may_be_wrong_without_being_so():
    """Errors that are possible and not there neither cost evidence nor could be saved by a smaller effect."""
    y = NOISE * np.random.default_rng(1).standard_normal(ROWS)
    none, large, larger = (value_of(y, np.full(ROWS, w)) for w in (0.0, 0.3, 0.6))
    assert large[0] == pytest.approx(none[0]) == larger[0]
    assert none.mu.tolist() == [1.0] and large.mu.tolist() == [0.0] == larger.mu.tolist()


def test_a_curve_that_is_wrong_explains_what_is_left():
    """The share of the possible errors that is seen is learnt, so that they are no evidence for another effect."""
    rng = np.random.default_rng(2)
    doubt = np.where(np.arange(ROWS) % 3 == 0, 1.0, 0.0)  # at some operating points only
    y = NOISE * rng.standard_normal(ROWS) + 0.2 * doubt * rng.standard_normal(ROWS)
    without, with_it = value_of(y, np.zeros(ROWS)), value_of(y, doubt)
    assert with_it[0] > without[0] + 50.0 and 0.1 <= with_it.mu[0] <= 0.4


def test_an_effect_is_found_beside_errors_of_a_curve():
    rng = np.random.default_rng(3)
    x, doubt = np.linspace(-1.0, 1.0, ROWS), np.full(ROWS, 0.3)
    y = 5.0 * x + NOISE * rng.standard_normal(ROWS)
    found = value_of(y, doubt, x)
    assert found[0] > value_of(y, doubt)[0] + 50.0 and found[1][0] == pytest.approx(5.0, rel=0.01)


def test_of_currents_and_angle_only_one_is_late():
    """Both late are a voltage that is early: a delay and a skew could not be told apart otherwise."""
    view = view_of(recorded(), load_nominal(PAPER))
    problem = Problem(Setup(view, view.visible(known_effects()), np.ones(len(view), bool)))
    late = {key: n for n, (name, key) in enumerate(problem.keys) if name == "sampling_skew"}
    fits = {}
    for key, other in (("tau", "angle"), ("angle", "tau")):
        column = problem.p.x[:, late[key]]
        problem.p.y = 20e-6 * column
        fits[key] = fit_set(problem, ["delay", "sampling_skew"])
        assert late[key] in fits[key].take and late[other] not in fits[key].take
        assert fits[key].c["sampling_skew"][key] == pytest.approx(20e-6, rel=0.05)
        assert fits[key].c["sampling_skew"][other] == 0.0 and abs(fits[key].c["delay"]["tau"]) < 1e-6


def test_a_dwell_has_one_load():
    """Two points of one dwell would be two witnesses of a friction that one coincidence explains."""
    dwell = np.array([0, 0, 1, 1, 2, 3, 3, 3])
    point = np.array([0, 0, 1, 2, 2, 3, 4, 4])
    assert repeated_dwells(point, dwell).tolist() == [False, False, False, False, True]


@pytest.mark.parametrize(("torque", "driven"), [((0.4, -0.5, -0.1), False), ((0.4, -0.5, 0.2), True)])
def test_a_load_that_drives_the_shaft_may_act_everywhere(torque, driven):
    """Only a brake is off at some point: that one dwell had hardly any load was told as a friction on two drives.

    torque: of the dwells at -10, 20 and 30 rad/s; the error of each is 0.03 Nm.
    """
    block = np.array([0, 0, 1, 2])
    cells = SimpleNamespace(
        channel=np.array(["u", "torque", "torque", "torque"]), order=np.zeros(4), ok=np.ones(4, bool), block=block,
        y=np.array([9.0, *torque]),
    )  # fmt: skip
    setup = SimpleNamespace(
        cells=cells, train=np.ones(4, bool), load=1.0, points=np.arange(3), usual=np.full(4, 0.03),
        view=SimpleNamespace(omega=np.array([[-10.0, -10.0], [20.0, 20.0], [30.0, 30.0]])),
    )  # fmt: skip
    assert is_driven(setup) is driven


def test_a_swing_is_in_most_blocks():
    """An event in three blocks, such as a step of the load, is no frequency of the voltage."""
    view = view_of(recorded(), load_nominal(PAPER))
    along = view.to_dq(view.u[:, 1:-1])
    along = along / np.abs(along).mean(axis=1, keepdims=True).clip(1e-9)
    wave = along * np.sin(4 * np.pi * np.arange(along.shape[1]) / along.shape[1])
    loudest = np.argsort(-np.abs(view.u).mean(axis=1))
    some = np.zeros(len(view), bool)
    some[loudest[:3]] = True
    noise = 0.1 * np.random.default_rng(4).standard_normal(wave.shape)
    volts = 0.05 * np.abs(view.u).max()
    assert stray_swing(view, volts * wave * some[:, None] + noise, 0.0) is None
    assert stray_swing(view, volts * wave + noise, 0.0).kind == "frequency"


def test_an_exact_channel_leaves_the_others_their_contrasts():
    """The sum of currents of which one was computed has a noise of 1e-15: its weight cancelled those behind it."""
    blocks = np.arange(6)
    block, channel = np.tile(blocks, 2), np.repeat(["sum", "u"], len(blocks))
    cells = SimpleNamespace(channel=channel, order=np.zeros(12), part=np.zeros(12, int), block=block)
    point, use = np.zeros(6, int), np.ones(12, bool)
    y, sigma = np.where(channel == "u", 3.0**block, 0.0), np.where(channel == "u", 1.0, 1e-15)
    p = condense(Grouping(cells, point, blocks, use, blocks), y, np.zeros((12, 0)), sigma, np.full(12, 1e-3))
    means = [np.mean(3.0**blocks)] + [3.0**n - np.mean(3.0 ** blocks[:n]) for n in range(1, 6)]
    of_u = np.array([name == "u" for name, _, _ in p.groups])[p.group]
    assert p.y[of_u] == pytest.approx(means) and p.s2[of_u] == pytest.approx([1 / 6, 2, 3 / 2, 4 / 3, 5 / 4, 6 / 5])
