"""Halve and double every constant of the inference: `python -m studies.sensitivity --seed 7 --count 170`.

Writes build/sensitivity/result.json: {"constants", "cases", "worst", "worst_share", "each": {NAME: {...}}}.  A verdict
counts as changed if its kind, a name or an ambiguity is another one.  An interrupted run goes on with `--keep`, as long
as the code is the same.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one core for each case

from fluxproof.checkout import BUILD
from fluxproof.files import write_json  # noqa: E402
from studies.blind.generate import generate  # noqa: E402
from studies.sensitivity.run import answers_of, names, shares  # noqa: E402

LIMIT = 0.02  # of the verdicts: a constant that changes more is a tuned one


def measure(seed: int, count: int, jobs: int, chosen, keep=False) -> dict:
    """The contents of result.json."""
    folder = BUILD / "sensitivity" / f"seed{seed}"
    if not (folder / "sealed.sha256").exists():
        generate(seed, folder, count, jobs=jobs)
    cases = sorted(p for p in folder.iterdir() if p.is_dir() and p.name.startswith("case_"))
    if not keep:
        for old in folder.glob("answers_*.json"):
            old.unlink()
    known = {c.name: json.loads(p.read_text()) for c in cases if (p := folder / f"answers_{c.name}.json").exists()}
    wanted = {f"{n} x{f:g}" for n in chosen for f in (0.5, 2.0)}
    known = {c: out for c, out in known.items() if not out or wanted <= set(out)}
    todo, began = [(str(c), list(chosen)) for c in cases if c.name not in known], time.perf_counter()
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        for n, (case, out) in enumerate(pool.imap_unordered(answers_of, todo), 1):
            write_json(folder / f"answers_{case}.json", out)
            known[case] = out
            left = (time.perf_counter() - began) / n * (len(todo) - n)
            print(f"\r{n}/{len(todo)} cases, {left / 60:.0f} min left ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    judged = {case: out for case, out in known.items() if out}
    each = shares(judged, chosen)
    worst = max(each, key=lambda n: each[n]["share"])
    return {
        "constants": len(each),
        "cases": len(judged),
        "seed": seed,
        "worst": worst,
        "worst_share": each[worst]["share"],
        "above_limit": sorted(n for n in each if each[n]["share"] > LIMIT),
        "each": each,
    }


def main(arguments=None) -> int:
    """The command line; returns 0 whatever the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--count", type=int, default=170)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--constants", default="", help="names, separated by commas (default: all)")
    parser.add_argument("--keep", action="store_true", help="go on with an interrupted run of the same code")
    options = parser.parse_args(arguments)
    chosen = [n for n in options.constants.split(",") if n] or names()
    unknown = sorted(set(chosen) - set(names()))
    if unknown:
        parser.error(f"--constants: {', '.join(unknown)} is not among {', '.join(names())}")
    result = measure(options.seed, options.count, options.jobs, chosen, options.keep)
    write_json(BUILD / "sensitivity" / "result.json", result)
    for name, entry in sorted(result["each"].items(), key=lambda e: -e[1]["share"]):
        print(f"{name:18s} {entry['value']:<8g} halved {entry['half']:6.1%}  doubled {entry['double']:6.1%}")
    print(f"{result['cases']} cases, worst {result['worst']} {result['worst_share']:.1%} (limit {LIMIT:.0%})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
