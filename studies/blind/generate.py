# SPDX-License-Identifier: BSD-3-Clause
"""Write a benchmark: `python -m studies.blind.generate --generator motulator --seed 1 --count 60`.

OUT/case_0001/recording.csv or .parquet and drive.toml, shuffled so that a number says nothing about the
stratum; the truth of all cases in OUT/../truth_NAME.sealed, its SHA-256 in OUT/sealed.sha256.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from fluxproof.checkout import BUILD
from fluxproof.files import write_text
from fluxproof.fleet.engine import in_parallel
from studies.blind import cases, identifiable
from studies.blind.circuit import cases as circuit
from studies.blind.circuit.write import write_case as write_circuit
from studies.blind.seal import seal
from studies.blind.sealed import cases as sealed
from studies.blind.sealed.write import write_case as write_sealed
from studies.blind.strangers import cases as strangers
from studies.blind.strangers.write import write_case

ATTEMPTS = 12
GENERATORS = ("own", *strangers.GENERATORS, "sealed", "circuit")


def listing(seed: int, count: int, only: list[str] | None, generator="own") -> list[tuple[int, str, int]]:
    """(case number, stratum, turn within the stratum), shuffled by the seed."""
    counts = cases.strata_counts(count, strata_of(generator))
    if only:
        counts = {name: counts[name] for name in only}
    entries = [(name, turn) for name, n in counts.items() for turn in range(n)]
    np.random.default_rng([seed, 77]).shuffle(entries)
    return [(k + 1, str(name), int(turn)) for k, (name, turn) in enumerate(entries)]


def strata_of(generator: str) -> dict[str, float]:
    """Shares of a generator's strata."""
    return {"own": cases.STRATA, "sealed": sealed.STRATA, "circuit": circuit.STRATA}.get(generator, strangers.STRATA)


def write_recording(path: Path, columns: dict, kind: str) -> Path:
    """Columns as CSV (nine digits) or Parquet, written to a temporary name first."""
    frame = pd.DataFrame(columns)
    path = path.with_suffix(f".{kind}")
    temporary = path.with_name(f".{os.getpid()}.{path.name}")
    if kind == "csv":
        frame.to_csv(temporary, index=False, float_format="%.9g")
    else:
        frame.to_parquet(temporary, index=False)
    os.replace(temporary, path)
    return path


def generate_case(job) -> dict:
    """Simulate and write one case; its entry of the truth."""
    generator, seed, number, stratum, turn, out = job
    if generator == "sealed":
        return write_sealed(job, write_recording)
    if generator == "circuit":
        return write_circuit(job, write_recording)
    if generator != "own":
        return write_case(job, write_recording)
    for attempt in range(ATTEMPTS):
        case = cases.make(seed, number, stratum, turn, attempt)
        try:
            columns, codes, _ = cases.record(case, seed, attempt)
        except ZeroDivisionError:  # the flux map has no unique current within the range: not a valid drive
            continue
        if stratum == "damaged" or cases.sound(case, columns):
            break
    else:
        raise RuntimeError(f"case {number} ({stratum}): no sound drive in {ATTEMPTS} attempts")
    folder = out / f"case_{number:04d}"
    folder.mkdir(parents=True, exist_ok=True)
    build = case.build
    path = write_recording(folder / "recording", columns, build.file_kind)
    write_text(folder / "drive.toml", build.nominal.toml())
    return {
        "case": folder.name,
        "recording": path.name,
        "stratum": stratum,
        "index": number,
        "turn": turn,
        "attempt": attempt,
        "generator": generator,
        "effects": case.effects,
        "kind": case.kind,
        "problem_codes": codes,
        "identifiable": identifiable.judge(case),
        "with_torque": build.with_torque,
        "free_shaft": build.plan.free,
        "rows": len(columns["t"]),
    }


def generate(
    seed: int, out: Path, count: int, only: list[str] | None = None, jobs: int = 2, generator: str = "own"
) -> str:
    """All cases of a seed into ``out``; returns the truth's SHA-256."""
    out = Path(out).resolve()
    out.mkdir(parents=True, exist_ok=True)
    for old in [*out.glob("case_*/recording.*"), *out.glob("case_*/drive.toml"), out / "sealed.sha256"]:
        old.unlink(missing_ok=True)
    for old in out.glob("case_*"):
        old.rmdir()
    work = [(generator, seed, *entry, out) for entry in listing(seed, count, only, generator)]
    truth = []
    for _, entry in in_parallel(generate_case, work, jobs, f"{generator}: cases"):
        truth.append(entry)
    truth.sort(key=lambda entry: entry["case"])
    return seal(out, {"seed": seed, "generator": generator, "cases": truth})


def main(arguments=None) -> int:
    """The command line; returns 0 when all cases are written."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--generator", choices=GENERATORS, default="own")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--only", help="strata, separated by commas: " + ", ".join(cases.STRATA))
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(arguments)
    only = options.only.split(",") if options.only else None
    strata = strata_of(options.generator)
    wrong = set(only or ()) - set(strata)
    if wrong:
        parser.error(f"--only: no stratum {', '.join(sorted(wrong))}; known are {', '.join(strata)}")
    out = options.out or BUILD / "blind" / options.generator / f"seed{options.seed}"
    digest = generate(options.seed, out, options.count, only, options.jobs, options.generator)
    print(f"{out}: sealed, SHA-256 {digest}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
