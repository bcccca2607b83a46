"""`make mutate`: draws mutants of every block and of the core's wiring; their benches must notice them.

Writes build/mutate/result.json.  Exit status 1 if less than 99.5 % of the mutants that are not proved equivalent are
noticed, or if one of the others has no reason (scripts/mutate/table.py), or if a defect of the short list in the VHDL
(scripts/mutate/defects.py) is not noticed.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, as_completed

from fluxproof.cosim.verilog import NoUsableGhdl, find_ghdl
from fluxproof.files import write_json
from scripts.mutate import defects
from scripts.mutate.equivalent import DIFFERENT, EQUIVALENT, UNKNOWN
from scripts.mutate.judge import KILLED, Verdicts, judge
from scripts.mutate.subject import FOLDER, Core, Subject, subjects
from scripts.mutate.table import reason

SEED = 1
ENOUGH = 0.995  # of those not proved equivalent


def block_of(verdicts: Verdicts) -> str:
    """The block's name, without the number of its configuration."""
    return verdicts.name.rpartition("-")[0]


def summary(found: Sequence[Verdicts], seed: int, seconds: float) -> dict:
    """The content of result.json."""
    per_block: dict[str, dict[str, int]] = {}
    survivors = []
    for verdicts in sorted(found, key=lambda v: v.name):
        block = block_of(verdicts)
        row = per_block.setdefault(block, dict.fromkeys(("mutants", "killed", "equivalent", "survivors"), 0))
        row["mutants"] += len(verdicts.outcomes)
        row["killed"] += verdicts.count(KILLED)
        row["equivalent"] += verdicts.count(EQUIVALENT)
        row["survivors"] += verdicts.count(DIFFERENT) + verdicts.count(UNKNOWN)
        survivors += [
            {
                "block": block,
                "mutation": mutation,
                "reason": reason(block, mutation),
                "subject": verdicts.name,
                "proof": {DIFFERENT: "an input sequence shows it", UNKNOWN: "none in time"}[outcome],
            }
            for mutation, outcome in verdicts.outcomes
            if outcome in (DIFFERENT, UNKNOWN)
        ]
    totals = {name: sum(row[name] for row in per_block.values()) for name in ("mutants", "killed", "equivalent")}
    return totals | {"survivors": survivors, "per_block": per_block, "seed": seed, "seconds": round(seconds, 1)}


def share(result: dict) -> float:
    """Of the mutants that are not proved equivalent, the share that was noticed."""
    return result["killed"] / max(1, result["mutants"] - result["equivalent"])


def line_of(verdicts: Verdicts) -> str:
    """One subject's verdicts as a line of progress."""
    left = verdicts.count(DIFFERENT) + verdicts.count(UNKNOWN)
    counts = f"{verdicts.count(KILLED)} noticed, {verdicts.count(EQUIVALENT)} equivalent, {left} left"
    return f"{verdicts.name}: {len(verdicts.outcomes)} mutants, {counts}; {sum(verdicts.seconds.values()):.0f} s"


def main() -> int:
    parser = argparse.ArgumentParser(prog="mutate", description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", metavar="BLOCK", help="this block alone; fluxproof is the core's wiring")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="subjects in parallel")
    parser.add_argument("--seed", type=int, default=SEED, help="of the draw")
    arguments = parser.parse_args()
    chosen: list[Subject | Core] = [s for s in (Core(), *subjects()) if arguments.only in ("", s.of)]
    if not chosen:
        parser.error(f"--only {arguments.only}: no such block")
    try:
        find_ghdl()
    except NoUsableGhdl as reason_why:
        parser.exit(1, f"mutate: {reason_why}\n")
    began, found = time.monotonic(), []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        running = [pool.submit(judge, subject, arguments.seed) for subject in chosen]
        for done, future in enumerate(as_completed(running), 1):
            found.append(future.result())
            print(f"{done:3d}/{len(running)} {line_of(found[-1])}", flush=True)
    unnoticed = []
    if not arguments.only:
        with ThreadPoolExecutor(arguments.jobs) as pool:
            for defect, by in zip(defects.DEFECTS, pool.map(defects.noticed_by, defects.DEFECTS), strict=True):
                print(f"{'noticed ' if by else 'SURVIVED'} rtl/{defect.file}: {defect.says}", flush=True)
                unnoticed += [] if by else [defect.says]
    result = summary(found, arguments.seed, time.monotonic() - began)
    result["defects"] = {"planted": 0 if arguments.only else len(defects.DEFECTS), "unnoticed": unnoticed}
    write_json(FOLDER / ("some.json" if arguments.only else "result.json"), result)
    for survivor in result["survivors"]:
        print(f"left: {survivor['subject']}: {survivor['mutation']}: {survivor['reason'] or 'no reason: a hole'}")
    print(
        f"{result['killed']} of {result['mutants']} mutants noticed, {result['equivalent']} proved equivalent, "
        f"{len(result['survivors'])} left: {100 * share(result):.2f} % of those that can matter, {result['seconds']} s"
    )
    holes = [survivor for survivor in result["survivors"] if not survivor["reason"]]
    return 1 if share(result) < ENOUGH or holes or unnoticed else 0


if __name__ == "__main__":
    sys.exit(main())
