# SPDX-License-Identifier: BSD-3-Clause
"""`make hil`: figures of the motor in the FPGA, a list of {figure, ours, target, unit, pass} in build/studies/hil.json.

    make hil                              all, some minutes
    make hil ARGS='--only plant'          those of a part: plant, pace, equal, loop, residual, truth,
                                          commission, page
    make hil ARGS='--seconds 1'           a shorter ride

Exit status 1 where a figure misses its target.
"""

from __future__ import annotations

import argparse
import json
import sys

from fluxproof.checkout import BUILD, ROOT
from fluxproof.files import write_json
from studies.hil import closed_loop, commissioning, equal, pace, page, plant, residual, truth

OUT = BUILD / "studies" / "hil.json"
PARTS = {
    "plant": plant.figures, "pace": pace.figures, "equal": equal.figures, "loop": closed_loop.figures,
    "residual": residual.figures, "truth": truth.figures, "commission": commissioning.figures,
    "page": page.figures,
}  # fmt: skip


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("--only", choices=PARTS, nargs="+", default=list(PARTS), help="these parts")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of the ride beside the plant")
    parser.add_argument("--samples", type=int, default=1_000_000, help="of healthy drives beside their residual")
    parser.add_argument("--periods", type=int, default=20_000, help="of the closed loop whose values are compared")
    options = parser.parse_args(arguments)
    rows = [row for part in options.only for row in PARTS[part](options)]
    before = json.loads(OUT.read_text()) if OUT.exists() else []
    names = {row["figure"] for row in rows}
    write_json(OUT, [row for row in before if row["figure"] not in names] + rows)
    for row in rows:
        print(f"{'pass' if row['pass'] else 'MISSED':7}{row['figure']}: {row['ours']} {row['unit']} ({row['target']})")
    print(f"{len(rows)} figures in {OUT.relative_to(ROOT)}")
    return 0 if all(row["pass"] for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
