# SPDX-License-Identifier: BSD-3-Clause
"""`make faults`: response to faults of sensors, bus, strobes and software; converted RTL against golden core.

Writes build/faults/result.json and the table build/faults/table.md; ``--docs`` puts the table into docs/faults.md.
Exit status: 0 if every case responds as expected without differences, 1 otherwise.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from pathlib import Path

import numpy as np

from fluxproof.checkout import BUILD, ROOT
from fluxproof.cosim.closed_loop import gate_words
from fluxproof.cosim.scenarios import RPM
from fluxproof.files import write_json, write_text
from studies.faults.bench import NEAR_RPM, NO_CURRENT_A, Case, Outcome, named, run, setup
from studies.faults.cases import cases, extremes, extremes_verdict
from studies.faults.cores import VerilatedClock

CARRIER_HALF = 128
MOST_CLOCKS = 2  # from the cause to gates off
PERIOD_MS = 0.1
DOCS = ROOT / "docs" / "faults.md"
MARKS = ("<!-- table: python -m studies.faults --docs -->", "<!-- end of table -->")


def row(case: Case, outcome: Outcome) -> dict:
    """The result of a case, times in ms."""
    o, clear = outcome, case.clears[0]
    trip, rpm = o.tripped_at, o.omega_m / RPM
    result = {
        "name": case.name,
        "what": case.text,
        "gates": "on" if trip is None else "off",
        "clocks_to_off": None if trip is None else trip - o.decided,
        "clocks_from_sample": None if trip is None or o.strobed is None else trip - o.strobed,
        "after_ms": None if trip is None else round((trip - o.begin(case.start)) / o.period_clocks * PERIOD_MS, 2),
        "flags": named(int(o.column("fault_flags")[o.begin(clear)])),
        "first": named(int(o.column("first_fault")[o.begin(clear)])),
        "early_samples": int(o.column("early_samples").max()),
        "peak_current_a": round(float(np.abs(o.i_abc[case.start : clear]).max()), 2),
    }
    if trip is not None:
        still = np.abs(o.i_abc).max(axis=1) < NO_CURRENT_A
        first = -(-(trip - 1) // o.period_clocks)
        flown = np.flatnonzero(still[first:clear])
        result["no_current_after_ms"] = None if not len(flown) else round(flown[0] * PERIOD_MS, 2)
    away = np.flatnonzero(np.abs(rpm[clear:] - case.rpm) >= NEAR_RPM)
    result["speed_back_after_ms"] = round((away[-1] + 1 if len(away) else 0) * PERIOD_MS, 1)
    result["rpm_at_the_end"] = round(float(rpm[-1]), 1)
    result |= {"clocks_compared": len(o.seen), "samples_compared": o.samples, "differences": o.differences}
    return result | {"problems": problems(case, outcome, result)}


def problems(case: Case, outcome: Outcome, result: dict) -> list[str]:
    """List of deviations from the expected response."""
    o, found, trip = outcome, [], outcome.tripped_at
    words, clear = gate_words(o.seen), o.begin(case.clears[0])
    if o.differences:
        found.append(f"RTL and golden core differ: {o.first_difference}")
    if not o.column("running")[o.begin(case.start) - 1]:
        found.append("the drive did not run before the fault")
    if (case.trips is None) != (trip is None):
        found.append(f"tripped at clock {trip}, expected {case.trips}")
    if trip is not None and case.trips is not None:
        if case.trips not in result["first"]:
            found.append(f"first fault {result['first']}, expected {case.trips}")
        if not 0 < result["clocks_to_off"] <= MOST_CLOCKS:
            found.append(f"gates off after {result['clocks_to_off']} clocks")
        if words[trip - 1 : clear].any() or o.column("running")[trip - 1 : clear].any():
            found.append("a gate was on between trip and clear")
        if result["no_current_after_ms"] is None:
            found.append("the current did not decay")
    if not set(case.flags) <= set(result["flags"]) or (case.trips is None and set(case.flags) != set(result["flags"])):
        found.append(f"flags {result['flags']}, expected {case.flags}")
    if not o.column("running")[-1] or abs(result["rpm_at_the_end"] - case.rpm) >= NEAR_RPM:
        found.append(f"not back at {case.rpm:g} rpm: {result['rpm_at_the_end']} rpm")
    return found


def cell(value, unit: str = "") -> str:
    return "–" if value is None else f"{value}{unit}"


def within(ms: float | None) -> str:
    """A time with the resolution of one period, as text."""
    return "–" if ms is None else "within 0.1 ms" if ms < PERIOD_MS else f"{ms} ms"


def table(rows: list[dict]) -> str:
    """The cases as markdown."""
    head = (
        "| fault | gates | from the fault to gates off | clocks from the cause | flags (first in bold) | "
        "largest current, decayed after | speed back after the clear |"
    )
    lines = [head, "|---" * 7 + "|"]
    for r in rows:
        flags = ", ".join(f"**{f}**" if f in r["first"] else f for f in r["flags"]) or "none"
        decay = "" if r.get("no_current_after_ms") is None else f", {within(r['no_current_after_ms'])}"
        off = "stay on" if r["gates"] == "on" else "off"
        speed = "kept" if r["gates"] == "on" else cell(r["speed_back_after_ms"], " ms")
        lines.append(
            f"| {r['name']}: {r['what']} | {off} | {within(r['after_ms'])} | {cell(r['clocks_to_off'])} | {flags} "
            f"| {r['peak_current_a']} A{decay} | {speed} |"
        )
    return "\n".join(lines) + "\n"


def into_docs(text: str, path: Path = DOCS) -> None:
    """Replace the text between the marks; SystemExit if a mark is missing."""
    old = path.read_text()
    pattern = re.escape(MARKS[0]) + ".*?" + re.escape(MARKS[1])
    if not re.search(pattern, old, re.DOTALL):
        raise SystemExit(f"{path}: the lines {MARKS[0]} and {MARKS[1]} are missing")
    write_text(path, re.sub(pattern, lambda _: f"{MARKS[0]}\n\n{text}\n{MARKS[1]}", old, flags=re.DOTALL))


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="make faults", description=__doc__.splitlines()[0])
    parser.add_argument("--only", metavar="TEXT", help="cases with this in their name; writes nothing")
    parser.add_argument("--docs", action="store_true", help="put the table into docs/faults.md")
    options, began = parser.parse_args(argv), time.monotonic()
    drive, register_set = setup(CARRIER_HALF)
    chosen = [c for c in cases(2 * CARRIER_HALF) if (options.only or "") in c.name]
    rows = []
    for case in chosen:
        rows.append(row(case, run(case, VerilatedClock(register_set), drive, register_set)))
        r = rows[-1]
        print(
            f"{case.name:28s} gates {r['gates']:3s} after {cell(r['clocks_to_off']):>2s} clocks, first "
            f"{', '.join(r['first']) or 'none'}, {r['rpm_at_the_end']} rpm, {r['differences']} differences",
            flush=True,
        )
    writes = None
    if not options.only or options.only in "register writes":
        case = extremes(register_set)
        outcome = run(case, VerilatedClock(register_set), drive, register_set)
        writes = extremes_verdict(outcome, register_set)
        print("register writes", {k: v for k, v in writes.items() if k != "problems"}, flush=True)
    wrong = [f"{r['name']}: {p}" for r in [*rows, *([writes] if writes else [])] for p in r["problems"]]
    sys.stderr.writelines(f"{line}\n" for line in wrong)
    if options.only:
        return 1 if wrong else 0
    compared = sum(r["clocks_compared"] for r in [*rows, writes])
    result = {"cases": rows, "register_writes": writes, "clocks_compared": compared}
    result |= {"differences": sum(r["differences"] for r in [*rows, writes]), "passed": not wrong}
    result["wall_time_s"] = round(time.monotonic() - began, 1)
    write_json(BUILD / "faults" / "result.json", result)
    text = table(rows) + "\n" + writes["text"] + "\n"
    write_text(BUILD / "faults" / "table.md", text)
    if options.docs:
        into_docs(text)
    print(
        f"{compared:,} clocks compared, {result['differences']} differences; wrote build/faults/result.json, table.md"
    )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
