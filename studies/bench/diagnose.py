# SPDX-License-Identifier: BSD-3-Clause
"""`make bench`: time and memory of ``fluxproof diagnose`` against the rows of a recording.

The recorded drive has 20 % more resistance than its drive file: the core in closed loop with the averaged plant, with
operating points of 0.1 s, so that a longer recording has more of them.  Every size and format is diagnosed by a
separate process; its peak memory is that reported by the operating system.
Writes build/bench/diagnose.json.

    python -m studies.bench.diagnose [ROWS ...]
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

from fluxproof.checkout import BUILD, ROOT
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.diagnosis.replay.capture import capture
from fluxproof.diagnosis.replay.telemetry_columns import electrical_angle
from fluxproof.files import write_json
from fluxproof.plant import IMPOSED_SPEED, Machine
from golden_model import drive as drives
from golden_model.formats import TURN
from golden_model.registers import registers
from golden_model.units import TURN_RAD, si_per_lsb

DRIVE = ROOT / "docs" / "drives" / "paper001.toml"
ROWS = (10_000, 100_000, 1_000_000)
FORMATS = (".csv", ".parquet")
DWELL, RAMP = 1000, 200  # rows per operating point, and the rows of the ramp to it among them
TARGET_S = 60.0  # for a million rows on two cores


def columns(rows: int) -> dict[str, np.ndarray]:
    """Canonical columns (rows,) of the diagnosed drive."""
    drive = drives.load(DRIVE)
    register_set = registers(drive)
    points = -(-rows // DWELL)
    rng = np.random.default_rng(7)
    goals = rng.uniform((-160.0, -2.5, -4.5), (160.0, 1.5, 4.5), (points, 3))  # rad/s mechanical, i_d, i_q
    before = np.concatenate([np.zeros((1, 3)), goals[:-1]])
    rise = np.minimum((np.arange(DWELL) + 1) / RAMP, 1.0)[None, :, None]
    course = (before[:, None, :] + rise * (goals - before)[:, None, :]).reshape(-1, 3)[:rows]
    zeros, ones = np.zeros(rows, np.int64), np.ones(rows, np.int64)
    references = {
        name: np.round(course[:, k] / si_per_lsb(name, drive)).astype(np.int64)
        for k, name in ((1, "i_d_ref"), (2, "i_q_ext"))
    }
    scenario = Scenario(
        omega_ref=zeros, load=course[:, 0].copy(), u_dc=np.full(rows, drive.inverter.dc_bus_v), speed_mode=zeros,
        enable=ones, **references,
    )  # fmt: skip
    machine = Machine.from_mapping(vars(drive.machine) | {"resistance_ohm": 1.2 * drive.machine.resistance_ohm})
    samples, seen, _ = capture(drive, register_set, scenario, machine=machine, mode=IMPOSED_SPEED)
    table = {name: seen[name] * si_per_lsb(name, drive) for name in ("i_a", "i_b", "i_c", "u_dc")}
    table["omega_e"] = seen["omega_me"] * si_per_lsb("omega_me", drive)
    angle = electrical_angle(samples[:, 4], register_set.values._asdict(), register_set.config.position_bits)
    table["theta_e"] = angle * TURN.lsb * TURN_RAD
    table |= {f"d_{x}": seen[f"compare_{x}"] / register_set.config.carrier_half for x in "abc"}
    return {"t": np.arange(rows) * drive.sample_time_s} | table


def write(path: Path, table: dict[str, np.ndarray]) -> Path:
    """Write the columns in the format of the suffix, text with the digits of a typical logger; returns the path."""
    frame = pd.DataFrame(table)
    if path.suffix == ".csv":
        frame.to_csv(path, index=False, float_format="%.9g")
    else:
        frame.to_parquet(path, index=False)
    return path


def measured(recording: Path, out: Path) -> dict:
    """Seconds, processor seconds and peak memory of one run of the command; its verdict and names."""
    command = [sys.executable, "-m", "fluxproof.command", "diagnose", str(recording)]
    began = time.perf_counter()
    with open(out.with_suffix(".txt"), "w") as log:
        process = subprocess.Popen(
            [*command, "--drive", str(DRIVE), "--out", str(out), "--quiet"], cwd=ROOT, stdout=log, stderr=log
        )
        _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - began
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}: {out.with_suffix('.txt').read_text()}")
    answer = json.loads((out / "diagnosis.json").read_text())
    return {
        "seconds": round(seconds, 2),
        "processor_seconds": round(usage.ru_utime + usage.ru_stime, 2),
        "peak_memory_mb": round(usage.ru_maxrss / 1024),
        "verdict": answer["verdict"],
        "effects": [effect["name"] for effect in answer["effects"]],
    }


def main(sizes=ROWS) -> list[dict]:
    """Measure every size in every format; returns and writes the table."""
    results = []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        measured(write(folder / "warm.parquet", columns(5000)), folder / "warm")  # fills the compile cache
        for rows in sizes:
            table = columns(rows)
            for suffix in FORMATS:
                path = write(folder / f"rows{rows}{suffix}", table)
                result = {"rows": rows, "format": suffix[1:], "file_mb": round(path.stat().st_size / 1e6, 1)}
                result |= measured(path, folder / f"out{rows}{suffix[1:]}")
                results.append(result)
                print(
                    f"diagnose {rows:9,d} rows, {suffix[1:]:8s} {result['seconds']:7.1f} s  "
                    f"{result['peak_memory_mb']:6d} MB  {result['verdict']} {', '.join(result['effects'])}",
                    flush=True,
                )
                path.unlink()
    path = write_json(
        BUILD / "bench" / "diagnose.json",
        {"processors": os.cpu_count(), "target_seconds_for_a_million_rows": TARGET_S, "runs": results},
    )
    print(f"wrote {path.relative_to(ROOT)}")
    return results


if __name__ == "__main__":
    main(tuple(int(rows) for rows in sys.argv[1:]) or ROWS)
