# SPDX-License-Identifier: BSD-3-Clause
"""The start of a recording: settling is excluded, drift is not."""

from __future__ import annotations

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import POINT, columns
from fluxproof.diagnosis.balance.blocks import view_of
from fluxproof.diagnosis.balance.settling import MOST_DROPPED, ringing, settled, swings
from fluxproof.diagnosis.ground.nominal import load_nominal
from fluxproof.diagnosis.ground.recording import from_columns

NOMINAL = load_nominal(PAPER)
BEGIN = 2000  # row at which the operating point begins


def started(share):
    """A recording of one point whose duties have a relative error at the start, as of a settling loop."""
    table = {name: values[BEGIN:].copy() for name, values in columns(POINT).items()}
    fading = share * np.exp(-np.arange(len(table["t"])) / 30.0)
    for name in ("d_a", "d_b", "d_c"):
        table[name] = 0.5 + (table[name] - 0.5) * (1.0 - fading)
    return view_of(from_columns(table, NOMINAL.sample_time_s), NOMINAL)


def test_settling_at_the_start_is_excluded():
    calm, swung = started(0.0), started(0.3)
    assert calm.rows[0] < 30 and len(swung) == len(calm) - 1 and np.array_equal(swung.rows, calm.rows[1:])


@pytest.fixture(scope="module")
def line():
    """Mean misfits of twenty blocks that drift, with noise [V]."""
    rng = np.random.default_rng(3)
    return 0.05 * np.arange(20) + 0.01 * (rng.standard_normal(20) + 1j * rng.standard_normal(20))


def test_drift_is_not_settling(line):
    assert not swings(line) and swings(line + np.where(np.arange(20) == 0, 0.3j, 0.0))
    fading = 0.2 * np.exp(-np.arange(20) / 5.0)  # a drift that levels off over many blocks
    assert not swings(fading + (line - 0.05 * np.arange(20)))


def test_a_recording_that_never_settles_is_kept():
    view = started(0.0)
    u = view.u * (1.0 + 2.0 ** -np.arange(len(view), dtype=float))[:, None]
    restless = view.replace(u=u)
    assert len(settled(restless)) == len(view) - MOST_DROPPED
    few = restless.take(np.arange(6))
    assert len(settled(few)) == len(few)


def test_only_the_first_blocks_ring():
    spread = np.ones(40)
    assert ringing(spread) == 0
    assert ringing(np.where(np.arange(40) < 2, 9.0, spread)) == 2
    assert ringing(np.where(np.isin(np.arange(40), (0, 1, 20)), 9.0, spread)) == 0
    assert ringing(np.where(np.arange(40) < 10, 9.0, spread)) == 0


def test_blocks_of_a_short_dwell_that_ring_are_excluded():
    view = started(0.0).take(np.arange(20))
    ring = 30.0 * np.cos(2 * np.pi / 20.0 * np.arange(view.u.shape[1]))
    swung = view.replace(u=view.u + ring * (np.arange(20) < 2)[:, None], run=np.arange(20) // 4)
    assert np.array_equal(settled(swung).rows, view.rows[2:])
