# SPDX-License-Identifier: BSD-3-Clause
"""The long comparison in runs from reset: it goes on where it ended, and a difference is its exit status."""

from __future__ import annotations

import json

import pytest

from cocotb_tests.support.needs import skip_without_ghdl5
from studies.hil import closed_loop, in_runs


@pytest.fixture
def rows(tmp_path, monkeypatch):
    """Reads the lines that were written, {key: values of each run}; runs of 20 periods."""
    monkeypatch.setattr(in_runs, "OUT", tmp_path / "runs.jsonl")
    monkeypatch.setattr(in_runs, "RUN", 20)

    def read() -> list[dict]:
        return [json.loads(line) for line in in_runs.OUT.read_text().splitlines()]

    return read


def test_a_second_call_goes_on_and_another_rtl_begins_anew(rows, monkeypatch):
    wrong = {1003: 2}
    monkeypatch.setattr(in_runs, "long_run", lambda n, seed: closed_loop.Long(n, wrong.get(seed, 0), 0.1))
    monkeypatch.setattr(in_runs, "conversion_key", lambda *_args, **_names: "one")
    assert in_runs.main(20) == 0 and in_runs.main(60) == 0 and in_runs.main(60) == 0
    assert [(row["seed"], row["periods"], row["wrong"]) for row in rows()] == [(s, 20, 0) for s in (1000, 1001, 1002)]
    assert in_runs.main(61) == 1 and in_runs.main(100) == 1, "a difference stays one"
    assert [row["wrong"] for row in rows()] == [0, 0, 0, 2, 0] and rows()[-1]["seed"] == 1004
    monkeypatch.setattr(in_runs, "conversion_key", lambda *_args, **_names: "another")
    assert in_runs.main(20) == 0 and rows()[-1] == {**rows()[0], "rtl": "another"}


@pytest.mark.slow
def test_runs_of_the_rtl_are_equal_and_a_planted_difference_is_seen(rows, monkeypatch):
    """Two runs, the second in a second call; then a load torque in the RTL alone."""
    skip_without_ghdl5()
    assert in_runs.main(20) == 0 and in_runs.main(40) == 0
    assert [row["seed"] for row in rows()] == [1000, 1001] and not any(row["wrong"] for row in rows())
    real = closed_loop.rtl_of

    def loaded(of, rewrite):
        core = real(of, rewrite)
        core.set("motor_load", of.scale.load(closed_loop.LOAD_NM))
        return core

    monkeypatch.setattr(closed_loop, "rtl_of", loaded)
    assert in_runs.main(60) == 1 and rows()[-1]["wrong"] > 0
