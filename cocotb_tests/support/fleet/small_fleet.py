# SPDX-License-Identifier: BSD-3-Clause
"""A small fleet on disk: eight drives with manufacturing spread, two of them faulty, and two files that are none."""

from __future__ import annotations

import csv
from pathlib import Path

from fluxproof.files import write_text
from studies.blind.generate import write_recording
from studies.fleet import drives

SEED, ROWS = 25, 6000
FAULTS = {3: "encoder_offset", 6: "current_gain"}
GOOD = 8


def write(folder: Path, numbers=range(GOOD)) -> Path:
    """The recordings, two bad files and manifest.csv; returns the manifest."""
    nominal = drives.design_of(SEED)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "drive.toml", nominal.toml())
    lines = []
    for n in numbers:
        drive = drives.healthy(nominal, SEED, n, ROWS)
        if n in FAULTS:
            drives.with_fault(drive, SEED, n, FAULTS[n])
        path = write_recording(folder / f"drive_{n:02d}", drives.record(drive, SEED, n), "parquet")
        lines.append((path.name, f"S{n:02d}", f"2026-01-{n + 1:02d}T08:00:00", "25.5", "line 2"))
    write_text(folder / "empty.csv", "")
    (folder / "torn.parquet").write_bytes((folder / "drive_00.parquet").read_bytes()[:5000])
    lines += [("empty.csv", "S90", "", "", ""), ("torn.parquet", "S91", "", "", "")]
    with open(folder / "manifest.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(("recording", "serial", "time", "temperature", "station"))
        rows.writerows(lines)
    return folder / "manifest.csv"


class Here:
    """An engine in this process, for what does not depend on processes."""

    dashboard = ""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def each(self, function, items):
        for item in items:
            yield item, function(item)
