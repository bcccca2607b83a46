# SPDX-License-Identifier: BSD-3-Clause
"""``make real``: diagnose and judge every available real recording; writes build/real/result.json and report.html.

The cases of truth.py are diagnosed as a user does and judged (studies/scored), each with a folder of its own; three
recordings are studied in depth besides.  The recordings are not part of the project: FLUXPROOF_RECORDINGS names their
folder, ../shared/recordings without it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from fluxproof.checkout import BUILD, recordings
from fluxproof.diagnosis.command import Progress
from fluxproof.files import write_json
from fluxproof.fleet.engine import in_parallel
from fluxproof.fleet.work import version
from studies.real import brusa, emrax, laas
from studies.real.truth import CASES
from studies.real.variants import varied
from studies.scored.study import print_counts, scored, write_page

PARTS = {"brusa_flux_map": brusa, "emrax228": emrax, "laas_mn4004": laas}


def part(job) -> dict:
    """The entry of one recording, written beside its outputs; job: (name, folder of recordings, out, quiet)."""
    name, folder, out, quiet = job
    module, started = PARTS[name], time.perf_counter()
    with Progress(quiet=quiet) as progress:
        entry = module.run(folder, out, progress)
    entry["seconds"]["all"] = time.perf_counter() - started
    write_json(entry_file(name, folder, out), entry)
    return entry


def entry_file(name: str, folder: Path, out: Path) -> Path:
    """Where the entry of a recording is kept, for as long as recording and code are the same."""
    file, code = folder / PARTS[name].FILE, hashlib.sha256(version().encode())
    code.update(file.read_bytes())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        code.update(path.read_bytes())
    return out / "kept" / f"{name}_{code.hexdigest()[:16]}.json"


def kept(chosen) -> Iterator[tuple[str, dict]]:
    """(name, entry) of what is missing, and of what an earlier run, which was perhaps stopped, has finished."""
    for name, folder, out, _ in chosen:
        file = PARTS[name].FILE
        if not (folder / file).exists():
            yield name, {"skipped": f"{file} is missing; FLUXPROOF_RECORDINGS names its folder"}
        elif (path := entry_file(name, folder, out)).exists():
            yield name, json.loads(path.read_text())


def studied(names, args) -> dict:
    """{recording: entry} of the recordings that are studied in depth."""
    chosen = [(name, recordings(), args.out, args.quiet) for name in names]
    found = dict(kept(chosen))
    left = [c for c in chosen if c[0] not in found]
    for (name, *_), entry in in_parallel(part, left, args.jobs, "recordings"):
        found[name] = entry
    for name in names:
        if "skipped" not in found[name]:
            print(f"{name}: {found[name]['verdict']}. {found[name]['sentence']}")
    return {name: found[name] for name in names}


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(prog="python -m studies.real", description=__doc__.splitlines()[0])
    every = [*PARTS, *(case.name for case in CASES)]
    parser.add_argument("names", nargs="*", metavar="NAME", help="as --only; default: all")
    parser.add_argument(
        "--only", action="append", default=[], metavar="NAME", help=f"of {', '.join(PARTS)}, or a case of truth.py"
    )
    parser.add_argument("--jobs", type=int, default=2, help="diagnoses at once (default: 2)")
    parser.add_argument(
        "--varied", metavar="REGEX", help="only the variants of the recordings whose name matches (variants.py; .: all)"
    )
    parser.add_argument("--again", action="store_true", help="judge the kept answers again, diagnose nothing")
    parser.add_argument("--out", type=Path, default=BUILD / "real")
    parser.add_argument("--quiet", action="store_true")
    args = parser.parse_args(arguments)
    chosen = [*args.names, *args.only]
    unknown = sorted(set(chosen) - set(every))
    if unknown:
        parser.error(f"{unknown[0]} is not one of {', '.join(every)}")
    if args.varied:
        result: dict = {"schema": 1}
        cases = [c for c in varied() if re.search(args.varied, c.name)]
    else:
        result = {"schema": 1, "recordings": studied([n for n in PARTS if not chosen or n in chosen], args)}
        cases = [c for c in CASES if not chosen or c.name in chosen]
    result |= scored(cases, args.out / "cases", args.jobs, whole=True, again=args.again)
    print_counts(result)
    write_page(result, args.out / "report.html", "Recordings of real drives and benches")
    print(write_json(args.out / "result.json", result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
