# SPDX-License-Identifier: BSD-3-Clause
"""`python -m studies.fleet`: measure the figures of `fluxproof fleet` on simulated fleets; build/studies/fleet.json.

A run that was stopped goes on where it was: recordings, rows and figures that are there are not made again.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one core for each worker

from fluxproof.checkout import BUILD  # noqa: E402
from fluxproof.files import write_json  # noqa: E402
from studies.blind import unknown  # noqa: E402
from studies.fleet.figures import FIGURES, Study  # noqa: E402
from studies.fleet.picture import draw  # noqa: E402

FOLDER = BUILD / "studies" / "fleet"
RESULT = BUILD / "studies" / "fleet.json"
ORDER = ("thousand", "hidden", "group", "speedup", "drift", "killed", "cost")  # of measurement: the quick ones first


def main(arguments=None) -> int:
    """The command line; returns 0 whatever the figures."""
    parser = argparse.ArgumentParser(prog="python -m studies.fleet", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="recordings of the fleet off the line")
    parser.add_argument("--rows", type=int, default=10000, help="rows of a recording")
    parser.add_argument("--seed", type=int, default=26, help="25 is the fleet on which the rules were made")
    parser.add_argument("--kind", choices=sorted(unknown.KINDS), default="inter_turn_short", help="unknown effect")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", choices=sorted(FIGURES), action="append", help="this figure alone; may be repeated")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="draw the README's picture instead")
    options = parser.parse_args(arguments)
    if options.count < 20 or options.rows < 4000:
        parser.error("--count must be at least 20 and --rows at least 4000: 20 operating points of 200 rows")
    study = Study(options.count, options.rows, options.seed, options.kind, options.workers, FOLDER)
    if options.picture:
        print(draw(study, options.picture))
        return 0
    measured = _measured(study)
    for name in [n for n in ORDER if n in (options.only or ORDER)]:
        began = time.perf_counter()
        for entry in FIGURES[name](study):
            measured[name] = {**entry, "seconds": round(time.perf_counter() - began, 1)}
            verdict = "met" if entry["pass"] else "MISSED"
            print(f"{entry['figure']}: {entry['ours']}   target {entry['target']}: {verdict}", flush=True)
        write_json(_kept(study), measured)
        write_json(RESULT, [measured[n] for n in FIGURES if n in measured])
    print(RESULT)
    return 0


def _kept(study: Study):
    """Figures of a study by name: another count or seed is another study."""
    return FOLDER / f"figures_{study.seed}_{study.count}_{study.rows}_{study.kind}.json"


def _measured(study: Study) -> dict:
    path = _kept(study)
    return json.loads(path.read_text()) if path.exists() else {}


if __name__ == "__main__":
    sys.exit(main())
