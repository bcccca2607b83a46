# SPDX-License-Identifier: BSD-3-Clause
"""What decides "ambiguous": each rule on groups of effects that take each other's place."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fluxproof.diagnosis.decide.ambiguity import alternatives, ambiguities


def kept(*sets) -> list:
    """[(probability, fit)] of (probability, effects)."""
    return [(p, SimpleNamespace(names=tuple(names.split()))) for p, names in sets]


def effects(*without_parameter) -> dict:
    return {n: SimpleNamespace(named=n not in without_parameter) for n in "abcd"}


def groups(sets, sure=(), beyond=()):
    present: dict = {}
    for p, fit in sets:
        for n in fit.names:
            present[n] = present.get(n, 0.0) + p
    return ambiguities(sets, present, sure, effects(*beyond))


def test_effects_of_which_either_will_do_are_ambiguous():
    assert groups(kept((0.6, "a c"), (0.4, "b c")), sure="c") == (("a", "b"),)


@pytest.mark.parametrize(
    "sets, beyond",
    [
        (kept((0.6, "a"), (0.4, "a b")), ""),  # b is added, and replaces nothing
        (kept((0.985, "a"), (0.015, "b")), ""),  # b is too improbable to be an alternative: OPEN
        (kept((0.5, "a"), (0.4, "b"), (0.1, "")), ""),  # neither may be there: DOUBTED
        (kept((0.6, "a"), (0.4, "b")), "ab"),  # no simulation carries either
    ],
)
def test_what_is_no_ambiguity(sets, beyond):
    assert groups(sets, beyond=beyond) == ()


def test_groups_are_connected():
    """Of a or b, and b or c, any may stand for another; d, in all sets, is no alternative."""
    assert alternatives([frozenset(x) for x in ("ad", "bd", "cd")]) == [{"a", "b", "c"}]
    assert alternatives([frozenset(x) for x in ("d", "ad", "abd")]) == []
