# SPDX-License-Identifier: BSD-3-Clause
"""The sensitivity of the verdicts to the constants: what is varied, what counts as changed, and the figures."""

from __future__ import annotations

import ast
from pathlib import Path

import pandas as pd
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings.from_core import GRID, MACHINE, columns
from cocotb_tests.support.slow import slowly
from fluxproof.checkout import ROOT
from fluxproof.diagnosis.ground import constants
from studies.sensitivity.run import OF_FLEETS, OF_ONE_POINT, Case, answers_of, names, said_in_full, shares
from studies.sensitivity.steps import Steps, recorded, varied


def test_every_constant_is_varied():
    declared = {t.id for node in ast.parse(Path(constants.__file__).read_text()).body if isinstance(node, ast.Assign)
                for target in node.targets for t in ast.walk(target) if isinstance(t, ast.Name)}  # fmt: skip
    assert declared == set(names()) | set(OF_ONE_POINT) | set(OF_FLEETS)
    text = " ".join((ROOT / "docs" / "diagnosis.md").read_text().split())
    beside = f"{len(OF_ONE_POINT)} more of one operating point and {len(OF_FLEETS)} of fleets"
    assert f"its reason: {len(names())}, {beside}" in text


def test_no_constant_is_imported_by_value():
    """A value that is bound when a module is imported would not be varied."""
    for path in (ROOT / "fluxproof" / "diagnosis").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            assert not (isinstance(node, ast.ImportFrom) and (node.module or "").endswith("inference.constants")), path


def _product(number):
    return number * constants.HALF * (constants.OPEN if number > 1 else 1.0)


def _twice(steps, number):
    return 2.0 * steps(_product, number)


def test_a_step_runs_again_only_if_a_constant_that_it_read_is_another_one():
    with recorded():
        steps = Steps()
        first = steps(_twice, steps, 1)
        assert first == 2.0 * constants.HALF and steps.ran == 2 and steps.reads() == {"HALF"}
        with varied("OPEN", 2.0):  # not read for this number
            assert steps(_twice, steps, 1) == first and steps.ran == 2
        with varied("HALF", 2.0):  # read in the step within
            assert steps(_twice, steps, 1) == 2.0 * first and steps.ran == 4
        assert steps(_twice, steps, 1) == first and steps.ran == 4
        steps(_twice, steps, 2)
        with varied("OPEN", 2.0):
            assert steps(_twice, steps, 2) == 4.0 * constants.HALF * constants.OPEN


def test_a_step_that_is_reused_tells_the_outer_step_what_it_read():
    with recorded():
        steps = Steps()
        steps(_product, 1)
        first = steps(_twice, steps, 1)  # the inner step is reused here
        with varied("HALF", 2.0):
            assert steps(_twice, steps, 1) == 2.0 * first


def test_what_one_variation_kept_is_forgotten():
    with recorded():
        steps = Steps()
        steps(_product, 1)
        steps.lasting = False
        with varied("HALF", 2.0):
            steps(_product, 1)
        steps.forget()
        assert [len(kept) for kept in steps.kept.values()] == [1]
        assert steps(_product, 1) == constants.HALF


def test_a_constant_is_restored():
    before = constants.HALF
    with pytest.raises(ZeroDivisionError), varied("HALF", 2.0):
        assert constants.HALF == 2.0 * before
        raise ZeroDivisionError
    assert constants.HALF == before


def test_shares_count_cases_that_differ():
    base = {"verdict": "explained", "names": ["delay"], "ambiguity": []}
    other = base | {"names": []}
    case = lambda half, double: {"base": base, "HALF x0.5": half, "HALF x2": double}  # noqa: E731
    cases = {"a": case(base, base), "b": case(other, base), "c": case(base, other), "d": case(other, base)}
    entry = shares(cases, ["HALF"])
    assert entry["HALF"]["half"] == entry["HALF"]["share"] == 0.5 and entry["HALF"]["double"] == 0.25
    assert entry["HALF"]["changed"] == {"half": ["b", "d"], "double": ["c"]}
    assert entry["HALF"]["verdicts"] == 0.5


def test_another_alternative_is_no_other_verdict():
    base = {"verdict": "ambiguous", "names": ["delay"], "ambiguity": [["friction", "iron_loss"]]}
    longer = base | {"ambiguity": [["cogging", "friction", "iron_loss"]]}
    entry = shares({"a": {"base": base, "HALF x0.5": base, "HALF x2": longer}}, ["HALF"])
    assert entry["HALF"]["share"] == 1.0 and entry["HALF"]["verdicts"] == 0.0


@pytest.fixture
def folder(tmp_path):
    """A recording of a drive whose resistance is wrong by a third."""
    out = tmp_path / "case_0001"
    out.mkdir()
    table = columns(GRID, (("resistance_ohm", 1.3 * MACHINE.resistance_ohm),))
    pd.DataFrame(table).to_parquet(out / "recording.parquet")
    (out / "drive.toml").write_text(PAPER.read_text())
    return out


@pytest.mark.slow
def test_a_case_under_variations(folder):
    """Neither the prior nor the threshold of a name changes a resistance that is wrong by a third."""
    case, out = answers_of(("own/case_0001", folder, ["PRESENT", "HALF"]))
    assert case == "own/case_0001" and set(out) == {"base", "PRESENT x0.5", "PRESENT x2", "HALF x0.5", "HALF x2"}
    assert out["base"]["names"] == ["resistance"] and all(value == out["base"] for value in out.values())


def test_a_recording_without_a_steady_stretch_does_not_count(folder):
    table = pd.read_parquet(folder / "recording.parquet")
    table.iloc[::400].to_parquet(folder / "recording.parquet")
    assert answers_of(("own/case_0001", folder, ["HALF"])) == ("own/case_0001", {})


@pytest.mark.parametrize(
    "name, factor",
    [
        slowly("BALANCE_U", 1e4),
        *(slowly(name, 2.0) for name in ("BALANCE_U", "POINT")),
        *(slowly(name, 0.5) for name in ("FORMULA", "PRESENT", "DOUBTED", "MISREAD")),
    ],
)
def test_what_is_reused_changes_no_answer(folder, name, factor):
    """A balance that is wrong by the whole voltage changes the answer, the other variations do not."""
    case = Case(folder)
    with recorded():
        base = case.base()
        reused = case.varied(name, factor)
    assert base == said_in_full(case.loaded, case.nominal)
    with varied(name, factor):
        assert reused == said_in_full(case.loaded, case.nominal)
    assert (reused != base) == (factor == 1e4)
