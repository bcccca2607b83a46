# SPDX-License-Identifier: BSD-3-Clause
"""The ring of telemetry from its registers to a file: by Python, by C, and in the converted top."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess

import numpy as np
import pytest

from cocotb_tests.support.drives import PAPER
from cocotb_tests.support.host.rtl_board import RtlBoard
from cocotb_tests.support.recordings.dumps import recording
from fluxproof import dump_capture
from fluxproof.checkout import ROOT
from fluxproof.command import main
from fluxproof.commission.bus import BusError
from fluxproof.commission.ring import read_ring, ring_state
from fluxproof.cosim.scenarios import everything
from fluxproof.diagnosis.replay import digital
from fluxproof.diagnosis.replay.capture import capture, packets
from golden_model import drive as drives
from golden_model.io import register_map, telemetry_ring, telemetry_words
from golden_model.io.telemetry_words import COUNT
from golden_model.registers import registers

DRIVE = drives.load(PAPER)


@pytest.fixture(scope="module")
def words():
    """(2500, COUNT) uint32: the packets of the scenario in which everything happens."""
    samples, observed, _ = capture(DRIVE, registers(DRIVE), everything(DRIVE))
    return packets(samples, observed)


def raw(rows) -> bytes:
    return np.ascontiguousarray(rows, "<u4").tobytes()


class RingBus:
    """The registers of a core whose ring is the golden twin's, as a bus; rows go in by ``record``."""

    def __init__(self, rows):
        self.rows, self.state, self.out = rows, telemetry_ring.State(), (0,) * 7
        self.inputs = dict.fromkeys(telemetry_ring.Inputs._fields, 0)
        self.clock()

    def clock(self, **values):
        self.state, self.out = telemetry_ring.step(
            self.state, *(self.inputs | values).values(), self.rows, telemetry_words.COUNT
        )

    def record(self, words, **values):
        for row in words.tolist():
            for word in row:
                self.clock(row_valid=1, row_word=word, **values)
            for _ in range(3):
                self.clock(**values)

    def write(self, name, value):
        if name in ("ring_arm", "ring_stop"):
            self.clock(**{name: value})
        else:
            self.inputs[name] = value
        self.clock()

    def read(self, name):
        shown = dict(zip((p.name for p in telemetry_ring.BLOCK.outputs), self.out, strict=True))
        if name != "ring_state":
            return shown[name]
        return sum(shown[n] << bit for n, bit in register_map._RING_STATE.items())


def test_ring_to_dump(words, tmp_path, monkeypatch):
    """A trip leaves the rows before it and those asked for after it: dump --ring writes what a capture gives."""
    bus = RingBus(42)
    with pytest.raises(BusError, match="not armed"):
        read_ring(bus)
    bus.write("ring_faults", 1 << 16)
    bus.write("ring_after", 5)
    bus.write("ring_arm", 1)
    bus.record(words[:900])
    with pytest.raises(BusError, match="still records"):
        read_ring(bus)
    bus.record(words[900:1000], tripped=1)  # the first row that shows it is 900
    assert read_ring(bus) == raw(words[864:906])
    assert ring_state(bus) == {"ring_recording": 0, "ring_ended": 1, "ring_full": 1, "ring_cause": telemetry_ring.TRIP}

    monkeypatch.setattr(dump_capture, "UioBus", lambda path: bus)
    (tmp_path / "capture.bin").write_bytes(raw(words[864:906]))
    for given in (["/dev/uio0", "--ring"], [str(tmp_path / "capture.bin")]):
        command = ["dump", *given, "--drive", str(PAPER), "-o", str(tmp_path / f"{len(given)}.fluxdump")]
        assert main(command) == 0
    assert (tmp_path / "1.fluxdump").read_bytes() == (tmp_path / "2.fluxdump").read_bytes()
    got, notes = digital.replay(recording(tmp_path / "2.fluxdump"))
    assert got.first_difference is None and "42 samples could not be replayed" in notes[0]


