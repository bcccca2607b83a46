# SPDX-License-Identifier: BSD-3-Clause
"""`make mutate`: draws mutants of every block and of the wiring of core and board; their benches must notice them.

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
from datetime import date

from fluxproof.cosim.verilog import NoUsableGhdl, find_ghdl
from fluxproof.files import write_json
from scripts.mutate import defects
from scripts.mutate.axi import TOP as AXI
from scripts.mutate.board import RUNS
from scripts.mutate.board import TOP as BOARD
from scripts.mutate.equivalent import DIFFERENT, EQUIVALENT, UNKNOWN
from scripts.mutate.judge import KILLED, Verdicts, judge, processor_s
from scripts.mutate.subject import FOLDER, Axi, Board, Core, Subject, subjects
from scripts.mutate.table import reason

ENOUGH = 0.995  # of those not proved equivalent
# Of the tops' wiring nothing is proved equivalent: it has a share of its own, which may only rise.
ENOUGH_OF_BOARD = 0.97
TOPS = (BOARD, AXI)
COUNTED = ("mutants", "killed", "equivalent", "survivors", "without_reason")


def seed_of(day: date) -> int:
    """20261128 for that day: every day draws others, so that no bench is made for one draw."""
    return 10000 * day.year + 100 * day.month + day.day


def block_of(verdicts: Verdicts) -> str:
    """The block's name, without the number of its configuration."""
    return verdicts.name.rpartition("-")[0]


def summary(found: Sequence[Verdicts], seed: int, seconds: float) -> dict:
    """The content of result.json; ``seconds``: by the clock on the wall; the processor's are those of all that ran."""
    per_block: dict[str, dict[str, int]] = {}
    survivors = []
    for verdicts in sorted(found, key=lambda v: v.name):
        block = block_of(verdicts)
        row = per_block.setdefault(block, dict.fromkeys(COUNTED, 0))
        row["mutants"] += len(verdicts.outcomes)
        row["killed"] += verdicts.count(KILLED)
        row["equivalent"] += verdicts.count(EQUIVALENT)
        left = [
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
        row["survivors"] += len(left)
        row["without_reason"] += sum(not survivor["reason"] for survivor in left)
        survivors += left
    totals = {name: sum(row[name] for row in per_block.values()) for name in ("mutants", "killed", "equivalent")}
    totals |= {"seed": seed, "seconds": round(seconds, 1), "processor_seconds": round(processor_s(), 1)}
    return totals | {"survivors": survivors, "per_block": per_block}


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
    only_says = "these alone; fluxproof is the core's wiring, fluxproof_board and fluxproof_axi the tops'"
    parser.add_argument("--only", default="", metavar="BLOCKS", help=only_says)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="subjects in parallel")
    parser.add_argument("--seed", type=int, default=seed_of(date.today()), help="of the draw; default the date")
    arguments = parser.parse_args()
    print(f"seed {arguments.seed}", flush=True)
    only = set(filter(None, arguments.only.split(",")))
    everything: list[Subject | Core | Board] = [Core(), *(Board(k) for k in range(len(RUNS))), Axi(), *subjects()]
    chosen = [s for s in everything if not only or s.of in only]
    if wrong := only - {s.of for s in chosen}:
        parser.error(f"--only: no block {', '.join(sorted(wrong))}")
    try:
        find_ghdl()
    except NoUsableGhdl as reason_why:
        parser.exit(1, f"mutate: {reason_why}\n")
    began, found, failed = time.monotonic(), [], {}
    with ProcessPoolExecutor(arguments.jobs) as pool:
        running = {pool.submit(judge, subject, arguments.seed): subject.name for subject in chosen}
        for done, future in enumerate(as_completed(running), 1):
            try:
                found.append(future.result())
                line = line_of(found[-1])
            except Exception as why:  # the others are judged all the same; the run fails
                failed[running[future]] = f"{type(why).__name__}: {str(why)[-1000:]}"
                line = f"{running[future]}: FAILED, {failed[running[future]]}"
            print(f"{done:3d}/{len(running)} {line}", flush=True)
    unnoticed = []
    if not arguments.only:
        with ThreadPoolExecutor(arguments.jobs) as pool:
            asked = [pool.submit(defects.noticed_by, defect) for defect in defects.DEFECTS]
            for defect, future in zip(defects.DEFECTS, asked, strict=True):
                try:
                    said = "noticed " if future.result() else "SURVIVED"
                except (RuntimeError, ValueError, OSError) as why:
                    said, failed[defect.says] = "FAILED  ", str(why)[-1000:]
                print(f"{said} rtl/{defect.file}: {defect.says}", flush=True)
                unnoticed += [defect.says] * (said == "SURVIVED")
    seconds = time.monotonic() - began
    wiring = summary([v for v in found if block_of(v) in TOPS], arguments.seed, seconds)
    result = summary([v for v in found if block_of(v) not in TOPS], arguments.seed, seconds) | {"board": wiring}
    result["failed"] = failed
    result["defects"] = {"planted": 0 if arguments.only else len(defects.DEFECTS), "unnoticed": unnoticed}
    write_json(FOLDER / ("some.json" if arguments.only else "result.json"), result)
    for survivor in result["survivors"]:
        print(f"left: {survivor['subject']}: {survivor['mutation']}: {survivor['reason'] or 'no reason: a hole'}")
    print(
        f"{result['killed']} of {result['mutants']} mutants noticed, {result['equivalent']} proved equivalent, "
        f"{len(result['survivors'])} left: {100 * share(result):.2f} % of those that can matter; "
        f"{result['seconds']} s, {result['processor_seconds']} s of processor time"
    )
    if wiring["mutants"]:
        print(
            f"wiring of the tops: {wiring['killed']} of {wiring['mutants']} noticed, {100 * share(wiring):.1f} %; at "
            f"least {100 * ENOUGH_OF_BOARD:.0f} %, what is left is in the result"
        )
    for name, why in failed.items():
        print(f"not judged: {name}: {why}")
    holes = [survivor for survivor in result["survivors"] if not survivor["reason"]]
    few = result["mutants"] and share(result) < ENOUGH or wiring["mutants"] and share(wiring) < ENOUGH_OF_BOARD
    return 1 if few or holes or unnoticed or failed else 0


if __name__ == "__main__":
    sys.exit(main())
