# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark's tables: figures by functional form, strata, effects, confusion, times (see figures.py)."""

from __future__ import annotations

from collections import Counter, defaultdict

import numpy as np

from studies.blind.figures import (
    asserted,
    confidently_wrong,
    figures,
    form_class,
    identifiable,
    inside_ambiguity,
    named_right,
    rate,
    tied,
    true_names,
)


def by_form(cases, resolved=()) -> dict:
    """Figures of the cases whose effects all have the catalogue's form, and of the others."""
    split = {}
    for kind in ("catalogue", "other"):
        part = [(t, a) for t, a in cases if t["effects"] and form_class(t) == kind]
        names = {t["case"] for t, a in part}
        kept = figures(part, [r for r in resolved if r["case"] in names])
        split[kind] = {k: v for k, v in kept.items() if v.get("n")}
    return split


def by_stratum(cases) -> dict:
    """For each stratum: cases, named right, ambiguous with the truth inside, wrongly asserted, verdicts."""
    table = {}
    for stratum in sorted({t["stratum"] for t, a in cases}):
        part = [(t, a) for t, a in cases if t["stratum"] == stratum]
        table[stratum] = {
            "cases": len(part),
            "identifiable": sum(identifiable(t) for t, a in part),
            "named_right": rate("", [named_right(t, a) for t, a in part]),
            "inside_ambiguity": rate("", [a.get("verdict") == "ambiguous" and inside_ambiguity(t, a) for t, a in part]),
            "confidently_wrong": rate("", [confidently_wrong(t, a) for t, a in part]),
            "verdicts": dict(Counter(a.get("verdict", "error") for t, a in part)),
        }
    return table


def by_effect(cases) -> dict:
    """For each effect: asserted, tied or missed if present, and asserted if absent."""
    table = defaultdict(Counter)
    for t, a in cases:
        for effect in t["effects"]:
            name = effect["name"]
            row = table[name]
            separable = t["identifiable"]["effects"].get(name, False)
            row["present"] += 1
            row["identifiable"] += separable
            where = "asserted" if name in asserted(a) else "tied" if name in tied(a) else "missed"
            row[where] += 1
            row[f"identifiable_{where}"] += separable
        for name in asserted(a) - true_names(t):
            table[name]["false"] += 1
    return {name: dict(table[name]) for name in sorted(table)}


def confusion(cases) -> dict:
    """{truth: {asserted: count}}.

    A true effect that was not asserted counts against the one wrongly asserted instead, or against (tied),
    (unexplained), (none).
    """
    table = defaultdict(Counter)
    for t, a in cases:
        names, said = true_names(t), asserted(a)
        wrong = said - names
        for name in names or {f"({t['stratum']})"}:
            if name in said:
                table[name][name] += 1
                continue
            if wrong:
                table[name].update(wrong)
            elif name in tied(a):
                table[name]["(tied)"] += 1
            else:
                table[name]["(unexplained)" if a.get("verdict") == "unexplained" else "(none)"] += 1
    return {name: dict(table[name]) for name in sorted(table)}


def times(cases) -> dict:
    """Seconds per case, and rows per second."""
    seconds = np.array([a["seconds"] for t, a in cases if "seconds" in a])
    if not len(seconds):
        return {}
    rows = np.array([t["rows"] for t, a in cases if "seconds" in a])
    return {
        "median_s": float(np.median(seconds)),
        "max_s": float(seconds.max()),
        "sum_s": float(seconds.sum()),
        "rows_per_s": float(rows.sum() / seconds.sum()),
    }
