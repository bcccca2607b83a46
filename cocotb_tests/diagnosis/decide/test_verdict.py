# SPDX-License-Identifier: BSD-3-Clause
"""The rules that make the kind of a verdict."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fluxproof.diagnosis.decide.names import Names
from fluxproof.diagnosis.decide.sizes import Size
from fluxproof.diagnosis.decide.verdict import kind_as_interpreted, kind_of, kind_of_one_point

NAMED, EITHER = Names({"a": 0.99}, (), {}), Names({}, (("a", "b"),), {})
NOTHING, SUSPECT = Names({}, (), {}), Names({}, (), {}, {"s": 0.99})


def sizes(before, after, floor=1.0):
    """Sizes of one channel and order."""
    size = Size(before, after, floor, floor)
    share = 1.0 - size.left / size.excess if size.excess else None
    return SimpleNamespace(channels={"u": size}, orders={("u", 0.0): size}, share=lambda channel: share)


@pytest.mark.parametrize(
    "names, before, after, stray, kind",
    [
        (NAMED, 100.0, 1.0, None, "explained"),
        (EITHER, 100.0, 1.0, None, "ambiguous"),
        (NAMED, 100.0, 15.0, None, "explained"),  # a residual of 2 % is the formula's own error: SMALL
        (NAMED, 100.0, 50.0, None, "partly_explained"),
        (EITHER, 100.0, 50.0, None, "partly_explained"),
        (NAMED, 100.0, 80.0, None, "unexplained"),  # a third: less than HALF
        (NAMED, 100.0, 1.0, "an order of the shaft", "partly_explained"),
        (NOTHING, 1.0, 1.0, None, "no_mismatch"),
        (NOTHING, 1.0, 1.0, "an order of the shaft", "unexplained"),
        (NOTHING, 100.0, 100.0, None, "unexplained"),
        (SUSPECT, 1.0, 1.0, None, "unexplained"),
    ],
)
def test_kind_of_a_posterior(names, before, after, stray, kind):
    found = sizes(before, after)
    assert kind_of(names, found, found, "u", found.share("u"), stray) == kind


@pytest.mark.parametrize(
    "names, groups, left_over, quiet, kind",
    [
        ((), (), False, True, "no_mismatch"),
        ((), (), True, False, "unexplained"),
        (("a",), (), False, False, "explained"),
        (("a",), (("b", "c"),), False, False, "ambiguous"),
        (("a",), (), True, False, "partly_explained"),
        ((), (("b", "c"),), True, False, "ambiguous"),
    ],
)
def test_kind_of_one_point(names, groups, left_over, quiet, kind):
    assert kind_of_one_point(names, groups, left_over, quiet) == kind


def test_kind_under_an_interpretation():
    assert kind_as_interpreted("no_mismatch", 1.0, ()) == "explained"
    assert kind_as_interpreted("unexplained", 0.6, ("part",)) == "partly_explained"
    assert kind_as_interpreted("unexplained", 0.4, ("part",)) == "unexplained"
    assert kind_as_interpreted("ambiguous", 1.0, ()) == "ambiguous"
