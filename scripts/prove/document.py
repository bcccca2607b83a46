# SPDX-License-Identifier: BSD-3-Clause
"""The table of docs/proofs.md, from the last complete run: ``python -m scripts.prove --document``."""

from __future__ import annotations

import json
from datetime import date
from pathlib import Path

from fluxproof.checkout import ROOT
from fluxproof.files import write_text
from scripts.prove.solve import FOLDER

DOCUMENT = ROOT / "docs" / "proofs.md"
BEGIN, END = "<!-- table: python -m scripts.prove --document -->", "<!-- end of the table -->"


def method_of(entry: dict) -> str:
    """The method of a proof in a few words."""
    if entry["method"] == "pdr":
        return "pdr, unbounded"
    if entry["method"] == "induction":
        return f"induction, k = {entry['depth']}"
    return f"to clock {entry['depth']} only"


def _row(name: str, says: str, method: str, assumed: str, entries: list[dict]) -> str:
    planted = [mutant for entry in entries for mutant in entry["mutants"]]
    caught = f"{sum(m['caught'] for m in planted)} of {len(planted)}"
    proved = "proved" if all(e["pass"] for e in entries) else "**not proved**"
    return f"| `{name}` | {says} | {method} | {assumed} | {proved}, {caught} |"


def table(entries: list[dict], day: str) -> str:
    """Markdown: a row for each property, one for all blocks' pipelines."""
    rows = ["| property | what | method | assumed | last result, faults caught |", "|---|---|---|---|---|"]
    blocks = [e for e in entries if e["property"].startswith("pipeline_") and e["entity"] != "fluxproof_flat"]
    for entry in entries:
        if entry not in blocks:
            rows.append(_row(entry["property"], entry["says"], method_of(entry), entry["assumed"], [entry]))
        elif entry is blocks[0]:
            depths = sorted(e["depth"] for e in blocks)
            says = f"out_valid of each of {len(blocks)} blocks: LATENCY clocks after in_valid, never otherwise"
            method = f"induction, k = {depths[0]} to {depths[-1]}"
            rows.append(_row("pipeline_BLOCK", says, method, "samples at least the block's interval apart", blocks))
    proved, planted = sum(e["pass"] for e in entries), [m for e in entries for m in e["mutants"]]
    caught, seconds = sum(m["caught"] for m in planted), sum(e["seconds"] for e in entries)
    rows.append(
        f"\n{proved} of {len(entries)} properties proved, {caught} of {len(planted)} planted faults caught "
        f"(`make prove`, {day}; {seconds:.0f} s of solving, one after the other)."
    )
    return "\n".join(rows)


def write(result: Path = FOLDER / "result.json", document: Path = DOCUMENT) -> Path:
    """Puts the table of ``result`` between the marks of ``document``; ValueError if a mark is missing."""
    text = document.read_text()
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise ValueError(f"{document.name}: expected one line {BEGIN!r} and one line {END!r}")
    before, rest = text.split(BEGIN)
    entries = json.loads(result.read_text())
    day = date.fromtimestamp(result.stat().st_mtime).isoformat()
    return write_text(document, f"{before}{BEGIN}\n{table(entries, day)}\n{END}{rest.split(END)[1]}")
