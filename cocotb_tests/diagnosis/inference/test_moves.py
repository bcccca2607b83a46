# SPDX-License-Identifier: BSD-3-Clause
"""Every move of the search finds a set that the others miss (inference/moves/).

The evidence of the sets stands in a table (support/diagnoses/surface.py): "ab" on the recording as it is, on its own
linearisation, or on that of another set.  The effects e and f are measurement errors.
"""

from __future__ import annotations

import importlib
from types import SimpleNamespace

import pytest

from cocotb_tests.support.diagnoses.surface import Table
from fluxproof.diagnosis.inference import moves
from fluxproof.diagnosis.inference.search import search

BEYOND = {(n, ""): -30.0 for n in "abcd"}  # single effects better than the rest, and too far below for a second look


def own(names, value, first=None):
    """A set with this evidence on its own linearisation and another one on the recording as it is."""
    return {(names, names): value} | ({(names, ""): first} if first is not None else {})


# {move: (table, set that it finds)}
CASES = {
    # An angle off by half a radian: as a linear change of the data it explains little.
    "corrections": (BEYOND | own("e", 100.0, -50.0), "e"),
    # A saturation alone, whose curve fits only around the flux that it leaves.
    "leaders": (own("a", 100.0, -25.0), "a"),
    # Two effects of which neither explains anything alone, beside a third that explains a part.
    "grow": (own("s", 60.0, -10.0) | own("ab", 100.0, 55.0), "ab"),
    # An angle that is off by a radian: a linear step leads nowhere, one of the starts does.
    "far": (BEYOND | own("e", -60.0) | {("e", 3.0): 100.0}, "e"),
    # Pairs with the same columns until the data are corrected; the best of them is not the true one.
    "alike": (own("ab", 50.0, 50.0) | own("gh", 47.0, 47.0) | own("cd", 100.0, 45.0), "cd"),
    # A cause beside a wrong angle: seen only where the angle is corrected.
    "neighbours": (own("e", 50.0) | {("ae", "e"): 90.0} | own("ae", 90.0), "ae"),
    # Another measurement error than that of the best set explains more on its own linearisation.
    "other_errors": (own("ab", 60.0, 60.0) | {("be", "ab"): 45.0} | own("be", 100.0), "be"),
    # A cause beside the right angle, which the best set corrects together with a wrong current.
    "within_errors": (
        own("ef", 60.0, 60.0) | own("aef", 80.0, 80.0) | own("e", 20.0) | {("be", "e"): 100.0} | own("be", 100.0),
        "be",
    ),
    # An offset beside a resistance that is half wrong: three other causes stand for what is not linear.
    "simpler": (own("abc", 100.0, 100.0) | own("g", 40.0, 40.0) | own("de", 120.0, 45.0), "de"),
    # A friction that is impossible beside a wrong load is possible alone.
    "parts": (BEYOND | own("ef", 100.0, 100.0) | own("g", 120.0, float("-inf")) | own("fg", 110.0, 105.0), "g"),
    # A pair that explains less than the best one only where the latter's data are corrected.
    "rivals": (own("ab", 100.0, 100.0) | {("bc", "ab"): 70.0} | own("bc", 130.0), "bc"),
}


def found(table, without=None, monkeypatch=None, **more) -> str:
    """The letters of the best set, without a move."""
    for kind in ("FIRST", "AROUND", "LAST") if without else ():
        kept = [move for move in getattr(moves, kind) if move.__name__ != without]
        monkeypatch.setattr(moves, kind, kept)
    return "".join(Table(table, effects="abcdefghs", **more).found().names)


@pytest.mark.parametrize("name", CASES)
def test_a_move_finds_what_the_others_miss(name, monkeypatch):
    table, truth = CASES[name]
    more = {"starts": (3.0,), "coefficient": lambda x: x} if name == "far" else {}
    assert found(table, **more) == truth
    assert found(table, name, monkeypatch, **more) != truth


def test_the_best_set_stands(monkeypatch):
    """Its coefficients halve their error in every step: after one or three of them they are not yet right."""
    table = Table(own("a", 100.0, 100.0), coefficient=lambda x: 1.0 + 0.5 * (x - 1.0))
    best = table.found()
    assert best.stands and best.c["a"]["x"] == pytest.approx(1.0, abs=2e-3)
    monkeypatch.setattr(moves, "LAST", [move for move in moves.LAST if move.__name__ != "stand"])
    assert not table.found().stands


class Led:
    """Twelve sets that lead on the linearisation of another one, and lose by their own; one that stands below them."""

    def __init__(self):
        self.fits = {(n,): SimpleNamespace(names=(n,), value=100.0, stands=False) for n in "abcdefghijkl"}
        self.fits["z",] = SimpleNamespace(names=("z",), value=50.0, stands=True)

    def best(self):
        return max(self.fits.values(), key=lambda fit: fit.value)

    def linearise(self, names, steps):
        self.fits[names] = SimpleNamespace(names=names, value=-10.0, stands=False)


def test_what_leads_on_the_linearisation_of_another_set_loses_one_after_another():
    led = Led()
    moves.stand(led, led.best().names)
    assert led.best().names == ("z",)


def test_every_move_has_a_case():
    listed = [move.__name__ for move in (*moves.FIRST, *moves.AROUND, *moves.LAST)]
    assert sorted(listed) == sorted([*CASES, "stand"]) and len(set(listed)) == len(listed)
    assert all(importlib.import_module(f"{moves.__name__}.{name}").__doc__ for name in listed)


def test_a_posterior_is_read_only():
    posterior = search(Table(own("ab", 100.0, 100.0) | own("b", 40.0, 40.0)).setup)
    assert posterior.best().names == ("a", "b")
    with pytest.raises(TypeError):
        posterior.fits["a",] = posterior.best()
