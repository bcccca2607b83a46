# SPDX-License-Identifier: BSD-3-Clause
"""Write a case, with its entry of the truth."""

from __future__ import annotations

from fluxproof.files import write_text
from studies.blind.sealed import cases, record

ATTEMPTS = 20


def write_case(job, write_recording) -> dict:
    """Simulate and write one case; its entry of the truth.  write_recording: of generate.py."""
    _, seed, number, stratum, turn, out = job
    for attempt in range(ATTEMPTS):
        case = cases.make(seed, number, stratum, turn, attempt)
        columns, _, kept = cases.simulate(case, seed, number, attempt)
        if record.sound(columns, case.drive, case.plan):
            break
    else:
        raise RuntimeError(f"case {number} ({stratum}): no sound drive in {ATTEMPTS} attempts")
    folder = out / f"case_{number:04d}"
    folder.mkdir(parents=True, exist_ok=True)
    path = write_recording(folder / "recording", kept, case.file_kind)
    write_text(folder / "drive.toml", case.drive.toml())
    names = [e["name"] for e in case.effects]
    return {
        "case": folder.name,
        "recording": path.name,
        "stratum": stratum,
        "index": number,
        "turn": turn,
        "attempt": attempt,
        "generator": "sealed",
        "effects": case.effects,
        "kind": case.kind,
        "problem_codes": [],
        "identifiable": {
            "all": not case.rivals,
            "effects": dict.fromkeys(names, not case.rivals),
            "rivals": case.rivals,
        },
        "with_torque": case.torque,
        "free_shaft": case.plan.free,
        "rows": len(kept["t"]),
    }
