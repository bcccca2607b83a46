# SPDX-License-Identifier: BSD-3-Clause
"""The closed loop of core and motor in the RTL for as many periods as there is time, in runs from reset.

python -m studies.hil.in_runs [PERIODS]

A finished run is a line of build/studies/hil_runs.jsonl, with its own speeds; a second call goes on behind the last
one, and begins anew where the RTL is another.
"""

from __future__ import annotations

import json
import sys

from fluxproof.checkout import BUILD
from fluxproof.cosim.flat import FLAT
from fluxproof.cosim.verilog import conversion_key
from studies.hil.closed_loop import long_run

OUT = BUILD / "studies" / "hil_runs.jsonl"
RUN = 10_000  # periods
FIRST_SEED = 1000


def finished(key: str) -> list[dict]:
    """The runs of this RTL so far."""
    lines = OUT.read_text().splitlines() if OUT.exists() else []
    return [row for row in map(json.loads, lines) if row["rtl"] == key]


def main(periods: int) -> int:
    """Exit status 1 where a value differs."""
    key = conversion_key({}, top=f"core_and_motor{FLAT}")
    rows = finished(key)
    OUT.parent.mkdir(parents=True, exist_ok=True)
    while sum(row["periods"] for row in rows) < periods:
        seed = FIRST_SEED + len(rows)
        found = long_run(RUN, seed)
        rows.append(
            {"rtl": key, "seed": seed, "periods": found.samples, "wrong": found.wrong, "seconds": found.seconds}
        )
        with OUT.open("a") as file:
            file.write(json.dumps(rows[-1]) + "\n")
        print(f"{sum(r['periods'] for r in rows)} periods, {sum(r['wrong'] for r in rows)} values differ", flush=True)
    return 1 if any(row["wrong"] for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000))
