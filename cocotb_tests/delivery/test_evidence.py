# SPDX-License-Identifier: BSD-3-Clause
"""docs/evidence.md and docs/benchmark.md are renewed from results: each rule finds its row, and changes only that."""

from __future__ import annotations

import json

import pytest

from fluxproof.checkout import ROOT
from scripts.evidence.__main__ import EVIDENCE, renewed, with_newest
from scripts.evidence.rows import ROWS
from scripts.evidence.table import cell, with_figure

RATE = {"value": 0.95, "k": 19, "n": 20, "low": 0.76, "high": 0.99, "target": 0.95, "met": True}
RUN = {
    "seed": 3,
    "cases_total": 80,
    "figures": {"single_named_right": RATE, "pairs_exactly_right": RATE | {"met": False}},
}


@pytest.mark.parametrize("row", ROWS, ids=lambda r: r.claim[:30])
def test_each_rule_has_one_row(row):
    assert "planted" in with_figure(EVIDENCE.read_text(), row.claim, "planted")


def test_a_result_changes_its_row_alone(tmp_path):
    (tmp_path / "bench").mkdir()
    figures = {"controller_periods_per_s": 1_250_000, "closed_loop_periods_per_s": 321_000}
    (tmp_path / "bench" / "golden.json").write_text(json.dumps(figures))
    before = EVIDENCE.read_text()
    after = renewed(before, tmp_path)
    changed = [new for old, new in zip(before.split("\n"), after.split("\n"), strict=True) if old != new]
    assert changed == [
        "| golden model, whole controller; in closed loop with the plant | 1.2 million and 321 thousand periods/s "
        "| `make bench` |"
    ]


def test_without_results_nothing_changes(tmp_path):
    text = EVIDENCE.read_text()
    assert renewed(text, tmp_path) == text


def test_the_benchmark_s_table_shows_what_misses_its_target(tmp_path):
    (tmp_path / "blind").mkdir()
    (tmp_path / "blind" / "result.json").write_text(json.dumps({"generators": {"own": RUN}}))
    text = with_newest((ROOT / "docs" / "benchmark.md").read_text(), tmp_path)
    assert "| pairs exactly correct | **19 of 20 (76 to 99 %)** |" in text
    assert "| single effect named, nothing else asserted | 19 of 20 (76 to 99 %) |" in text
    assert "What was missed" in text


def test_a_missing_row_is_named():
    with pytest.raises(ValueError, match='0 rows begin with "no such claim"'):
        with_figure(EVIDENCE.read_text(), "no such claim", "1")


def test_no_value_is_an_empty_cell():
    assert cell(None) == cell({"value": None, "k": 0, "n": 0}) == ""
