# SPDX-License-Identifier: BSD-3-Clause
"""``python -m studies.mishaps``: each mishap on three drives, diagnosed and judged; writes build/mishaps/result.json.

Answers are kept as they come, so that a run that was stopped goes on from there.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from fluxproof.checkout import BUILD
from fluxproof.files import write_json
from studies.mishaps import axes, layout, nameplate, operation, scales, sensors, timing
from studies.mishaps.bases import BASES
from studies.mishaps.log import Mishap
from studies.scored.study import print_counts, scored, write_page
from studies.scored.truth import Case

ROOMS = (operation, timing, axes, scales, sensors, nameplate, layout)
PLAIN = tuple(Mishap(f"none {form}", form, lambda log: log) for form in ("phases", "dq", "slow", "table"))
MISHAPS = (*PLAIN, *(mishap for room in ROOMS for mishap in room.MISHAPS))


def cases(bases, words=()) -> list[Case]:
    """The mishaps whose name contains one of the words, all without words, base by base."""
    chosen = [m for m in MISHAPS if not words or any(word in m.name for word in words)]
    return [mishap.case(base) for base in bases for mishap in chosen]


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(prog="python -m studies.mishaps", description=__doc__.splitlines()[0])
    parser.add_argument("--only", action="append", default=[], metavar="WORD", help="mishaps whose name contains it")
    parser.add_argument("--base", action="append", choices=list(BASES), help="one of the drives; default: all")
    parser.add_argument("--jobs", type=int, default=2, help="diagnoses at once (default: 2)")
    parser.add_argument("--again", action="store_true", help="judge the kept answers again, diagnose nothing")
    parser.add_argument("--out", type=Path, default=BUILD / "mishaps")
    args = parser.parse_args(arguments)
    chosen = cases(args.base or list(BASES), args.only)
    if not chosen:
        parser.error(f"no mishap contains {args.only[0]!r}")
    result = {"schema": 1, **scored(chosen, args.out, args.jobs, whole=False, again=args.again)}
    print_counts(result)
    write_page(result, args.out / "report.html", "Everyday mishaps on three drives")
    print(write_json(args.out / "result.json", result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
