# SPDX-License-Identifier: BSD-3-Clause
"""What the front ends do to the drive: a wrong index trips it by name; the host may give the position."""

from __future__ import annotations

import json
import os
import subprocess
import sys

from cocotb_tests.support.board.fault_cases import MOVED, RATE
from fluxproof.checkout import ROOT
from golden_model.io.fault_latch import TRIP


def run(case: str) -> dict:
    command = [sys.executable, "-m", "cocotb_tests.support.board.fault_cases", case]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_wrong_index_stops_the_drive_by_name():
    facts = run("index_wrong")
    assert facts["moved"] and facts["encoder_flags"] & 0b1001 == 0b1001 and facts["index_count"] == MOVED
    assert facts["board_first"] == facts["board_flags"] == 1
    assert facts["first_fault"] == 1 << TRIP and facts["irq"] == 1
    assert facts["clocks_to_off"] <= 4


def test_a_forced_position_turns_and_the_encoder_is_read_beside_it():
    facts = run("forced")
    assert facts["steps"] == [RATE >> 16] and facts["fault_flags"] == facts["board_flags"] == 0
    assert facts["snap_ready"] == 1 and facts["forced"] == 0
    assert facts["snap_position"] > 0.05 * 2**16 and abs(facts["snap_code"] - facts["snap_position"]) > 100
    assert abs(facts["after"] - facts["snap_code"]) < 400, "the encoder's code is back"
    assert max(map(abs, facts["currents"])) > 0.5
