# SPDX-License-Identifier: BSD-3-Clause
"""The figures of the benchmark from pairs of truth and answer; pure functions without files.

A truth is an entry of the sealed file (generate.py); an answer is ``Diagnosis.to_json()`` with ``seconds``,
or {"error": text} if the tool raised an exception.  Rates come with Wilson's 95 % interval.
"""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np

# name: (target, "min" or "max")
TARGETS = {
    "single_named_right": (0.95, "min"),
    "pairs_exactly_right": (0.90, "min"),
    "triples_exactly_right": (0.75, "min"),
    "confidently_wrong": (0.01, "max"),
    "false_alarm_healthy": (0.01, "max"),
    "truth_inside_ambiguity": (0.95, "min"),
    "request_resolves_tie": (0.90, "min"),
    "unknown_recognised": (0.90, "min"),
    "holdout_over_floor_median": (1.1, "max"),
    "parameter_error_median": (0.01, "max"),
    "coverage_95": ((0.93, 0.97), "within"),
    "median_time_s": (4.0, "max"),
}


def wilson(k: int, n: int, z: float = 1.959964) -> tuple[float, float]:
    """Wilson's interval of a rate of k in n; (0, 1) for n = 0."""
    if n == 0:
        return 0.0, 1.0
    share, weight = k / n, z * z / n
    centre = (share + weight / 2.0) / (1.0 + weight)
    half = z / (1.0 + weight) * math.sqrt(share * (1.0 - share) / n + weight / (4.0 * n))
    return max(0.0, centre - half), min(1.0, centre + half)


def _met(name, value):
    if name not in TARGETS or value is None:
        return {}
    target, kind = TARGETS[name]
    if kind == "within":
        return {"target": list(target), "met": target[0] <= value <= target[1]}
    return {"target": target, "met": value >= target if kind == "min" else value <= target}


def rate(name: str, hits) -> dict:
    """A figure from a list of booleans."""
    hits = list(hits)
    k, n = int(sum(hits)), len(hits)
    low, high = wilson(k, n)
    value = k / n if n else None
    return {"value": value, "k": k, "n": n, "low": low, "high": high, **_met(name, value)}


# -- one case ---------------------------------------------------------------------------------------------


def true_names(truth) -> set[str]:
    """Catalogue effects of the case; empty if it is healthy, damaged or unknown."""
    return {effect["name"] for effect in truth["effects"]}


def asserted(answer) -> set[str]:
    return {effect["name"] for effect in answer.get("effects", [])}


def tied(answer) -> set[str]:
    return {name for group in answer.get("ambiguity", []) for name in group}


def named_right(truth, answer) -> bool:
    """Explained, by exactly the true effects."""
    return answer.get("verdict") == "explained" and asserted(answer) == true_names(truth)


def confidently_wrong(truth, answer) -> bool:
    """Asserts an absent effect."""
    return bool(asserted(answer) - true_names(truth))


def inside_ambiguity(truth, answer) -> bool:
    """Whether every true effect is asserted or in an ambiguity set; False without ambiguity."""
    names = true_names(truth)
    return bool(names) and names <= asserted(answer) | tied(answer)


def problem_found(truth, answer) -> bool:
    """Whether the damage was rejected or named, and no effect was asserted."""
    if answer.get("verdict") == "bad_recording":
        return True
    problems = answer.get("recording", {}).get("problems", [])
    texts = [f"{p.get('code', '')} {p.get('message', '')}".lower() for p in problems]
    return any(code in text for code in truth["problem_codes"] for text in texts) and not asserted(answer)


def unknown_recognised(answer) -> bool:
    """Whether unknown physics was called unexplained, or explained in part with the rest located."""
    if answer.get("verdict") == "unexplained":
        return True
    return answer.get("verdict") == "partly_explained" and bool(answer.get("remainder"))


def form_class(truth) -> str:
    """catalogue, if every effect has the catalogue's form, else other."""
    return "catalogue" if all(e["form"] == "catalogue" for e in truth["effects"]) else "other"


def identifiable(truth) -> bool:
    return bool(truth["identifiable"]["all"])


# -- parameters -------------------------------------------------------------------------------------------

# Relative to the largest of the three phases, since one of them may be zero.
PHASES = ("a", "b", "c")
GROUPS = [
    [f"offset_{x}_a" for x in PHASES],
    [f"gain_{x}" for x in PHASES],
    [f"asymmetry_{x}" for x in PHASES],
]


