# SPDX-License-Identifier: BSD-3-Clause
"""What commands are given and what they say when they are stopped."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.recordings import from_core as bench

STOPPED = "fluxproof: stopped\n"


def write_inputs(folder: Path) -> Path:
    """A folder with drive.toml, two recordings whose angle stands still, and a good one."""
    (folder / "drive.toml").write_bytes(PAPER.read_bytes())
    table = pd.DataFrame({name: values[:900] for name, values in bench.columns(bench.GRID[:4]).items()})
    table.to_csv(folder / "good.csv", index=False)
    table.assign(theta_e=0.5).to_csv(folder / "stopped.csv", index=False)
    table.assign(theta_e=1.0).to_csv(folder / "stopped_too.csv", index=False)
    return folder
