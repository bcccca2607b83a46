# SPDX-License-Identifier: BSD-3-Clause
"""`make rough`: every situation on the golden board, written to build/studies/rough.json; status 1 where one is missed.

make rough                       all of them, with the RTL of both tops beside each
make rough ARGS='--only Hall'    those whose name or drive contains this text; --skip healthy: those that do not
make rough ARGS='--golden'       without the RTL, some minutes
"""

from __future__ import annotations

import argparse
import sys

from fluxproof.checkout import BUILD, ROOT
from fluxproof.files import write_json
from studies.rough.board import RoughBoard
from studies.rough.rtl import Beside
from studies.rough.situations import PASSES, TABLE, drive_of

OUT = BUILD / "studies" / "rough.json"


def rows(only: str, skip: str, rtl: bool):
    """A row for each situation, drive and speed."""
    for situation in TABLE:
        for name in situation.drives:
            if only not in f"{name}: {situation.name}" or (skip and skip in f"{name}: {situation.name}"):
                continue
            for part in situation.speeds:
                RoughBoard.watched = [] if rtl else None
                seen, good = situation.play(drive_of(name, PASSES.get(situation.name, 1)), part)
                told = f"{situation.name}, {part:.0%} of the rated speed"
                row = {"situation": told, "drive": name, "seen": seen, "wanted": situation.wanted}
                yield row | {"pass": bool(good)} | beside(RoughBoard.watched)


def beside(watched: list[Beside] | None) -> dict[str, object]:
    """What the RTL of both tops did: clocks compared, the first difference."""
    if watched is None:
        return {}
    return {
        "rtl_clocks": sum(rtl.clocks for rtl in watched),
        "rtl_difference": next((rtl.first for rtl in watched if rtl.first), None),
    }


def main() -> int:
    parser = argparse.ArgumentParser(prog="rough", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="", help="only situations whose name or drive contains this text")
    parser.add_argument("--skip", default="", help="not those whose name or drive contains this text")
    parser.add_argument("--golden", action="store_true", help="without the RTL beside each")
    arguments, found = parser.parse_args(), []
    whole = not arguments.only and not arguments.skip
    for row in rows(arguments.only, arguments.skip, not arguments.golden):
        found.append(row)
        print(f"{'pass' if row['pass'] else 'MISSED':7}{row['drive']}: {row['situation']}: {row['seen']}", flush=True)
        if row.get("rtl_difference"):
            print(f"RTL    {row['rtl_difference']}", flush=True)
        if whole:
            write_json(OUT, found)  # row by row: a whole run takes an hour, and what it has seen so far is worth having
    good = sum(row["pass"] for row in found)
    if not arguments.golden:
        different = sum(row["rtl_difference"] is not None for row in found)
        clocks = sum(row["rtl_clocks"] for row in found)
        print(f"RTL of both tops: {clocks} clocks each, {different} situations with a difference")
        good = min(good, len(found) - different)
    print(f"{good} of {len(found)} situations" + (f" in {OUT.relative_to(ROOT)}" if whole else ""))
    return 0 if found and good == len(found) else 1


if __name__ == "__main__":
    sys.exit(main())
