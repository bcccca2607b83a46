# SPDX-License-Identifier: BSD-3-Clause
"""What the front ends do to the drive: a wrong index trips it by name; the host may give the position."""

from __future__ import annotations

import ast
import inspect
import json
import operator
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cocotb_tests.support.board.fault_cases import MOVED, RATE
from fluxproof.checkout import ROOT
from fluxproof.cosim import board_clock, ghdl
from golden_model.io.board_faults import NAMES
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
    assert facts["board_first"] == 1 and facts["board_flags"] & 0b111 == 1
    assert facts["first_fault"] == 1 << TRIP and facts["irq"] == 1
    assert facts["clocks_to_off"] <= 4


def test_a_forced_position_turns_and_the_encoder_is_read_beside_it():
    facts = run("forced")
    assert facts["steps"] == [RATE >> 16] and facts["fault_flags"] == 0
    assert facts["board_flags"] == 0, "no index is missed with the gates off"
    assert facts["refused"] > facts["snap_position"], "the source stays while the gates switch"
    assert facts["snap_ready"] == 1 and facts["forced"] == 0
    assert facts["snap_position"] > 0.05 * 2**16 and abs(facts["snap_code"] - facts["snap_position"]) > 100
    assert abs(facts["after"] - facts["snap_code"]) < 400, "the encoder's code is back"
    assert max(map(abs, facts["currents"])) > 0.5


def test_no_torque_before_the_index():
    """Enabled before its index the drive never switches a gate and says why; the angle that the host gives may."""
    facts = run("no_index")
    assert facts["gates_before"] == 0 and facts["first_fault"] == 1 << TRIP
    assert facts["board_first"] == 1 << NAMES.index("no_index") and facts["refused_again"] == 0
    assert facts["gates_forced"] > 0


def test_a_trip_beats_a_clear():
    """A pulse at the pin trip within the clocks that a write of clear_trip takes: the drive stays off until later."""
    facts = run("trip_against_clear")
    assert facts["running_before"] and facts["after"] == [0] * len(facts["after"]) and len(facts["after"]) == 12
    assert facts["first_faults"] == [1 << TRIP] * 12 and facts["running_at_last"]


@pytest.mark.slow
def test_hall_codes_stop_the_drive_by_name():
    """Code 111 refuses the enable; a code that skips a sector, one line at 0 and 111 while it runs turn it off."""
    facts = run("hall_code")
    code = 1 << NAMES.index("hall_code")
    for name in ("111 at enable", "111", "000", "skipped"):
        seen = facts[name]
        assert seen["board_first"] == code and seen["gates_after"] == 0, (name, seen)
        assert seen["ran"] == (name != "111 at enable"), (name, seen)
    assert facts["good"]["board_first"] == 0 and facts["good"]["ran"] and facts["good"]["gates_after"] > 0


def test_the_waveform_of_a_relative_folder_lies_there(monkeypatch, tmp_path):
    """The simulator works in a folder of its own."""
    monkeypatch.setenv("FLUXPROOF_WAVES", "1")
    monkeypatch.chdir(tmp_path)
    assert ghdl.waves(Path("build/waves")) == [f"--fst={tmp_path / 'build/waves/waves.fst'}"]


def test_the_golden_board_can_be_compiled():
    """The runs above are not compiled: numba takes no record that leaves a field out, nor a choice among its values."""
    whole = 0
    sources = [inspect.getsource(kernel.py_func) for kernel in (board_clock.one_clock, board_clock.core_clock)]
    for call in ast.walk(ast.parse("\n".join(sources))):
        if not isinstance(call, ast.Call) or not call.keywords:
            continue
        record = operator.attrgetter(ast.unparse(call.func))(board_clock)
        assert {k.arg for k in call.keywords} == set(record._fields), record
        assert not any(isinstance(k.value, ast.IfExp) for k in call.keywords), record
        whole += 1
    assert whole == 6


def test_the_pins_of_a_master_reach_the_gear():
    """Of the golden board: the code that the gear has is that of the count of edges at the last trigger."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-m", "cocotb_tests.support.board.master_case"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert facts["triggers"] > 5 and facts["code"] in facts["expected"], facts
    assert facts["unbuilt"] == 0
