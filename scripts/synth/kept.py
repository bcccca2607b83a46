# SPDX-License-Identifier: BSD-3-Clause
"""Kept counts: docs/synth/counts.json, and what differs from it by more than 3 %.

The file changes only by ``--update "reason"``; its log says when, why and which figures moved.  Smaller changes
never add up unseen: they are measured against the kept figure, not against the last run.
"""

from __future__ import annotations

import datetime
import json
from collections.abc import Mapping
from pathlib import Path

from fluxproof.checkout import ROOT
from fluxproof.files import write_json

KEPT = ROOT / "docs" / "synth" / "counts.json"
LIMIT = 0.03
FIGURES = ("lut", "ff", "dsp", "bram")

Counts = Mapping[str, Mapping[str, Mapping[str, float] | None]]
"""{family: {row: {"lut", "ff", "dsp", "bram"} or None where the row's blocks are not there}}"""


def read(path: Path = KEPT) -> dict:
    """The kept file, {"tool", "counts", "log"}; an empty one where there is none; ValueError on nonsense."""
    if not path.exists():
        return {"tool": None, "counts": {}, "log": []}
    try:
        kept = json.loads(path.read_text())
    except json.JSONDecodeError as reason:
        raise ValueError(f"{path}: not JSON, line {reason.lineno}: {reason.msg}") from None
    for key, kind in (("counts", dict), ("log", list)):
        if not isinstance(kept.get(key), kind):
            raise ValueError(f"{path}: needs a {kind.__name__} {key!r}")
    return kept


def changes(kept: Counts, counted: Counts, limit: float = LIMIT) -> list[str]:
    """One line per figure of ``counted`` that is further from the kept one than ``limit``, or has none.

    Only families and rows in ``counted`` are looked at, so that a run of one family is not a change of the others.
    """
    lines = []
    for family, rows in counted.items():
        for row, figures in rows.items():
            if row not in kept.get(family, {}):
                lines.append(f"{family} {row}: never kept")
                continue
            before = kept[family][row]
            if figures is None or before is None:
                if figures != before:
                    lines.append(f"{family} {row}: {'was' if figures is None else 'was not'} there")
                continue
            lines += [
                f"{family} {row} {name}: {_number(before, name)} kept, {figures[name]:g} counted"
                for name in FIGURES
                if name not in before or abs(figures[name] - before[name]) > limit * before[name]
            ]
    return lines


def _number(figures: Mapping[str, float], name: str) -> str:
    return f"{figures[name]:g}" if name in figures else "none"


def update(counted: Counts, reason: str, tool: str, path: Path = KEPT, date: str | None = None) -> list[str]:
    """Keeps every figure of ``counted`` and logs ``reason``; returns what had changed by more than 3 %."""
    if not reason.strip():
        raise ValueError('--update needs a reason, for instance --update "svm shares its adder"')
    kept = read(path)
    moved = changes(kept["counts"], counted)
    for family, rows in counted.items():
        kept["counts"].setdefault(family, {}).update(rows)
    kept["tool"] = tool
    entry = {"date": date or datetime.date.today().isoformat(), "reason": reason.strip(), "changes": moved}
    kept["log"].append(entry)
    write_json(path, kept)
    return moved
