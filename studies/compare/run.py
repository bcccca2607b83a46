# SPDX-License-Identifier: BSD-3-Clause
"""Run every method on a case, and compute the figures of all answers.

The answer of every method has the form of diagnosis.json as far as applicable, so that the figures of the blind
benchmark apply: "named right" means exactly the true effects.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from studies.blind import figures
from studies.compare.data import holdout_rms, load, neighbour_rms, recording_of
from studies.compare.methods import METHODS, TITLES


def answer_of_names(names) -> dict:
    """The verdict of a method that only gives names."""
    return {"verdict": "explained" if names else "no_mismatch", "effects": [{"name": n} for n in names]}


def _diagnose(folder: Path):
    """Answer of the diagnosis and the block means of u that its model leaves, complex (b,) or None."""
    from fluxproof.diagnosis import diagnose

    found = diagnose(recording_of(folder), folder / "drive.toml")
    kept = found.evidence.arrays
    left = kept["after_d"] + 1j * kept["after_q"] if "after_d" in kept else None
    answer = found.to_json()
    effects = [{"name": effect["name"]} for effect in answer["effects"]]
    return {"verdict": found.verdict, "effects": effects, "ambiguity": found.ambiguity}, left


def _other(name: str, settings: dict, folder: Path):
    data = load(folder)
    fitted = METHODS[name].fit(data, **settings["fit"])
    return answer_of_names(METHODS[name].names(fitted, **settings["names"])), fitted.left


def answers_of(job: tuple[Path, dict]) -> dict[str, dict]:
    """{method: answer with seconds, holdout_v and noise_v} of one case; an exception is an answer too.

    The noise floor is common: the smallest difference of neighbouring blocks under any of the models.
    """
    folder, settings = job
    answers, left = {}, {}
    for name in TITLES:
        began = time.perf_counter()
        try:
            answer, left[name] = _diagnose(folder) if name == "diagnose" else _other(name, settings[name], folder)
            answers[name] = answer | {"seconds": time.perf_counter() - began}
        except Exception as error:  # the comparison counts exceptions and continues
            answers[name] = {"error": f"{type(error).__name__}: {error}"}
    try:
        _add_fit(answers, left, load(folder))
    except ValueError as error:
        for answer in answers.values():
            answer.setdefault("error", str(error))
    return answers


def _add_fit(answers, left, data):
    nominal = data.misfit["u"].mean(axis=1)
    usable = {n: x for n, x in left.items() if x is not None and len(x) == len(nominal)}
    floor = min(neighbour_rms(x, data.view.run) for x in (nominal, *usable.values()))
    for name, x in usable.items():
        answers[name] |= {
            "holdout_v": holdout_rms(x, data.held),
            "nominal_v": holdout_rms(nominal, data.held),
            "noise_v": floor,
        }


def summary(cases: list[tuple[dict, dict]]) -> dict:
    """Figures of one method.  cases: (truth, answer) pairs of single effects, pairs and healthy drives."""
    part = {s: [(t, a) for t, a in cases if t["stratum"] == s] for s in ("single", "pair", "healthy")}
    fair = {s: [(t, a) for t, a in part[s] if figures.identifiable(t)] for s in part}
    with_effect = part["single"] + part["pair"]
    ratios = [a["holdout_v"] / a["noise_v"] for t, a in with_effect if a.get("noise_v", 0.0) > 0.0]
    seconds = [a["seconds"] for t, a in cases if "seconds" in a]
    return {
        "single_named_right": figures.rate("", [figures.named_right(t, a) for t, a in fair["single"]]),
        "single_truth_among_names": figures.rate(
            "", [figures.true_names(t) <= figures.asserted(a) for t, a in fair["single"]]
        ),
        "pairs_exactly_right": figures.rate("", [figures.named_right(t, a) for t, a in fair["pair"]]),
        "confidently_wrong": figures.rate("", [figures.confidently_wrong(t, a) for t, a in cases]),
        "false_alarm_healthy": figures.rate("", [a.get("verdict") != "no_mismatch" for t, a in part["healthy"]]),
        "says_it_cannot_tell": figures.rate("", [a.get("verdict") in ("ambiguous", "unexplained") for t, a in cases]),
        "holdout_over_floor": _quantiles(ratios),
        "seconds": _quantiles(seconds),
        "breakdowns": sum("error" in a for t, a in cases),
    }


def _quantiles(values):
    if not values:
        return {"median": None, "p95": None, "n": 0}
    return {"median": float(np.median(values)), "p95": float(np.quantile(values, 0.95)), "n": len(values)}
