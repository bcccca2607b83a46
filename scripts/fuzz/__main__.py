# SPDX-License-Identifier: BSD-3-Clause
"""`make fuzz`: hostile and damaged inputs for everything that reads a file or writes text of another language.

    make fuzz ARGS='--minutes 10 --seed 3 --only readers,drives'
    python -m scripts.fuzz --file build/fuzz/finds/readers-0123456789ab.csv      one case again

Targets take turns until the time is over.  What fails is made as small as possible and written to build/fuzz/finds with
a text beside it.  Exit status: 0 without a find, 1 with one, or if a target had no time.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from scripts.fuzz import finds
from scripts.fuzz.case import Case
from scripts.fuzz.search import Search
from scripts.fuzz.targets import by_name, names
from scripts.fuzz.worker import Worker


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="fuzz", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="how long (default 10)")
    parser.add_argument("--seed", type=int, default=1, help="of the draw (default 1)")
    parser.add_argument("--only", default="", metavar="TARGETS", help=f"of {', '.join(names())}, with commas between")
    parser.add_argument("--file", type=Path, help="judge this file alone, by the target in its name or --only")
    given = parser.parse_args()
    given.targets = list(filter(None, given.only.split(","))) or names()
    if given.file and not given.only:
        given.targets = [given.file.name.partition("-")[0]]
    if wrong := [name for name in given.targets if name not in names()]:
        parser.error(f"no target {', '.join(wrong)}; there are {', '.join(names())}")
    return given


def main() -> int:
    given = arguments()
    if given.file:
        worker = Worker()
        try:
            return again(given.targets[0], given.file, worker)
        finally:
            worker.close()
    worker = Worker()
    searches = [Search(by_name(name), given.seed, worker) for name in given.targets]
    stop = time.monotonic() + 60.0 * given.minutes  # the valid files are made by now
    for search in searches:
        search.stop_at = stop
    progress = Progress(searches)
    try:
        while time.monotonic() < stop:
            for search in searches:
                for found in search.turn(search.target.TURN, progress.show):
                    progress.say(finds.line(found, finds.write(found, given.seed)))
    except KeyboardInterrupt:
        progress.say("stopped")
    finally:
        worker.close()
    for search in searches:
        progress.say(f"{search.name}: {search.cases} cases, {len(search.finds)} finds")
    found = [finds.line(f, finds.write(f, given.seed)) for search in searches for f in search.finds.values()]
    idle = [search.name for search in searches if not search.cases]
    print("\n".join(found or [f"no case of {', '.join(idle)}: more minutes are needed" if idle else "no finds"]))
    return 1 if found or idle else 0


def again(name: str, path: Path, worker: Worker) -> int:
    """Judge one file; the exit status."""
    verdict = worker.verdict(by_name(name), Case(path.suffix, path.read_bytes()))
    print(f"{name}: {verdict.kind}\n{verdict.text}" if verdict.kind else f"{name}: nothing wrong")
    return 1 if verdict.kind else 0


class Progress:
    """A line on stderr: updated on a terminal, now and then elsewhere."""

    def __init__(self, searches):
        self.searches, self.start = searches, time.monotonic()
        self.terminal = sys.stderr.isatty()
        self.next = self.start

    def show(self) -> None:
        now = time.monotonic()
        if now < self.next:
            return
        self.next = now + (0.2 if self.terminal else 30.0)
        cases, found = sum(s.cases for s in self.searches), sum(len(s.finds) for s in self.searches)
        rate = cases / max(now - self.start, 1e-3)
        text = f"{now - self.start:.0f} s, {cases} cases, {rate:.1f} a second, {found} finds"
        print(
            f"\r\x1b[K{text}" if self.terminal else text, end="" if self.terminal else "\n", file=sys.stderr, flush=True
        )

    def say(self, text: str) -> None:
        print(f"\r\x1b[K{text}" if self.terminal else text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
