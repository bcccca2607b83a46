# SPDX-License-Identifier: BSD-3-Clause
"""Write a case, with its entry of the truth."""

from __future__ import annotations

from fluxproof.files import write_text
from studies.blind.circuit import cases, record

ATTEMPTS = 12


def write_case(job, write_recording) -> dict:
    """Simulate and write one case; its entry of the truth.  write_recording: of generate.py."""
    _, seed, number, stratum, turn, out = job
    for attempt in range(ATTEMPTS):
        case = cases.make(seed, number, stratum, turn, attempt)
        _, kept = cases.simulate(case, seed, number, attempt)
        if record.sound(kept, case.drive, case.plan):
            break
    else:
        raise RuntimeError(f"case {number} ({stratum}): no sound drive in {ATTEMPTS} attempts")
    folder = out / f"case_{number:04d}"
    folder.mkdir(parents=True, exist_ok=True)
    path = write_recording(folder / "recording", kept, "parquet")
    write_text(folder / "drive.toml", case.drive.toml())
    names = [e["name"] for e in case.effects]
    return {
        "case": folder.name,
        "recording": path.name,
        "stratum": stratum,
        "index": number,
        "turn": turn,
        "attempt": attempt,
        "generator": "circuit",
        "effects": case.effects,
        "kind": case.kind,
        "problem_codes": [],
        # The plan has the currents and speeds that each cause needs; nothing is excused beyond that.
        "identifiable": {"all": True, "effects": dict.fromkeys(names, True), "rivals": []},
        "with_torque": case.torque,
        "free_shaft": False,
        "rows": len(kept["t"]),
    }
