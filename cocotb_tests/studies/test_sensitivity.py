"""The sensitivity of the verdicts to the constants: what is varied, what counts as changed, and the figures."""

from __future__ import annotations

import ast

import pandas as pd
import pytest

from cocotb_tests.core.test_registers import PAPER
from cocotb_tests.support.diagnosed_drives import GRID, MACHINE, columns
from fluxproof.checkout import ROOT
from fluxproof.diagnosis import diagnose
from fluxproof.diagnosis.inference import constants
from studies.sensitivity.run import OF_SLOW_LOGS, OF_THE_ANSWER, answers_of, names, said, shares, varied


def test_every_constant_is_varied():
    declared = {t.id for node in ast.parse(open(constants.__file__).read()).body if isinstance(node, ast.Assign)
                for target in node.targets for t in ast.walk(target) if isinstance(t, ast.Name)}  # fmt: skip
    assert declared == set(names()) | set(OF_SLOW_LOGS) and set(OF_THE_ANSWER) <= set(names())


def test_constants_of_the_answer_are_not_read_by_the_search():
    """Otherwise the posterior would have to be found again when one of them changes."""
    for path in (ROOT / "diagnosis/inference").glob("*.py"):
        used = {n.attr for n in ast.walk(ast.parse(path.read_text()))
                if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name) and n.value.id == "k"}  # fmt: skip
        assert not used & set(OF_THE_ANSWER), path.name


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


def test_a_case_under_variations(tmp_path):
    """Neither the prior nor the threshold of a name changes a resistance that is wrong by a third."""
    folder = tmp_path / "case_0001"
    folder.mkdir()
    table = columns(GRID, (("resistance_ohm", 1.3 * MACHINE.resistance_ohm),))
    pd.DataFrame(table).to_parquet(folder / "recording.parquet")
    (folder / "drive.toml").write_text(PAPER.read_text())
    case, out = answers_of((folder, ["PRESENT", "HALF"]))
    assert case == "case_0001" and set(out) == {"base", "PRESENT x0.5", "PRESENT x2", "HALF x0.5", "HALF x2"}
    assert out["base"] == said(diagnose(folder / "recording.parquet", PAPER))
    assert out["base"]["names"] == ["resistance"] and all(value == out["base"] for value in out.values())
