# SPDX-License-Identifier: BSD-3-Clause
"""The statistics of a fleet on made-up rows: population, rates, outliers, drift, groups, each with a known truth."""

from __future__ import annotations

import datetime

import numpy as np
import pytest

from cocotb_tests.support.fleet.rows import START, ageing, flux, hypothesis, row
from fluxproof.checkout import ROOT
from fluxproof.diagnosis.fleet import drift, groups, outliers, rates
from fluxproof.diagnosis.fleet.findings import findings
from fluxproof.diagnosis.fleet.population import pooled, population
from fluxproof.diagnosis.fleet.schema import described


def test_spread_and_uncertainty_are_told_apart():
    """60 drives, spread 0.003, recordings of very different sigma: mean, spread and shrinkage, over 20 draws."""
    rng = np.random.default_rng(1)
    means, spreads, better = [], [], []
    for _ in range(20):
        true, s = 0.1 + 0.003 * rng.standard_normal(60), rng.choice((5e-4, 6e-3), 60)
        found = population("e", "p", "Wb", [str(n) for n in range(60)], true + s * rng.standard_normal(60), s)
        means.append((found.mean - 0.1) / found.mean_sigma)
        spreads.append(found.spread)
        better.append(np.mean((found.shrunk - true) ** 2) / np.mean((found.x - true) ** 2))
        inside = np.mean(np.abs(found.shrunk - true) < 2.0 * found.shrunk_sigma)
        assert inside > 0.85
    assert abs(np.mean(means)) < 0.7 and 0.7 < np.std(means) < 1.4
    assert np.mean(spreads) == pytest.approx(0.003, rel=0.08)
    assert np.mean(better) < 0.4  # what is shrunk is closer to the truth


def test_no_spread_is_found_where_there_is_none():
    rng = np.random.default_rng(2)
    found = population("e", "p", "Wb", [str(n) for n in range(80)], 0.1 + 1e-3 * rng.standard_normal(80), [1e-3] * 80)
    assert found.spread < 4e-4 and found.shrunk.std() < 0.3 * found.x.std()


def test_faulty_drives_move_neither_mean_nor_spread():
    rng = np.random.default_rng(3)
    x = 0.1 + 0.002 * rng.standard_normal(100)
    clean = population("e", "p", "Wb", [str(n) for n in range(100)], x, [2e-4] * 100)
    x[:6] -= 0.03
    found = population("e", "p", "Wb", [str(n) for n in range(100)], x, [2e-4] * 100)
    assert found.mean == pytest.approx(clean.mean, abs=0.0004)
    assert found.spread == pytest.approx(clean.spread, rel=0.15)
    assert np.all(found.inlier[:6] < 0.05) and np.all(np.abs(found.z[:6]) > 8.0)
    assert np.allclose(found.shrunk[:6], found.x[:6], atol=3e-4)  # an outlier is not drawn to the others


def test_recordings_that_differ_by_more_than_sigma_widen_it():
    assert pooled([1.0, 1.0], [0.1, 0.1]) == pytest.approx((1.0, 0.1 / np.sqrt(2.0)))
    assert pooled([0.0, 2.0], [0.1, 0.1])[1] == pytest.approx(1.0)


def test_the_fleet_decides_a_tie():
    """One drive cannot tell which of two effects it has; forty others have the first one."""
    sure = [row(n, [hypothesis(["iron_loss"], 20.0), hypothesis([], 0.0)]) for n in range(40)]
    plain = [row(n, [hypothesis()]) for n in range(40, 60)]
    tie = row(60, [hypothesis(["iron_loss"], 20.0), hypothesis(["sampling_skew"], 20.0), hypothesis([], 0.0)])
    found, weighed = rates.weigh([*sure, *plain, tie])
    assert found["iron_loss"] == pytest.approx(41.1 / 63, abs=0.01) and found["sampling_skew"] < 0.01
    assert weighed[-1].present["iron_loss"] > 0.99
    alone = rates.weigh([tie])[1][0]
    assert alone.present["iron_loss"] == pytest.approx(alone.present["sampling_skew"], rel=0.01)


def test_a_weak_effect_of_one_drive_is_no_outlier_but_a_sure_one_is():
    rng = np.random.default_rng(4)
    rows = [row(n, [hypothesis(values=flux(0.1 + 0.002 * rng.standard_normal()))]) for n in range(200)]
    rows[7] = row(7, [hypothesis(["dead_time"], 5.0, flux(0.1)), hypothesis([], 0.0, flux(0.1))])
    rows[8] = row(8, [hypothesis(["dead_time"], 40.0, flux(0.1)), hypothesis([], 0.0, flux(0.1))])
    rows[9] = row(9, [hypothesis([], 0.0, flux(0.07))])
    (design,) = findings(rows).designs
    assert {s: {f.effect for f in fs} for s, fs in design.outliers.items()} == {
        "S0008": {"dead_time"}, "S0009": {"magnet_flux"}
    }  # fmt: skip


def test_healthy_fleets_are_left_alone():
    """Of 40 fleets of 100 healthy drives at most a few have any outlier: the share of false ones is held."""
    rng = np.random.default_rng(5)
    told = 0
    for _ in range(40):
        x, s = 0.1 + 0.002 * rng.standard_normal(100), rng.choice((1e-4, 2e-3), 100)
        found = population("magnet_flux", "p", "Wb", [str(n) for n in range(100)], x + s * rng.standard_normal(100), s)
        told += bool(outliers.outliers([found], {str(n): {} for n in range(100)}, {}, {}))
    assert told <= 6  # 5 % of 40 is 2; 6 or more have the probability 0.02


