# SPDX-License-Identifier: BSD-3-Clause
"""fluxproof_board turns a motor from A/B/Z edges and SPI lines to gates, at every clock as the golden board."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cocotb_tests.support.board.loop_bench import CONSTANT
from cocotb_tests.support.board.run_cases import (
    HUB_PERIODS,
    RPM,
    RUNS,
    SNAP_AT,
    first_difference,
    of_drive,
    start_from_standstill,
    status,
)
from cocotb_tests.support.needs import skip_without_ghdl5
from cocotb_tests.support.slow import slowly
from fluxproof.checkout import DRIVES, ROOT
from fluxproof.command import main
from fluxproof.cosim.board_clock import SEEN
from fluxproof.cosim.verilated import VerilatedCore
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.replay import digital, telemetry
from fluxproof.plant.sensors import current_code
from golden_model.board_registers import board_set
from golden_model.fluxproof import Observed, Sample
from golden_model.generated.register_names import ADDRESSES
from golden_model.io.board_faults import NAMES
from golden_model.io.fault_latch import TRIP
from golden_model.io.telemetry_words import COUNT, pack


def in_ghdl(periods: int, run: str, folder: Path, compiled: bool = False) -> dict[str, float]:
    """Facts of the run; AssertionError with the first difference.

    ``compiled``: with numba, which takes as long to compile the golden board as to run some hundred periods without.
    """
    command = [sys.executable, "-m", "cocotb_tests.support.board.ghdl_bench", run, str(periods), str(folder)]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": str(int(not compiled))}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "board.json").read_text()) | {"folder": folder}


@pytest.mark.slow
def test_closed_loop_in_ghdl(tmp_path):
    """136 periods of 160 clocks: every register over the bus, enabled, the motor turns, the index is found."""
    facts = in_ghdl(136, "standstill, short periods", tmp_path)
    assert facts["clocks"] > 136 * 160 and facts["samples"] >= 90 and facts["rpm"] > 50
    assert facts["encoder_flags"] & 1 and facts["index_count"] > 0 and facts["illegal_count"] == 0
    assert facts["board_flags"] == 1 << NAMES.index("no_index") and facts["snap_ready"] == 1, "told before the index"


@pytest.mark.parametrize(("run", "after"), [
    pytest.param("before the index", 16, marks=pytest.mark.slow),
    pytest.param("clear at a trip", 44, marks=pytest.mark.slow),
    pytest.param("Hall sensors: 111 at enable", 12, marks=pytest.mark.slow),
    pytest.param("Hall sensors: 111", 12, marks=pytest.mark.slow),
    pytest.param("Hall sensors: 000", 12, marks=pytest.mark.slow),
    pytest.param("Hall sensors: skipped", 12, marks=pytest.mark.slow),
])  # fmt: skip
def test_faults_of_the_board_in_ghdl(run, after, tmp_path):
    """What turns the gates off by name, through the pins: every clock as the golden board (test_front_ends judges)."""
    periods = RUNS[run]().settled + after
    facts = in_ghdl(periods, run, tmp_path)
    stopped = run not in ("clear at a trip", "before the index")
    assert facts["clocks"] > 0 and (facts["board_first"] == 1 << NAMES.index("hall_code")) == stopped


@pytest.mark.parametrize("run", ["faults, serial and modulators", slowly("faults, edges")])
def test_every_fault_of_the_board_through_the_pins(tmp_path, run):
    """Faults of the front ends, ignored and not, a host that is silent, the trip pin: gates and irq at every clock."""
    facts = in_ghdl(RUNS[run]().periods, run, tmp_path)
    assert facts["clocks"] > 10_000 and facts["samples"] > 50 and facts["gates_after"] > 0


@pytest.mark.study
@pytest.mark.timeout(3600)
def test_closed_loop_over_2000_periods(figure, tmp_path):
    """160 clocks a period: GHDL makes about a thousand clocks a second of this design."""
    facts = in_ghdl(2000, "standstill, short periods", tmp_path, compiled=True)
    figure("closed loop, A/B/Z and SPI, GHDL against golden, 2,000 periods", 0, 0, "differences", True)
    assert facts["rpm"] < -0.9 * RPM and facts["samples"] > 1900


@pytest.mark.slow
def test_a_drive_file_with_hall_sensors_and_xadc_in_ghdl(tmp_path):
    """Every register from the file; the shaft turns, the speed is that between its Hall edges; the stream replays."""
    facts = in_ghdl(HUB_PERIODS, "hub_36v, slow clock", tmp_path)
    assert facts["samples"] > 25 and facts["encoder_flags"] >> 5 & 1 and facts["rpm"] > 200
    assert facts["board_flags"] == facts["illegal_count"] == 0
    assert facts["fault_flags"] == 1 << TRIP and facts["gates_after"] == 0, "the pulse at the trip pin alone"
    check_stream(facts, RUNS["hub_36v, slow clock"]().drive, tmp_path)


def check_stream(facts: dict, drive, folder: Path) -> None:
    """The stream is what the golden board has seen, and `fluxproof dump` makes a recording that replays equal.

    The speed of every sample is that between edges, which no register has.
    """
    words = np.fromfile(facts["folder"] / "capture.bin", "<u4").reshape(-1, COUNT)
    names = (*Sample._fields, *Observed._fields)
    said = [dict(zip(names, (*a, *b), strict=True)) for a, b in facts["history"]]
    wanted = [pack(k, values) for k, values in enumerate(said)]
    assert len(words) > 10 and words.tolist() == [list(wanted[k]) for k in words[:, 1]]
    assert all(values["speed_was_given"] for values in said[-len(words) :])
    register_set, path = board_set(drive), folder / "run.fluxdump"
    given = {"registers": register_set.values._asdict(), "generics": register_set.config._asdict()}
    (folder / "registers.json").write_text(json.dumps(given))
    command = ["dump", str(facts["folder"] / "capture.bin"), "--drive", str(DRIVES / "hub_36v.toml")]
    assert main([*command, "--registers", str(folder / "registers.json"), "-o", str(path)]) == 0
    columns, meta = telemetry.read_dump(path)
    found = from_columns(columns, drive.sample_time_s, str(path))
    found.meta = meta
    got, _ = digital.replay(found)
    assert got.checked and got.samples == len(words) and got.first_difference is None, got
    meta["observed"]["speed_was_given"][:] = 0  # without it the replay takes the speed of the code
    assert digital.replay(found)[0].samples != len(words)


@pytest.mark.study
@pytest.mark.parametrize("name", ["servo_24v", "hub_36v", "spindle_400v", "drone_24v"])
def test_drive_file_with_its_pins_in_verilator(name, figure):
    """400 periods at the file's own clock, with the file's own encoder and converters: start and reversal."""
    skip_without_ghdl5()
    loop = of_drive(name)
    core = VerilatedCore(loop.generics(), top="fluxproof_board")
    core.set_many(CONSTANT)
    core.reset()
    core.tick(2)
    speeds, different, told = [], 0, ""
    for chunk in loop.run(400):
        problem = first_difference(core.play(chunk.inputs, SEEN), chunk.seen, SEEN, chunk.number)
        different, told = different + (problem is not None), told or problem or ""
        speeds.append(chunk.omega_m)
    figure(f"{name}: closed loop of its pins, 400 periods", different, 0, "periods that differ", different == 0)
    assert different == 0, told
    latch, rated = loop.golden.state.of_core.of_fault_latch, loop.drive.machine.rated_speed_rad_s
    assert latch.flags == 0 and status(chunk)["board_flags"] == 0
    assert max(speeds) > 0.02 * rated and speeds[-1] < max(speeds) and loop.golden.samples > 380


@pytest.mark.study
def test_start_from_standstill_in_verilator(figure):
    """To 600 rpm and back to -600 rpm; the snapshot read over the bus is what the sample brought."""
    skip_without_ghdl5()
    loop = start_from_standstill()
    core = VerilatedCore(loop.generics(), top="fluxproof_board")
    core.set_many(CONSTANT)
    core.reset()
    core.tick(2)
    fastest, codes = 0.0, {}
    for chunk in loop.run(2000):
        if chunk.number == SNAP_AT:
            codes = {x: int(current_code(loop.codes, n, loop.plant.i_abc[n], 0)) for n, x in enumerate("abc")}
        problem = first_difference(core.play(chunk.inputs, SEEN), chunk.seen, SEEN, chunk.number)
        assert problem is None, problem
        fastest = max(fastest, chunk.omega_m * 60 / (2 * np.pi))
        # Without a dead time its setting is refused, which is a cause of interrupt until it is cleared.
        if chunk.number > loop.settled + 1:
            assert chunk.seen[:, SEEN.index("irq")].max() == 0
    seen = status(chunk)
    assert fastest == pytest.approx(RPM, rel=0.1) and chunk.omega_m < -0.9 * RPM * 2 * np.pi / 60
    assert seen["lost_counts"] == seen["illegal_count"] == 0 and seen["snap_ready"] == 1
    assert seen["board_flags"] == 1 << NAMES.index("no_index"), "told before the index, nothing else"
    for name in ("snap_ready", "snap_code", "snap_count", "snap_flags", "snap_adc_a", "snap_adc_u_dc"):
        assert read_register(core, name) == seen[name], name
    assert all(abs(seen[f"snap_adc_{x}"] - code) < 300 for x, code in codes.items())
    figure("closed loop in Verilator, start from standstill, 2,000 periods", 0, 0, "differences", True)


def read_register(core: VerilatedCore, name: str) -> int:
    """A word over AXI4-Lite."""
    core.set_many({"s_axi_araddr": ADDRESSES[name], "s_axi_arvalid": 1})
    for _ in range(200):
        core.settle()
        ready, valid = core.get("s_axi_arready"), core.get("s_axi_rvalid")
        word = core.get("s_axi_rdata")
        assert not valid or core.get("s_axi_rresp") == 0
        core.tick()
        if ready:
            core.set("s_axi_arvalid", 0)
        if valid:
            return word
    raise TimeoutError(name)


def test_the_run_is_told_by_a_wrong_pin():
    """A difference at one pin at one clock is found and named."""
    seen = np.zeros((5, len(SEEN)), np.int64)
    wrong = seen.copy()
    wrong[3, 1] = 1
    assert first_difference(seen, seen.copy(), SEEN, 7) is None
    assert first_difference(wrong, seen, SEEN, 7) == "period 7, clock 3: gate_low is 1 instead of 0"
