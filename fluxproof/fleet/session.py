# SPDX-License-Identifier: BSD-3-Clause
"""A run over a fleet: keys, what is done already, the rest on the engine, the table, the findings, the page."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fluxproof.diagnosis.fleet.findings import Findings, findings
from fluxproof.files import refuse_overwriting
from fluxproof.fleet.engine import Engine, Lost, Progress
from fluxproof.fleet.manifest import Entry
from fluxproof.fleet.page import PAGE, write_page
from fluxproof.fleet.table import FLEET, Rows, joined, write_fleet
from fluxproof.fleet.work import Item, design, key_of, version, work
from fluxproof.stage import together


@dataclass(frozen=True)
class Outcome:
    """What a run did: diagnosed recordings, those that were done already, the findings of all."""

    diagnosed: int
    kept: int
    failed: int
    findings: Findings
    fleet: Path
    page: Path


def run(
    entries: list[Entry],
    out: Path,
    engine: Callable[[], Engine] = Engine,
    limits: dict[str, str] | None = None,
    quiet: bool = False,
    told: Callable[[Engine], None] = lambda engine: None,
    limit_s: float | None = None,
) -> Outcome:
    """Diagnose what is not done yet and write OUT/fleet.parquet and OUT/fleet.html, together.

    engine: makes the engine, which is started only if something is to be done; told: called with it once it runs;
    limit_s: the most that reading one recording for its key may take.
    Raises OSError if a row cannot be written: what was written stays, and the next run goes on from there.
    """
    refuse_overwriting([out / FLEET, out / PAGE], [path for e in entries for path in (e.path, e.drive)])
    rows = Rows(out)
    keys, failures = keys_of(entries, limit_s)
    todo = {key: name for name, key in keys.items() if not rows.has(key)}
    items = _items(entries, keys, todo)
    if items:
        with engine() as running:
            told(running)
            failures |= _diagnose(running, items, rows, todo, quiet)
    table = joined(entries, keys, rows, _shared(failures, keys))
    with together(out, (FLEET, PAGE)) as stage:
        write_fleet(stage, table)
        found = findings(table, limits)
        write_page(stage, found)
    failed = sum(row["status"] != "done" for row in table)
    return Outcome(len(items), len(entries) - len(items), failed, found, out / FLEET, out / PAGE)


def keys_of(entries, limit_s=None) -> tuple[dict[str, str], dict[str, str]]:
    """({name: key}, {name: reason}) of the recordings that can and that cannot be read."""
    keys, failures = {}, {}
    for entry in entries:
        try:
            keys[entry.name] = key_of(entry.path, entry.drive, limit_s=limit_s)
        except (OSError, ValueError) as error:
            said = getattr(error, "strerror", None) or error
            failures[entry.name] = f"cannot be read: {said}" if isinstance(error, OSError) else str(error)
    return keys, failures


def _items(entries, keys, todo) -> list[Item]:
    """One item for each row that is missing: files of the same content are diagnosed once."""
    chosen = set(todo.values())
    return [Item(e.path, e.drive, keys[e.name], design(e.drive), version()) for e in entries if e.name in chosen]


def _diagnose(engine, items, rows, names, quiet) -> dict[str, str]:
    """Run the items and write their rows; {name: reason} of those that left no lasting row."""
    failures, progress = {}, Progress(len(items), "diagnosed", quiet, sys.stderr)
    for item, result in engine.each(work, items):
        if isinstance(result, Lost):
            failures[names[item.key]] = result.reason
        elif result.lasting:
            rows.write(item.key, result.row)
        else:
            failures[names[item.key]] = result.row["reason"]
        progress.step()
    return failures


def _shared(failures, keys) -> dict[str, str]:
    """The failures also of the other names of the same content."""
    by_key = {keys[name]: reason for name, reason in failures.items() if name in keys}
    return {**failures, **{name: by_key[key] for name, key in keys.items() if key in by_key}}
