# SPDX-License-Identifier: BSD-3-Clause
"""Compare the diagnosis with alternative methods: `python -m studies.compare --seed 1`.

Writes build/compare/result.json (every figure with its Wilson interval, every case), table.md and table.html.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: times of one core each

from fluxproof.checkout import BUILD
from fluxproof.files import write_json, write_text  # noqa: E402
from studies.blind import figures  # noqa: E402
from studies.blind.seal import SealError  # noqa: E402
from studies.compare.cases import STRATA, cases_of, folder_of  # noqa: E402
from studies.compare.methods import TITLES, missing, tuned  # noqa: E402
from studies.compare.run import answers_of, summary  # noqa: E402
from studies.compare.table import html, markdown  # noqa: E402


def compare(seed: int, count: int, jobs: int) -> dict:
    """Run every method on every case of a seed; returns the contents of result.json."""
    settings = tuned()
    if seed == settings["seed"]:
        raise ValueError(f"seed {seed} was used to tune the methods: compare on another one")
    folder = folder_of(seed, count, jobs)
    truths = cases_of(folder)
    work = [(folder / truth["case"], settings["methods"]) for truth in truths]
    answers, began = [], time.perf_counter()
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        for answer in pool.imap(answers_of, work):
            answers.append(answer)
            spent = time.perf_counter() - began
            print(f"\r{len(answers)} of {len(work)} cases, {spent:.0f} s ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return {
        "schema": 1,
        "seed": seed,
        "folder": folder.name,
        "sha256": (folder / "sealed.sha256").read_text().strip(),
        "tuned_on_seed": settings["seed"],
        "settings": settings["methods"],
        "cases": {s: sum(t["stratum"] == s for t in truths) for s in STRATA},
        "methods": {name: summary([(t, a[name]) for t, a in zip(truths, answers, strict=True)]) for name in TITLES},
        "each": [_line(t, a) for t, a in zip(truths, answers, strict=True)],
    }


def _line(truth, answers):
    return {
        "case": truth["case"],
        "stratum": truth["stratum"],
        "identifiable": figures.identifiable(truth),
        "truth": sorted(figures.true_names(truth)),
        "named": {name: sorted(figures.asserted(a)) for name, a in answers.items()},
        "answers": {
            name: {k: a.get(k) for k in ("verdict", "seconds", "holdout_v", "noise_v", "error") if k in a}
            for name, a in answers.items()
        },
    }


def main(arguments=None) -> int:
    """The command line; returns 0, or 2 if a package or the truth is missing."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=175, help="size of the benchmark to generate if there is none")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(arguments)
    if missing():
        print(f"not installed: {', '.join(missing())}; run make setup", file=sys.stderr)
        return 2
    try:
        result = compare(options.seed, options.count, options.jobs)
    except (SealError, ValueError) as error:
        print(error, file=sys.stderr)
        return 2
    out = BUILD / "compare"
    write_json(out / "result.json", json.loads(json.dumps(result, default=float)))
    write_text(out / "table.html", html(result))
    write_text(out / "table.md", markdown(result))
    print(markdown(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
