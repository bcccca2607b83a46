# SPDX-License-Identifier: BSD-3-Clause
"""How credible an effect is beside what is left and beside surer effects."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fluxproof.diagnosis.decide.credibility import MEDIAN, _seen_discrepancy, credibilities


def test_half_of_the_points_show_what_is_left_beside_a_load():
    """A friction of 0.8 N m on a free shaft, with 0.03 N m left, was no more credible than beside 0.25 N m."""
    left = np.array([0.03, -0.02, 0.05, -0.03, 5.0])  # the last one is loaded
    points = SimpleNamespace(
        y=left, x=np.zeros((5, 1)), level=np.full(5, 0.085), group=np.zeros(5, int), loads=0, groups=[0]
    )
    fit = SimpleNamespace(
        problem=SimpleNamespace(p=points), lam=np.array([3.0]), take=np.zeros(1, int), vector=np.zeros(1)
    )
    assert _seen_discrepancy(fit)[0] == pytest.approx(0.03 / 0.085 / MEDIAN)
    points.y = np.full(5, 5.0)
    assert _seen_discrepancy(fit)[0] == 3.0


def two_effects(share_along):
    """A fit of a sure effect of the size 10 and one of the size 2, beside a leftover of the size 1.

    share_along: of what the small one explains that lies along the large one's column.
    """
    x = np.stack([np.tile([1.0, 1.0], 50), np.tile([1.0, -1.0], 50)], axis=1)
    x[:, 1] = np.sqrt(share_along) * x[:, 0] + np.sqrt(1.0 - share_along) * x[:, 1]
    points = SimpleNamespace(
        y=np.zeros(100), x=x, level=np.full(100, 0.1), doubt=np.zeros(100), group=np.zeros(100, int), loads=-1,
        groups=[("u", 6.0, False)],
    )  # fmt: skip
    problem = SimpleNamespace(p=points, keys=[("large", "a"), ("small", "a")], setup=SimpleNamespace(load=0.0))
    return SimpleNamespace(
        problem=problem, names=("large", "small"), lam=np.array([10.0]), mu=np.zeros(1), take=np.arange(2),
        vector=np.array([10.0, 2.0]), variance=np.ones(100),
    )  # fmt: skip


@pytest.mark.parametrize("load, credible", [(1.0, True), (0.0, False)])
def test_a_torque_that_nobody_measured_does_not_withhold_what_the_voltage_shows(load, credible):
    """Offsets of the sensors, all that the voltage showed, were possible (0.21) beside an unknown load of the shaft.

    A torque of a transducer counts.
    """
    seen, torque = np.repeat([True, False], 50), np.repeat([False, True], 50)
    points = SimpleNamespace(
        y=np.zeros(100), x=(np.where(seen, 1.0, 3.0))[:, None], level=np.full(100, 0.1), doubt=np.zeros(100),
        group=torque.astype(int), loads=-1, groups=[("u", 1.0, False), ("torque", 1.0, False)],
    )  # fmt: skip
    problem = SimpleNamespace(
        p=points, keys=[("offset", "a")], setup=SimpleNamespace(load=load),
        cells=SimpleNamespace(electrical=frozenset({"offset"})),
    )  # fmt: skip
    fit = SimpleNamespace(
        problem=problem, names=("offset",), lam=np.array([1.0, 30.0]), mu=np.zeros(2), take=np.arange(1),
        vector=np.ones(1), variance=np.ones(100),
    )  # fmt: skip
    assert (credibilities(fit)["offset"] > 0.95) is credible


def test_an_error_of_a_sure_effect_imitates_what_is_like_it():
    """EMF harmonics beside a dead time were withheld for its error; a resistance beside it may well be that error."""
    apart, alike = (credibilities(two_effects(share)) for share in (0.05, 0.99))
    assert apart["large"] > 0.999 and alike["large"] > 0.999
    assert apart["small"] > 0.95 > alike["small"]
