# SPDX-License-Identifier: BSD-3-Clause
"""`make rough`: every situation on the golden board, written to build/studies/rough.json; status 1 where one is missed.

make rough                       all of them, some minutes
make rough ARGS='--only Hall'    those whose name or drive contains this text
"""

from __future__ import annotations

import argparse
import sys

from fluxproof.checkout import BUILD, ROOT
from fluxproof.files import write_json
from studies.rough.situations import PASSES, TABLE, drive_of

OUT = BUILD / "studies" / "rough.json"


def rows(only: str):
    """A row for each situation, drive and speed."""
    for situation in TABLE:
        for name in situation.drives:
            if only not in situation.name and only not in name:
                continue
            for part in situation.speeds:
                seen, good = situation.play(drive_of(name, PASSES.get(situation.name, 1)), part)
                told = f"{situation.name}, {part:.0%} of the rated speed"
                yield {"situation": told, "drive": name, "seen": seen, "wanted": situation.wanted, "pass": bool(good)}


def main() -> int:
    parser = argparse.ArgumentParser(prog="rough", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="", help="only situations whose name or drive contains this text")
    arguments, found = parser.parse_args(), []
    for row in rows(arguments.only):
        found.append(row)
        print(f"{'pass' if row['pass'] else 'MISSED':7}{row['drive']}: {row['situation']}: {row['seen']}", flush=True)
    if not arguments.only:
        write_json(OUT, found)
    good = sum(row["pass"] for row in found)
    print(f"{good} of {len(found)} situations" + ("" if arguments.only else f" in {OUT.relative_to(ROOT)}"))
    return 0 if found and good == len(found) else 1


if __name__ == "__main__":
    sys.exit(main())