class RtlBus:
    """The registers of the converted AXI top by name, and its stream."""

    def __init__(self, drive):
        self.board, self.map, self.stream = RtlBoard(drive), register_map.registers(), []

    def write(self, name, value):
        assert self.board.write(self.map[name].address, value) == register_map.OKAY, name

    def read(self, name):
        response, word = self.board.read(self.map[name].address)
        assert response == register_map.OKAY, name
        return word

    def sample(self, clocks, **codes):
        core = self.board.core
        core.apply_sample(**codes)
        words = core.trace(clocks - 1, ("m_axis_tvalid", "m_axis_tdata"))
        self.stream += words[words[:, 0] == 1, 1].tolist()


@pytest.mark.slow
def test_ring_of_the_top_holds_the_rows_of_its_stream(ghdl5):
    """Through the pins of the converted top: the rows before a trip and those after it, word by word."""
    drive = drives.with_carrier(DRIVE, 100)
    drive = dataclasses.replace(drive, core=dataclasses.replace(drive.core, ring_rows=7))
    bus, rng = RtlBus(drive), np.random.default_rng(52)
    for name, value in (("telemetry_enable", 1), ("ring_faults", 1 << 16), ("ring_after", 2), ("ring_arm", 1)):
        bus.write(name, value)
    for k in range(30):
        bus.board.core.set("trip", int(k == 20))
        bus.sample(200, **{f"adc_{x}": int(rng.integers(0, 65536)) for x in "abc"}, position_code=int(97 * k))
    rows = np.array(bus.stream, np.uint32).reshape(-1, COUNT)
    assert len(rows) == 30 and ring_state(bus)["ring_cause"] == telemetry_ring.TRIP
    held = np.frombuffer(read_ring(bus), "<u4").reshape(-1, COUNT)
    last = int(np.flatnonzero((rows == held[-1]).all(axis=1))[0])
    assert len(held) == 7 and np.array_equal(held, rows[last - 6 : last + 1]) and 20 <= last - 2 <= 21


def test_ring_in_c(words, tmp_path):
    """docs/software/ring.c reads a full ring from its oldest row on, and one that is not full from address 0."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    rows = 7
    held = np.roll(words[:rows], 3, axis=0)  # the oldest row is the fourth
    bus = f"""
#include "fluxproof_bus.h"
#include "fluxproof_registers.h"
#include "ring.h"
#include <stddef.h>
#define AT(name) ((uint32_t)offsetof(fluxproof_t, name))
static const uint32_t ram[] = {{ {", ".join(f"{w}u" for w in held.ravel().tolist())} }};
static uint32_t address, state, armed[3];
bool bus_write(uint32_t offset, uint32_t value)
{{
    if (offset == AT(ring_address)) address = value;
    if (offset == AT(ring_faults)) armed[0] = value;
    if (offset == AT(ring_after)) armed[1] = value;
    if (offset == AT(ring_arm)) armed[2] = value;
    return true;
}}
bool bus_read(uint32_t offset, uint32_t *value)
{{
    *value = offset == AT(ring_depth) ? {rows} : offset == AT(ring_next) ? {3 * COUNT} :
             offset == AT(ring_data) ? ram[address] : state;
    return true;
}}
int main(void)
{{
    if (!ring_start(RING_TRIP, 5) || armed[0] != RING_TRIP || armed[1] != 5 || armed[2] != 1) return 1;
    state = FLUXPROOF__RING_STATE__RING_RECORDING_bm;
    if (ring_save(stdout) != -1) return 2;
    state = FLUXPROOF__RING_STATE__RING_ENDED_bm;
    if (ring_save(stdout) != 3) return 3;
    state |= FLUXPROOF__RING_STATE__RING_FULL_bm;
    return ring_save(stdout) == {rows} ? 0 : 4;
}}
"""
    (tmp_path / "main.c").write_text(bus)
    software = ROOT / "docs" / "software"
    command = ["gcc", "-Wall", "-Wextra", "-Werror", f"-I{software}", "-o", "ring", "main.c", software / "ring.c"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "ring"], capture_output=True, check=True)
    assert done.stdout == raw(held[:3]) + raw(words[:rows])
