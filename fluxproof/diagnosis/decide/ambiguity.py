# SPDX-License-Identifier: BSD-3-Clause
"""What decides "ambiguous": effects that take each other's place in the probable sets of a posterior.

There is no list of pairs: which effects resemble each other depends on the recording.
"""

from __future__ import annotations

from fluxproof.diagnosis.ground import constants as k


def ambiguities(kept, present, sure, effects) -> tuple[tuple[str, ...], ...]:
    """Groups of which one effect is there; kept: [(probability, effects)] of the sets that hold the posterior's mass.

    present: {effect: probability}; sure: effects that are named, so that they are no alternative.
    """
    rest = [frozenset(names) - set(sure) for _, names in kept]
    groups = [tuple(sorted(n for n in g if present[n] >= k.OPEN)) for g in alternatives(rest)]
    rules = (
        _has_rivals,
        lambda g: _is_needed(g, kept),
        lambda g: _has_a_parameter(g, effects),
    )
    return tuple(g for g in groups if all(rule(g) for rule in rules))


def alternatives(sets) -> list[set[str]]:
    """Effects that take each other's place: connected groups of effects, each in a set in which the other is not."""
    linked: dict[str, set[str]] = {}
    for n, a in enumerate(sets):
        for b in sets[n + 1 :]:
            if a - b and b - a:
                for x in a - b:
                    linked.setdefault(x, set()).update(b - a)
                for x in b - a:
                    linked.setdefault(x, set()).update(a - b)
    groups = []
    while linked:
        todo, group = [next(iter(linked))], set()
        while todo:
            name = todo.pop()
            if name not in group:
                group.add(name)
                todo += linked.pop(name, ())
        groups.append(group)
    return groups


def _has_rivals(group) -> bool:
    """One effect alone is no ambiguity."""
    return len(group) > 1


def _is_needed(group, kept) -> bool:
    """Of an alternative one effect is there; where none may be, its members are only possible."""
    held = sum(p for p, _ in kept)
    return sum(p for p, names in kept if set(group) & set(names)) >= (1.0 - k.DOUBTED) * held


def _has_a_parameter(group, effects) -> bool:
    """Causes that no simulation carries, and nothing else, are no ambiguity that a further recording would resolve."""
    return any(effects[n].named for n in group)
