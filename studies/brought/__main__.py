# SPDX-License-Identifier: BSD-3-Clause
"""Files as people bring them, each with a declared truth: ``python -m studies.brought [--only WORD] [--again]``.

Prints the judgement of every case and the counts of each kind: right, covering, honest limit, withheld, wrong.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from fluxproof.checkout import BUILD
from fluxproof.files import write_json
from studies.brought import angles, dyno, emf, late, legs, limits, moving
from studies.scored.study import print_counts, scored, write_page
from studies.scored.truth import JUDGES

ROOMS = (moving, late, limits, angles, legs, dyno, emf)


def by_kind(result: dict) -> list[str]:
    """A line of counts for each kind, the word before the first dot of a case's name."""
    kinds: dict[str, list[str]] = {}
    for entry in result["cases"]:
        kinds.setdefault(entry["name"].partition(".")[0], []).append(entry["judge"])
    return [
        f"{kind:12} {len(words):3}: " + ", ".join(f"{words.count(j)} {j}" for j in JUDGES)
        for kind, words in kinds.items()
    ]


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(prog="python -m studies.brought", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", action="append", default=[], metavar="WORD", help="cases whose name contains it")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every Nth case")
    parser.add_argument("--jobs", type=int, default=1, help="diagnoses at once (default: 1)")
    parser.add_argument("--again", action="store_true", help="judge the kept answers again, diagnose nothing")
    parser.add_argument("--out", type=Path, default=BUILD / "brought")
    args = parser.parse_args(arguments)
    chosen = [c for room in ROOMS for c in room.cases() if not args.only or any(w in c.name for w in args.only)]
    if not chosen:
        parser.error(f"no case contains {args.only[0]!r}")
    result = {"schema": 1, **scored(chosen[:: args.every], args.out, args.jobs, whole=False, again=args.again)}
    print("\n".join(by_kind(result)))
    print_counts(result)
    write_page(result, args.out / "report.html", "What people bring")
    print(write_json(args.out / "result.json", result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
