# SPDX-License-Identifier: BSD-3-Clause
"""`make prove`: proves every property of the catalogue, checks its planted faults, writes build/prove/result.json.

Exit status 1 if a property is not proved, a cover is unreachable, or a planted fault is not detected.
"""

from __future__ import annotations

import argparse
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed

from fluxproof.cosim.verilog import NoUsableGhdl, find_ghdl
from fluxproof.files import write_json
from scripts.prove import document
from scripts.prove.catalogue import catalogue, left_out
from scripts.prove.document import method_of
from scripts.prove.judge import judge
from scripts.prove.solve import FOLDER


def line_of(entry: dict) -> str:
    """One verdict as a line of progress."""
    word = "proved" if entry["pass"] else "FAILED"
    mutants = f"{sum(m['caught'] for m in entry['mutants'])}/{len(entry['mutants'])} mutants caught"
    text = f"{word} {entry['property']}: {method_of(entry)}; {mutants}; {entry['seconds']} s"
    return f"{text}\n    {entry['reason']}" if entry["reason"] else text


def main() -> int:
    parser = argparse.ArgumentParser(prog="prove", description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="only properties whose name or entity contains this text")
    parser.add_argument("--jobs", type=int, default=2, help="proofs in parallel")
    parser.add_argument("--limit", type=int, default=120, help="seconds for one run of the solver")
    parser.add_argument("--list", action="store_true", help="print the properties and exit")
    parser.add_argument(
        "--document", action="store_true", help="write the table of the last complete run to docs/proofs.md and exit"
    )
    arguments = parser.parse_args()
    if arguments.document:
        if not (FOLDER / "result.json").exists():
            parser.exit(1, "prove: no build/prove/result.json yet; `make prove` writes it\n")
        print(f"wrote {document.write()}")
        return 0
    proofs = [p for p in catalogue() if arguments.only in p.name or arguments.only in p.entity]
    if arguments.list:
        print("\n".join(f"{p.name}: {p.says}" for p in proofs))
        return 0
    if not proofs:
        parser.error(f"--only {arguments.only}: no such property; --list shows them")
    try:
        find_ghdl()
    except NoUsableGhdl as reason:
        parser.exit(1, f"prove: {reason}\n")
    for entity in left_out():
        print(f"nothing proved of {entity}: it is not in rtl/")
    began, entries = time.monotonic(), {}
    with ThreadPoolExecutor(arguments.jobs) as pool:
        running = {pool.submit(judge, proof, arguments.limit): proof.name for proof in proofs}
        for done, future in enumerate(as_completed(running), 1):
            entry = entries[running[future]] = future.result()
            print(f"{done:3d}/{len(proofs)} {line_of(entry)}", flush=True)
    results = [entries[proof.name] for proof in proofs]
    write_json(FOLDER / ("some.json" if arguments.only else "result.json"), results)
    proved = sum(e["pass"] for e in results)
    caught = sum(m["caught"] for e in results for m in e["mutants"])
    planted = sum(len(e["mutants"]) for e in results)
    good = all(e["pass"] and e["mutant_caught"] for e in results)
    print(
        f"{proved} of {len(results)} properties proved, {caught} of {planted} mutants caught, "
        f"{time.monotonic() - began:.0f} s"
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
