# SPDX-License-Identifier: BSD-3-Clause
"""How long `fluxproof simulate` takes on the drives with front ends, and what it says of them."""

from __future__ import annotations

import json
import subprocess
import sys
import time

import pytest

from fluxproof.checkout import DRIVES, ROOT


@pytest.mark.study
@pytest.mark.parametrize("name", ["servo_24v", "hub_36v", "spindle_400v", "drone_24v"])
def test_simulate_in_time(name, figure, tmp_path):
    """The second of two runs: the first compiles, once for all drives and versions."""
    command = [sys.executable, "-m", "fluxproof", "simulate", str(DRIVES / f"{name}.toml"), "--out", str(tmp_path)]
    for _ in range(2):
        began = time.monotonic()
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        seconds = time.monotonic() - began
    assert done.returncode == 0, done.stdout + done.stderr
    figure(f"{name}: fluxproof simulate", round(seconds, 1), "< 20", "s", seconds < 20.0)
    assert json.loads((tmp_path / "simulation.json").read_text())["status"] == "ok"
