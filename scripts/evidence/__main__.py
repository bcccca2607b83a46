# SPDX-License-Identifier: BSD-3-Clause
"""`python -m scripts.evidence`: renew docs/evidence.md and docs/benchmark.md from the results in build/.

Run a command (make demo, make prove, make blind, ...), then this.  A row whose result is not in build/ keeps the figure
of its last run.  Prints each figure that changed.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path

from fluxproof.checkout import BUILD, ROOT
from fluxproof.files import write_text
from scripts.evidence.rows import ROWS
from scripts.evidence.table import benchmark, with_figure

EVIDENCE, BENCHMARK = ROOT / "docs" / "evidence.md", ROOT / "docs" / "benchmark.md"
MARKS = "<!-- newest runs -->", "<!-- end of the newest runs -->"


def renewed(text: str, build: Path) -> str:
    """docs/evidence.md with the figures of the results below ``build``."""
    for row in ROWS:
        path = build / row.result
        figure = row.figure(json.loads(path.read_text())) if path.exists() else None
        if figure is None:
            continue
        after = with_figure(text, row.claim, figure)
        if after != text:
            print(f"{row.claim}: {figure}")
        text = after
    return text


def with_newest(text: str, build: Path) -> str:
    """docs/benchmark.md with the table of the newest runs of `make blind`."""
    path = build / "blind" / "result.json"
    generators = json.loads(path.read_text()).get("generators") if path.exists() else None
    if not generators:
        return text
    pattern = re.compile(re.escape(MARKS[0]) + ".*?" + re.escape(MARKS[1]), re.DOTALL)
    if not pattern.search(text):
        raise ValueError(f"the lines {MARKS[0]} and {MARKS[1]} are missing")
    return pattern.sub(lambda _: f"{MARKS[0]}\n\n{benchmark(generators)}\n\n{MARKS[1]}", text)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m scripts.evidence", description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=BUILD, help="folder with the results")
    options = parser.parse_args(arguments)
    for path, renew in ((EVIDENCE, renewed), (BENCHMARK, with_newest)):
        try:
            write_text(path, renew(path.read_text(), options.build))
        except ValueError as error:
            print(f"{path.relative_to(ROOT)}: {error}", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
