# SPDX-License-Identifier: BSD-3-Clause
"""Halve and double every constant of the inference: `python -m studies.sensitivity --seed 7`.

Writes build/sensitivity/result.json: {"constants", "cases", "worst", "worst_share", "each": {NAME: {...}}}.  An answer
counts as changed if its kind, a name or an ambiguity is another one; "verdicts" counts kinds and names alone.  Cases
are judged in an order that mixes the generators, and an interrupted run goes on where it was: answers are kept for as
long as the code of the diagnosis is the same.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
import sys
import time
from collections import Counter
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one core for each case

from fluxproof.checkout import BUILD, ROOT
from fluxproof.files import write_json  # noqa: E402
from studies.blind.generate import GENERATORS, generate  # noqa: E402
from studies.blind.thinned import thin  # noqa: E402
from studies.sensitivity.run import FACTORS, answers_of, differences, names, shares  # noqa: E402

LIMIT = 0.02  # of the answers: a constant that changes more is a tuned one
MIX = "own:110,motulator:25,gem:25,own@6:60"
OUT = BUILD / "sensitivity"


def cases_of(seed: int, mix: dict[str, int], jobs: int) -> dict[str, Path]:
    """{"own/case_0001": folder}, the generators mixed; cases that do not exist are simulated.

    mix: cases of each generator, of "own@6" with every sixth row of them, which makes operating points.
    """
    placed = []
    for generator, count in mix.items():
        name, _, every = generator.partition("@")
        folder = OUT / f"seed{seed}" / name
        if not (folder / "sealed.sha256").exists():
            generate(seed, folder, count, jobs=jobs, generator=name)
        cases = sorted(folder.glob("case_*"))[:count]
        if every:
            cases = [thin(case, folder.with_name(generator) / case.name, int(every)) for case in cases]
        placed += [((n + 0.5) / len(cases), f"{generator}/{case.name}", case) for n, case in enumerate(cases)]
    return {name: case for _, name, case in sorted(placed)}


def code() -> str:
    """Digest of the diagnosis and of this study, for which answers are kept."""
    files = [*(ROOT / "fluxproof" / "diagnosis").rglob("*.py"), *(ROOT / "studies" / "sensitivity").rglob("*.py")]
    return hashlib.sha256(b"".join(f.read_bytes() for f in sorted(files))).hexdigest()[:16]


def kept(path: Path, wanted: set[str], digest: str) -> dict | None:
    """The answers of an earlier run of the same code to all that is wanted; None if there are none."""
    if not path.exists():
        return None
    found = json.loads(path.read_text())
    answers = found["answers"]
    return answers if found["code"] == digest and (not answers or wanted <= set(answers)) else None


def measure(seed: int, mix: dict[str, int], jobs: int, chosen) -> dict:
    """The contents of result.json, which is written after every case."""
    cases, digest = cases_of(seed, mix, jobs), code()
    place = {name: OUT / f"seed{seed}" / f"answers_{name.replace('/', '_')}.json" for name in cases}
    wanted = {f"{n} x{f:g}" for n in chosen for f in FACTORS}
    known = {name: out for name in cases if (out := kept(place[name], wanted, digest)) is not None}
    todo, began = [(name, case, list(chosen)) for name, case in cases.items() if name not in known], time.perf_counter()
    result = summary(seed, known, chosen)
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        for n, (name, out) in enumerate(pool.imap_unordered(answers_of, todo), 1):
            write_json(place[name], {"code": digest, "answers": out})
            known[name] = out
            result = summary(seed, known, chosen)
            write_json(OUT / "result.json", result)
            left = (time.perf_counter() - began) / n * (len(todo) - n)
            print(f"\r{len(known)}/{len(cases)} cases, {left / 60:.0f} min left ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return result


def summary(seed: int, known: dict, chosen) -> dict:
    """The figures of the cases that are known so far; those without a posterior do not count."""
    judged = {case: out for case, out in known.items() if out}
    each = shares(judged, chosen)
    worst = max(each, key=lambda n: each[n]["share"])
    return {
        "constants": len(each),
        "cases": len(judged),
        "generators": dict(Counter(case.split("/")[0] for case in judged)),
        "seed": seed,
        "worst": worst,
        "worst_share": each[worst]["share"],
        "above_limit": sorted(n for n in each if each[n]["share"] > LIMIT),
        "each": each,
    }


def check(cases, chosen) -> int:
    """Print every variation whose answer depends on what was reused; returns their number."""
    count = 0
    for name, folder in cases:
        wrong = differences(folder, chosen)
        print(f"{name}: {', '.join(wrong) or 'reused and whole runs give the same answers'}", flush=True)
        count += len(wrong)
    return count


def main(arguments=None) -> int:
    """The command line; returns 0 whatever the figures, or the number of differences found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--mix", default=MIX, help="GENERATOR:CASES or GENERATOR@EVERY:CASES, separated by commas")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--constants", default="", help="names, separated by commas (default: all)")
    parser.add_argument("--check", type=int, default=0, help="compare reused with whole runs on so many cases instead")
    options = parser.parse_args(arguments)
    chosen = [n for n in options.constants.split(",") if n] or names()
    unknown = sorted(set(chosen) - set(names()))
    if unknown:
        parser.error(f"--constants: {', '.join(unknown)} is not among {', '.join(names())}")
    mix = {generator: int(count) for generator, count in (part.split(":") for part in options.mix.split(","))}
    if not {generator.partition("@")[0] for generator in mix} <= set(GENERATORS):
        parser.error(f"--mix: generators are {', '.join(GENERATORS)}")
    if options.check:
        return check(list(cases_of(options.seed, mix, options.jobs).items())[: options.check], chosen)
    result = measure(options.seed, mix, options.jobs, chosen)
    write_json(OUT / "result.json", result)
    for name, entry in sorted(result["each"].items(), key=lambda e: -e[1]["share"]):
        print(f"{name:18s} {entry['value']:<8g} halved {entry['half']:6.1%}  doubled {entry['double']:6.1%}"
              f"  verdicts {entry['verdicts']:6.1%}")  # fmt: skip
    print(f"{result['cases']} cases, worst {result['worst']} {result['worst_share']:.1%} (limit {LIMIT:.0%})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