def parameter_errors(truth, answer) -> list[dict]:
    """Error of every estimated parameter with a known true value, of effects that are present and asserted."""
    found = []
    estimates = {e["name"]: e.get("parameters", {}) for e in answer.get("effects", [])}
    for effect in truth["effects"]:
        given, true = estimates.get(effect["name"], {}), effect["parameters"]
        for name in sorted(set(given) & set(true)):
            group = next((g for g in GROUPS if name in g and set(g) <= set(given)), [name])
            scale = max(abs(true.get(x, 0.0)) for x in group)
            value, sigma, wanted = given[name]["value"], given[name]["sigma"], true[name]
            if name == "amplitude_rad":
                value = abs(value)
            if group is GROUPS[0]:  # the common mode is not visible in dq
                value -= np.mean([given[x]["value"] for x in group])
                wanted -= np.mean([true[x] for x in group])
            error = value - wanted
            found.append(
                {
                    "case": truth["case"],
                    "effect": effect["name"],
                    "form": effect["form"],
                    "parameter": name,
                    "true": wanted,
                    "value": float(value),
                    "sigma": sigma,
                    "relative": abs(error) / scale,
                    "covered": bool(abs(error) <= 1.959964 * sigma),
                }
            )
    return found


def _parameter_figures(errors):
    relative = [e["relative"] for e in errors]
    median = float(np.median(relative)) if relative else None
    tail = float(np.quantile(relative, 0.9)) if relative else None
    return {
        "parameter_error_median": {
            "value": median,
            "n": len(errors),
            "p90": tail,
            **_met("parameter_error_median", median),
        },
        "coverage_95": rate("coverage_95", [e["covered"] for e in errors]),
    }


# -- all cases --------------------------------------------------------------------------------------------


def _holdout(cases):
    ratios = [
        a["fit"]["holdout_after"] / a["fit"]["noise_floor"]
        for t, a in cases
        if a.get("verdict") == "explained" and a.get("fit", {}).get("noise_floor", 0.0) > 0.0
    ]
    median = float(np.median(ratios)) if ratios else None
    worst = float(np.quantile(ratios, 0.95)) if ratios else None
    return {
        "holdout_over_floor_median": {
            "value": median,
            "n": len(ratios),
            "p95": worst,
            **_met("holdout_over_floor_median", median),
        },
        "holdout_within_1.1": rate("", [r <= 1.1 for r in ratios]),
    }


def _median_time(cases) -> dict:
    """Median seconds of a diagnosis, for the rows that a case has."""
    seconds = [a["seconds"] for t, a in cases if "seconds" in a]
    median = float(np.median(seconds)) if seconds else None
    return {"value": median, "n": len(seconds), **_met("median_time_s", median)}


def figures(cases, resolved=()) -> dict:
    """Every figure of the table.  cases: (truth, answer) pairs; resolved: results of ``again.resolve``."""
    by = defaultdict(list)
    for t, a in cases:
        by[t["stratum"]].append((t, a))
    fair = {name: [(t, a) for t, a in by[name] if identifiable(t)] for name in by}
    blind = [(t, a) for t, a in cases if t["effects"] and not identifiable(t)]

    def right(name):
        return [named_right(t, a) for t, a in fair.get(name, ())]

    said_tied = [(t, a) for t, a in cases if a.get("verdict") == "ambiguous"]
    asked = [r for r in resolved if r["asked"]]
    errors = [e for t, a in cases for e in parameter_errors(t, a)]
    return {
        "single_named_right": rate("single_named_right", right("single")),
        "pairs_exactly_right": rate("pairs_exactly_right", right("pair")),
        "triples_exactly_right": rate("triples_exactly_right", right("triple")),
        "masked_named_right": rate("", right("masked")),
        "one_point_named_right": rate("", right("one_point")),
        "confidently_wrong": rate("confidently_wrong", [confidently_wrong(t, a) for t, a in cases]),
        "false_alarm_healthy": rate(
            "false_alarm_healthy", [a.get("verdict") != "no_mismatch" for t, a in by["healthy"]]
        ),
        "truth_inside_ambiguity": rate("truth_inside_ambiguity", [inside_ambiguity(t, a) for t, a in said_tied]),
        "request_resolves_tie": rate("request_resolves_tie", [r["resolved"] for r in asked]),
        "ambiguous_without_request": rate("", [not r["asked"] for r in resolved]),
        "unknown_recognised": rate("unknown_recognised", [unknown_recognised(a) for t, a in by["unknown"]]),
        "damage_found": rate("", [problem_found(t, a) for t, a in by["damaged"]]),
        # If the effect is not identifiable: correct, or at least nothing wrong asserted.
        "not_identifiable_honest": rate("", [not confidently_wrong(t, a) for t, a in blind]),
        "not_identifiable_inside": rate("", [named_right(t, a) or inside_ambiguity(t, a) for t, a in blind]),
        "breakdowns": rate("", ["error" in a for t, a in cases]),
        "median_time_s": _median_time(cases),
        **_holdout(cases),
        **_parameter_figures(errors),
    }