def test_an_effect_that_leaves_most_of_the_rest_is_not_told():
    rows = [row(n, [hypothesis()]) for n in range(30)]
    rows[3] = row(3, [hypothesis(["iron_loss"], 60.0, share=0.8, left=[("u_dq", 2.0, 1.0, 0.8)])])
    rows[4] = row(4, [hypothesis(["iron_loss"], 60.0, share=0.1)])
    (design,) = findings(rows).designs
    assert set(design.outliers) == {"S0004"}


def test_lost_flux_is_noticed_with_its_rate_and_the_day_of_its_limit():
    # An ordinary draw: how often the intervals hold is the next test.
    (found,) = drift.drifts({("A", "magnet_flux", "magnet_flux_wb", "Wb"): ageing(0.02, seed=3)})
    assert found.line.b * 343.0 / found.line.a == pytest.approx(-0.02, rel=0.075)  # three sigma
    assert 0.02 * found.noticed / 49 < 0.01
    due = START + datetime.timedelta(days=343.0 * 0.05 / 0.02)
    assert found.earliest < due < found.latest and abs((found.reaches - due).days) < 60


def test_intervals_of_limit_and_rate_hold():
    """300 drives: 95 % of the intervals of limit hold; rates are in their sigma."""
    held, off = 0, []
    for seed in range(300):
        points = ageing(0.02, sigma=4e-4, seed=seed)
        days = np.array([(p[0] - START).days for p in points], float)
        line = drift.line_of(days, [p[1] for p in points], [p[2] for p in points])
        _, low, high = drift.reached(line, 0.095)
        held += low < 343.0 * 0.05 / 0.02 < high
        off.append((line.b + 0.1 * 0.02 / 343.0) / line.sigma)
    assert held / 300 == pytest.approx(0.95, abs=0.04) and np.std(off) == pytest.approx(1.0, abs=0.15)


def test_a_drive_that_does_not_drift_is_not_noticed():
    """Of 200 steady drives, looked at after each recording, at most the 1 % that was agreed, and chance."""
    points = (ageing(0.0, seed=1000 + n) for n in range(200))
    seen = 0
    for p in points:
        days = np.array([(t - START).days for t, _, _ in p], float)
        seen += drift.noticed_at(days, np.array([x for _, x, _ in p]), np.array([s for *_, s in p])) is not None
    assert seen <= 7
    many = {(str(n), "e", "magnet_flux_wb", "Wb"): ageing(0.0, seed=n) for n in range(60)}
    assert len(drift.drifts(many)) <= 1


def test_limits_are_values_or_shares_of_the_first():
    assert drift.limit_of("95%", 0.2) == pytest.approx(0.19) and drift.limit_of("0.13", 0.2) == 0.13
    with pytest.raises(ValueError):
        drift.limit_of("much", 1.0)


def test_drives_with_one_remainder_are_one_group():
    """Twelve drives with orders -2 and 4 in one ratio, of any size; three with another order; one by itself."""
    rng, rows = np.random.default_rng(6), [row(n, [hypothesis()]) for n in range(40)]
    for n in range(12):
        size = float(rng.uniform(0.2, 5.0))
        jitter = float(rng.uniform(-0.05, 0.05))
        left = [("u_dq", -2.0, size, 0.5 + jitter), ("u_dq", 4.0, 0.5 * size, 0.2)]
        rows[n] = row(n, [hypothesis(["iron_loss"], 30.0, left=left, share=0.4)])
    for n in (20, 21, 22):
        rows[n] = row(n, [hypothesis(left=[("u_dq", 2.0, 1.0, 0.6)], share=0.6)])  # the other direction
    rows[30] = row(30, [hypothesis(left=[("torque", 1.0, 1.0, 0.6)], share=0.6)])
    weighed = rates.weigh(rows)[1]
    first, second = groups.groups(rows, weighed)
    assert first.serials == tuple(f"S{n:04d}" for n in range(12)) and first.companions == ("iron_loss",)
    assert [(line.signal, line.order) for line in first.lines] == [("u_dq", -2.0), ("u_dq", 4.0)]
    assert second.serials == ("S0020", "S0021", "S0022")
    (design,) = findings(rows).designs
    assert not design.outliers  # a companion of an unknown remainder is no fault of its own


def test_a_faint_remainder_joins_the_group_that_its_effect_belongs_to():
    """What is left of drive 30 is less than its noise; of 31 it is another order, and 32 has another effect."""
    same, rows = [("u_dq", 2.0, 1.0, 0.3)], [row(n, [hypothesis()]) for n in range(40)]
    for n in range(5):
        rows[n] = row(n, [hypothesis(["iron_loss"], 30.0, left=same, share=0.4)])
    rows[30] = row(30, [hypothesis(["iron_loss"], 30.0, left=same, share=0.0)])
    rows[31] = row(31, [hypothesis(["iron_loss"], 30.0, left=[("u_dq", 6.0, 1.0, 0.3)], share=0.0)])
    rows[32] = row(32, [hypothesis(["delay"], 30.0, left=same, share=0.0)])
    (group,) = groups.groups(rows, rates.weigh(rows)[1])
    assert group.serials == ("S0000", "S0001", "S0002", "S0003", "S0004", "S0030")


def test_documentation_shows_the_columns():
    assert described() in (ROOT / "docs" / "fleet.md").read_text()
