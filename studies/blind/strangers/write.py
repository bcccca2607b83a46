# SPDX-License-Identifier: BSD-3-Clause
"""Write a case of a stranger, with its entry of the truth."""

from __future__ import annotations

from fluxproof.files import write_text
from studies.blind.strangers import cases, rows

ATTEMPTS = 12


def write_case(job, write_recording) -> dict:
    """Simulate and write one case; its entry of the truth.  write_recording: of generate.py."""
    generator, seed, number, stratum, turn, out = job
    for attempt in range(ATTEMPTS):
        case = cases.make(generator, seed, number, stratum, turn, attempt)
        columns = cases.columns_of(case, seed, number, attempt)
        if rows.sound(columns, case.drive):
            break
    else:
        raise RuntimeError(f"case {number} ({stratum}): no sound drive in {ATTEMPTS} attempts")
    folder = out / f"case_{number:04d}"
    folder.mkdir(parents=True, exist_ok=True)
    path = write_recording(folder / "recording", columns, "parquet")
    write_text(folder / "drive.toml", case.drive.toml())
    names = [e["name"] for e in case.effects]
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
        "problem_codes": [],
        # The draws leave out what a recording cannot show; nothing is excused beyond that.
        "identifiable": {"all": True, "effects": dict.fromkeys(names, True), "rivals": []},
        "with_torque": case.plan.torque,
        "free_shaft": case.plan.free,
        "rows": len(columns["t"]),
    }
