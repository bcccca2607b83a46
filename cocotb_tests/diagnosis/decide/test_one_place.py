# SPDX-License-Identifier: BSD-3-Clause
"""A decision and its answer are made in one place each, and nothing writes to them."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import pkgutil

import pytest

from cocotb_tests.support.diagnoses.samples import made_up
from fluxproof.checkout import ROOT
from fluxproof.diagnosis import decide, plan
from fluxproof.diagnosis.ground import result

ROOM = ROOT / "fluxproof" / "diagnosis"


def defined(module) -> list[type]:
    """The dataclasses of a module."""
    mine = [x for x in vars(module).values() if isinstance(x, type) and x.__module__ == module.__name__]
    return [x for x in mine if dataclasses.is_dataclass(x)]


def modules() -> list:
    rooms = [importlib.import_module(m.name) for room in (decide, plan)
             for m in pkgutil.iter_modules(room.__path__, f"{room.__name__}.")]  # fmt: skip
    return [result, *rooms]


def calls(tree, name) -> list[ast.Call]:
    found = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    return [node for node in found if isinstance(node.func, ast.Name) and node.func.id == name]


def places(name) -> set[str]:
    """Files of the diagnosis that call ``name``, beside the one that defines it."""
    trees = {path: ast.parse(path.read_text()) for path in sorted(ROOM.rglob("*.py"))}
    return {path.relative_to(ROOM).as_posix() for path, tree in trees.items() if calls(tree, name)}


def test_results_and_decisions_are_frozen():
    kinds = {kind.__name__: kind for module in modules() for kind in defined(module)}
    assert {"Diagnosis", "NamedEffect", "Estimate", "Fit", "Decision", "Basis", "Judgement", "Planned"} <= set(kinds)
    # Rivalry is a table of sums for one design, and nothing that is decided.
    assert [name for name, kind in kinds.items() if not kind.__dataclass_params__.frozen] == ["Rivalry"]
    with pytest.raises(dataclasses.FrozenInstanceError):
        made_up()["explained"].sentence = "another one"


def test_a_diagnosis_holds_no_list():
    """A list of a frozen result could still be appended to."""
    lists = [f.name for f in dataclasses.fields(result.Diagnosis) if str(f.type).startswith("list")]
    assert not lists


def test_only_build_makes_a_diagnosis_and_only_decide_a_decision():
    assert places("Diagnosis") == {"build.py"} and places("headline") == {"build.py"}
    made = places("Decision")
    assert {"decide/conclude.py", "decide/one_point.py", "decide/rules.py"} == made


def test_verdicts_are_spelt_in_decide_alone():
    """Elsewhere a verdict is compared or shown, and never passed to what makes an answer."""
    verdicts = set(result.VERDICTS)
    found = set()
    for path in sorted(ROOM.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            returned = node.value if isinstance(node, ast.Return) else None
            values = [returned] if not isinstance(returned, ast.IfExp) else [returned.body, returned.orelse]
            if any(isinstance(v, ast.Constant) and v.value in verdicts for v in values):
                found.add(path.relative_to(ROOM).as_posix())
    assert found == {"decide/verdict.py"}
