# SPDX-License-Identifier: BSD-3-Clause
"""Tune the methods on a separate seed: `python -m studies.compare.tune --seed 951`.

Every setting of a method's grid is tested on every case; the one that names the most single effects and pairs exactly
right is chosen, and fewer confidently wrong cases decide ties.  The table thus shows each method at its best.
Writes tuned.json next to this file, which the comparison reads; its seed must not be used for a comparison.
"""

from __future__ import annotations

import argparse
import sys
from itertools import product

from fluxproof.files import write_json
from studies.blind.figures import confidently_wrong, identifiable, named_right
from studies.compare.cases import STRATA, cases_of, folder_of
from studies.compare.data import load
from studies.compare.methods import METHODS, TUNED, missing, tuned
from studies.compare.run import answer_of_names


def outcomes(method, folder, truths) -> dict[tuple, list]:
    """{(fit setting, name setting) by number: [names of each case]}."""
    table = {}
    for n, truth in enumerate(truths):
        data = load(folder / truth["case"])
        for a, settings in enumerate(method.FIT_GRID):
            fitted = method.fit(data, **settings)
            for b, how in enumerate(method.NAME_GRID):
                table.setdefault((a, b), []).append(method.names(fitted, **how))
        print(f"\r{n + 1} of {len(truths)} cases ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return table


def score(names, truths) -> dict:
    """The result of one setting on the cases."""
    pairs = [(t, answer_of_names(found)) for t, found in zip(truths, names, strict=True)]
    fair = {s: [(t, a) for t, a in pairs if t["stratum"] == s and identifiable(t)] for s in STRATA}
    right = {s: sum(named_right(t, a) for t, a in fair[s]) for s in ("single", "pair")}
    return {
        "single_right": right["single"],
        "single": len(fair["single"]),
        "pair_right": right["pair"],
        "pair": len(fair["pair"]),
        "confidently_wrong": sum(confidently_wrong(t, a) for t, a in pairs),
        "cases": len(pairs),
    }


def best(method, table, truths) -> dict:
    """The best settings with their score."""
    scored = {key: score(names, truths) for key, names in table.items()}

    def rank(key):
        s = scored[key]
        return s["single_right"] + s["pair_right"], -s["confidently_wrong"]

    a, b = max(scored, key=rank)
    return {"fit": method.FIT_GRID[a], "names": method.NAME_GRID[b], "reached": scored[a, b]}


def main(arguments=None) -> int:
    """The command line; returns 2 if a package is missing."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=951)
    parser.add_argument("--count", type=int, default=175)
    parser.add_argument("--method", choices=METHODS, action="append", help="tune these only")
    options = parser.parse_args(arguments)
    if missing():
        print(f"not installed: {', '.join(missing())}; run make setup", file=sys.stderr)
        return 2
    folder = folder_of(options.seed, options.count)
    truths = cases_of(folder)
    kept = tuned()["methods"] if options.method and TUNED.exists() and tuned()["seed"] == options.seed else {}
    for name in options.method or METHODS:
        method = METHODS[name]
        print(f"{name}: {len(list(product(method.FIT_GRID, method.NAME_GRID)))} settings", file=sys.stderr)
        kept[name] = best(method, outcomes(method, folder, truths), truths)
        print(name, kept[name])
        write_json(TUNED, {"seed": options.seed, "cases": len(truths), "methods": kept})
    return 0


if __name__ == "__main__":
    sys.exit(main())
