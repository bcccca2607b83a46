"""``make real``: diagnose every available real recording; writes build/real/result.json and a folder for each.

The recordings are not part of the project: FLUXPROOF_RECORDINGS names their folder, ../shared/recordings without it.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from fluxproof.checkout import BUILD, recordings
from fluxproof.diagnosis.command import Progress
from fluxproof.files import write_json
from studies.real import brusa, emrax, laas

PARTS = {"brusa_flux_map": brusa, "emrax228": emrax, "laas_mn4004": laas}


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(prog="python -m studies.real", description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(PARTS)}; default: all")
    parser.add_argument("--out", type=Path, default=BUILD / "real")
    parser.add_argument("--quiet", action="store_true")
    args = parser.parse_args(arguments)
    unknown = sorted(set(args.names) - set(PARTS))
    if unknown:
        parser.error(f"{unknown[0]} is not one of {', '.join(PARTS)}")
    folder, result = recordings(), {"schema": 1, "recordings": {}}
    for name in args.names or PARTS:
        part, started = PARTS[name], time.perf_counter()
        file = folder / part.FILE
        if not file.exists():
            result["recordings"][name] = {
                "skipped": f"{part.FILE} is missing; FLUXPROOF_RECORDINGS names its folder"
            }
            continue
        with Progress(quiet=args.quiet) as progress:
            entry = part.run(folder, args.out, progress)
        entry["seconds"]["all"] = time.perf_counter() - started
        result["recordings"][name] = entry
        print(f"{name}: {entry['verdict']}. {entry['sentence']}")
    print(write_json(args.out / "result.json", result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
