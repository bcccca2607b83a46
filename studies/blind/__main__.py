# SPDX-License-Identifier: BSD-3-Clause
"""`python -m studies.blind --seed 1`: generate, diagnose, score, for each generator by itself.

build/blind/GENERATOR/ holds a generator's cases, result.json and report.html; build/blind/result.json the figures of
the project's own generator and, under "generators", those of all.
"""

from __future__ import annotations

import argparse
import json
import sys

from fluxproof.checkout import BUILD
from fluxproof.files import write_json, write_text
from studies.blind.generate import GENERATORS, generate
from studies.blind.page import page
from studies.blind.score import print_figures, score

FOLDER = BUILD / "blind"
KEPT = ("generator", "seed", "cases_total", "sha256", "figures", "reliability", "by_stratum", "times")


def together(results: dict[str, dict], before: dict) -> dict:
    """One result of all generators; results: by generator; before: an earlier result, whose other generators stay."""
    own = results.get("own") or {k: v for k, v in before.items() if k != "generators"}
    generators = dict(before.get("generators", {}))
    generators |= {name: {k: result[k] for k in KEPT} for name, result in results.items()}
    return {**own, "generators": generators}


def main(arguments=None) -> int:
    """The command line; returns 0 whatever the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generator", choices=(*GENERATORS, "all"), default="all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, help="cases of each generator (own 300, others 60)")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--keep", action="store_true", help="use the existing cases")
    options = parser.parse_args(arguments)
    results = {}
    for name in GENERATORS if options.generator == "all" else [options.generator]:
        folder = FOLDER / name / f"seed{options.seed}"
        count = options.count or (300 if name == "own" else 60)
        if not options.keep or not (folder / "sealed.sha256").exists():
            digest = generate(options.seed, folder, count, jobs=options.jobs, generator=name)
            print(f"{name}: sealed, SHA-256 {digest}")
        results[name] = score(folder, options.jobs)
        print(f"-- {name}, seed {options.seed}")
        print_figures(results[name])
    path = FOLDER / "result.json"
    result = together(results, json.loads(path.read_text()) if path.exists() else {})
    write_json(path, result)
    if "figures" in result:  # the page of all is built around the own generator's; without it, each has its own page
        write_text(FOLDER / "report.html", page(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
