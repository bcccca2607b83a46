# SPDX-License-Identifier: BSD-3-Clause
"""How credible an effect is beside what is left and beside surer effects."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from fluxproof.diagnosis.decide.credibility import credibilities


def two_effects(share_along, small=2.0):
    """A fit of a sure effect of the size 10 and one of the size ``small``, beside a leftover of the size 1.

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
        vector=np.array([10.0, small]), variance=np.ones(100),
    )  # fmt: skip


def test_an_error_of_a_sure_effect_imitates_what_is_like_it():
    """EMF harmonics beside a dead time were withheld for its error; a resistance beside it may well be that error."""
    apart, alike = (credibilities(two_effects(share)) for share in (0.05, 0.99))
    assert apart["large"] > 0.999 and alike["large"] > 0.999
    assert apart["small"] > 0.95 > alike["small"]


def test_what_cancels_is_not_explained():
    """Crosstalk of current sensors was told as a late voltage that an early angle cancels."""
    alike, opposite = (credibilities(two_effects(0.999, small)) for small in (9.0, -9.0))
    assert all(p > 0.95 for p in alike.values())
    assert not any(p > 0.5 for p in opposite.values())
