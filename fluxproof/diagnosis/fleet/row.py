# SPDX-License-Identifier: BSD-3-Clause
"""A diagnosis as a row of fleet.parquet: what follows from recording and drive file alone (schema.py)."""

from __future__ import annotations

import dataclasses
import math

from fluxproof.diagnosis.fleet.hypotheses import BASE, hypotheses
from fluxproof.diagnosis.ground.result import Diagnosis
from fluxproof.diagnosis.inference.posterior import Posterior

REASON = 300  # letters of a reason


def row_of(answer: Diagnosis, posterior: Posterior | None) -> dict:
    """The columns of a diagnosis and of the posterior that it was decided from; the same answer gives the same row."""
    fit, digital, unknown = answer.fit, answer.digital, answer.unknown_term
    failed = answer.verdict == "bad_recording"
    row = {
        "reason": one_line(answer.sentence) if failed else None,
        "verdict": answer.verdict,
        "sentence": answer.sentence,
        "rows": answer.rows,
        "names": [{"effect": e.name, "confidence": e.confidence, "explains": e.explains} for e in answer.effects],
        "parameters": [
            {"effect": e.name, "parameter": key, **dataclasses.asdict(p)}
            for e in answer.effects
            for key, p in e.parameters.items()
        ],  # fmt: skip
        "ambiguity": answer.ambiguity,
        "explained_share": answer.explained_share,
        "misfit_before": fit.holdout_before,
        "misfit_after": fit.holdout_after,
        "noise_floor": fit.noise_floor,
        "misfit_unit": fit.unit,
        "remainder": [dataclasses.asdict(part) for part in answer.remainder],
        "unknown": dataclasses.asdict(unknown) if unknown is not None else None,
        "conventions": [c.code for c in answer.conventions],
        "problems": sorted({p.code for p in answer.problems}),
        "digital": _digital(digital),
        "hypotheses": [] if failed else _hypotheses(answer, posterior),
    }
    return {key: finite(value) for key, value in row.items()}


def failed_row(reason: str) -> dict:
    """The row of a recording that could not be diagnosed."""
    return {"reason": one_line(reason), "verdict": "bad_recording", "sentence": one_line(reason)}


def one_line(text: object) -> str:
    return writable(" ".join(str(text).split())[:REASON]) or "no reason given"


def writable(text: str) -> str:
    r"""Text that Parquet can hold: a byte of a file's name that is not UTF-8 becomes \udcNN."""
    return text.encode("utf-8", "backslashreplace").decode()


def _digital(digital) -> str:
    if not digital.checked:
        return "not recorded"
    d = digital.first_difference
    return "equal" if d is None else ", ".join(f"{key} {d.get(key)}" for key in ("block", "sample", "signal", "bit"))


def _hypotheses(answer, posterior) -> list[dict]:
    """The sets that a posterior leaves open; one operating point has none: what is named is its only set."""
    if posterior is not None:
        return hypothesis_rows(posterior)
    if answer.verdict in ("digital_mismatch", "bad_recording"):
        return []
    extras = sorted(e.name for e in answer.effects if e.name not in BASE)
    of = {e.name: e for e in answer.effects}
    return [
        {
            "extras": extras,
            "evidence": 0.0,
            "credible": [of[n].confidence for n in extras],
            "estimates": [
                {"effect": e.name, "parameter": key, **dataclasses.asdict(p)}
                for e in answer.effects
                for key, p in e.parameters.items()
            ],  # fmt: skip
            "left": [dataclasses.asdict(part) for part in answer.remainder],
            "left_share": None if answer.explained_share is None else 1.0 - answer.explained_share,
        }
    ]


def hypothesis_rows(posterior) -> list[dict]:
    """The sets that a posterior leaves open, as in fleet.parquet."""
    return [
        {
            "extras": list(h.extras),
            "evidence": h.evidence,
            "credible": [h.credible[n] for n in h.extras],
            "estimates": [dataclasses.asdict(e) for e in h.estimates],
            "left": [dataclasses.asdict(part) for part in h.left],
            "left_share": h.left_share,
        }
        for h in hypotheses(posterior)
    ]


def finite(value):
    """NaN and infinity become None, as Parquet's readers differ about them; texts become writable."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    if isinstance(value, str):
        return writable(value)
    if isinstance(value, bool) or value is None:
        return value
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
