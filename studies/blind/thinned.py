# SPDX-License-Identifier: BSD-3-Clause
"""The same drives behind a slow logger: every N-th row of each case: `python -m studies.blind.thinned --seed 1`.

Rows that do not follow each other have no voltage balance between them: what is left are operating points, which show
fewer effects.  Writes build/blind/GENERATOR/thinned.json.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from pyarrow import parquet

from fluxproof.checkout import BUILD
from fluxproof.diagnosis.catalogue import CATALOGUE
from fluxproof.files import write_json, write_text
from fluxproof.fleet.engine import in_parallel
from studies.blind.figures import asserted, confidently_wrong, named_right, rate, tied, true_names
from studies.blind.generate import GENERATORS, generate
from studies.blind.score import answer_of, recording_of
from studies.blind.seal import unseal

FOLDER = BUILD / "blind"
EVERY = 6  # rows; of 8 to 20 kHz


def thin(case: Path, out: Path, every: int) -> Path:
    """Write every N-th row of a case's recording and its drive file to ``out``."""
    source = recording_of(case)
    out.mkdir(parents=True, exist_ok=True)
    if source.suffix == ".parquet":
        table = parquet.read_table(source)
        parquet.write_table(table.take(list(range(0, table.num_rows, every))), out / source.name)
    else:
        head, *rows = source.read_text().splitlines()
        write_text(out / source.name, "\n".join([head, *rows[::every]]) + "\n")
    write_text(out / "drive.toml", (case / "drive.toml").read_text())
    return out


def visible(truth) -> bool:
    """Whether operating points show all effects of a case."""
    return not any("harmonics" in CATALOGUE[n].needs for n in true_names(truth))


def summary(pairs) -> dict:
    """Figures of (truth, answer) pairs; refused recordings count in ``refused`` alone."""
    known = [(t, a) for t, a in pairs if a.get("verdict") not in (None, "bad_recording")]
    faulty = [(t, a) for t, a in known if t["effects"] and visible(t)]
    healthy = [a for t, a in known if t["stratum"] == "healthy"]
    ties = [(t, a) for t, a in faulty if a["verdict"] == "ambiguous"]
    return {
        "cases": len(pairs),
        "refused": len(pairs) - len(known),
        "exactly_right": rate("exactly_right", [named_right(t, a) for t, a in faulty]),
        "ambiguous": rate("ambiguous", [a["verdict"] == "ambiguous" for _, a in faulty]),
        "truth_inside": rate("truth_inside", [true_names(t) <= asserted(a) | tied(a) for t, a in ties]),
        "false_names": rate("false_names", [confidently_wrong(t, a) for t, a in known]),
        "healthy_with_mismatch": rate("healthy_with_mismatch", [a["verdict"] != "no_mismatch" for a in healthy]),
    }


def main(arguments=None) -> int:
    """The command line; returns 0 whatever the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--generator", choices=GENERATORS, default="own")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--every", type=int, default=EVERY)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(arguments)
    folder = FOLDER / options.generator / f"seed{options.seed}"
    if not (folder / "sealed.sha256").exists():
        generate(options.seed, folder, options.count, jobs=options.jobs, generator=options.generator)
    cases = sorted(folder.glob("case_*"))[: options.count]
    made = folder.parent / f"thinned_{options.every}_seed{options.seed}"
    work = [thin(case, made / case.name, options.every) for case in cases]
    answers = dict(answer for _, answer in in_parallel(answer_of, work, options.jobs, "diagnosed"))
    truth = {t["case"]: t for t in unseal(folder)["cases"]}
    result = summary([(truth[name], answer) for name, answer in sorted(answers.items())])
    write_json(folder.parent / "thinned.json", {"every": options.every, "seed": options.seed, **result})
    for name, f in result.items():
        counted = f"{f['k']} of {f['n']}" if isinstance(f, dict) else f
        print(f"{name:24s} {counted}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
