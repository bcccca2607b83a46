# SPDX-License-Identifier: BSD-3-Clause
"""Faults of a board at its pins, without a motor: each front end's fault, what is ignored, the lost host, the trip pin.

The pins follow a script, so that every wire from a fault to the gates is used once: a fault that is not ignored turns
the gates off, an ignored one does not, and the wrong one in its place does the opposite.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.board_clock import PINS, STATUS, BoardClock, GoldenBlocks
from golden_model.board_registers import board_generics, board_registers
from golden_model.drive import Drive, load, with_carrier
from golden_model.fluxproof import REGISTERS
from golden_model.formats import PU
from golden_model.front_ends import Converters, Encoder
from golden_model.generated.register_names import ADDRESSES
from golden_model.io.fault_latch import NAMES
from golden_model.io.register_map import Kind
from golden_model.registers import registers

SLOT = 70  # clocks between two accesses: a setting waits for the end of a sample
WRITE = ("s_axi_awaddr", "s_axi_wdata", "s_axi_awvalid", "s_axi_wvalid")
READ = ("s_axi_araddr", "s_axi_arvalid")
WATCHED = ("fault_flags", "first_fault", "board_flags", "board_first", "irq_cause")
INDEX, LOST, OVER = 1, 2, 4  # bits of board_ignore
CURRENT = PU.to_int(0.05)  # the voltage that a regulator without a motor asks for grows, and the duties with it
HEARTBEAT = 3  # periods
FILTERED = 3  # clocks: a pulse of so many at the pin trip has no effect where it is filtered


def serial_and_modulators() -> Drive:
    """An SSI encoder that never answers, and delta-sigma modulators, the trip pin filtered; 480 clocks a period."""
    drive = with_carrier(load(DRIVES / "spindle_400v.toml"), 240)
    clock = drive.core.clock_hz
    return replace(
        drive,
        encoder=Encoder("ssi", bits=8, clock_hz=clock / 8, crc=False),
        converters=Converters("delta_sigma", clock_hz=clock / 4, oversampling=32, round_trip_s=2.0 / clock),
        core=replace(drive.core, estimators=False, trip_filter_s=FILTERED / clock),
    )


def edges() -> Drive:
    """An A/B/Z encoder of 16 counts, codes from elsewhere; 160 clocks a period."""
    drive = with_carrier(load(DRIVES / "spindle_400v.toml"), 80)
    return replace(
        drive,
        encoder=Encoder("abz", counts=16, filter_s=0.0),
        converters=Converters(),
        core=replace(drive.core, estimators=False),
    )


@dataclass
class Chunk:
    """A period: inputs by the names of the pins, what the golden board shows (columns SEEN, STATUS); no motor turns.

    ``reads``: clock at which a read is on the bus, its word, for registers that do not change in the period.
    """

    inputs: dict[str, np.ndarray]
    seen: np.ndarray
    status: np.ndarray
    omega_m: float
    number: int
    reads: list[tuple[int, int]]


class FaultRun:
    """As a BoardLoop runs: ``script`` is {period after the settings: {register: value}}, ``pins`` make the pins."""

    def __init__(self, drive: Drive, script: dict[int, dict[str, int]], pins):
        self.drive, self.script, self.pins = drive, script, pins
        self.clock_hz = round(drive.core.clock_hz)
        config = registers(drive).config
        self.blocks = GoldenBlocks(config, trip_filter=drive.core.trip_filter_clocks, **board_generics(drive))
        self.golden = BoardClock(self.blocks, self.clock_hz)
        self.length = 2 * config.carrier_half
        ignored = REGISTERS["fault_ignore"].high & ~(1 << NAMES.index("trip") | 1 << NAMES.index("host_lost"))
        values = board_registers(drive) | {"fault_ignore": ignored, "board_ignore": LOST, "irq_mask": 0}
        self.queue = [(name, value) for name, value in values.items() if value]
        self.per_period = self.length // SLOT
        self.readable = list(self.golden.registers.map)  # read after the script, in this order
        self.shown: dict[str, int] = {}
        self.settled = -(-len(self.queue) // self.per_period)

    @property
    def periods(self) -> int:
        """Settings and script."""
        return self.settled + max(self.script) + 2

    @property
    def with_reads(self) -> int:
        """The same, then every register read once."""
        return self.periods + -(-len(self.readable) // self.per_period)

    def generics(self) -> dict[str, int]:
        """Of the VHDL."""
        return self.blocks.generics(self.clock_hz)

    def run(self, periods: int) -> Iterator[Chunk]:
        """Period by period, from the first clock without reset."""
        for k in range(periods):
            batch = dict(self.queue[k * self.per_period : (k + 1) * self.per_period])
            batch = batch or self.script.get(k - self.settled, {})
            bus = {name: np.zeros(self.length, np.int64) for name in (*WRITE, *READ)}
            begin, before = self.golden.clock, self._words()
            for n, (name, value) in enumerate(batch.items()):
                at = n * SLOT
                self.golden.write(name, value, begin + at)
                bus["s_axi_awvalid"][at : at + 2] = bus["s_axi_wvalid"][at : at + 2] = 1
                bus["s_axi_awaddr"][at : at + 2] = ADDRESSES[name]
                bus["s_axi_wdata"][at : at + 2] = value & 0xFFFFFFFF
            inputs = {name: np.zeros(self.length, np.int64) for name in PINS}
            self.pins(inputs, np.arange(begin, begin + self.length), k - self.settled)
            rows = np.stack([inputs[name] for name in PINS], axis=1)
            names = self._read_in(k, batch)
            for n, name in enumerate(names):
                at = n * SLOT
                bus["s_axi_arvalid"][at : at + 2] = 1
                bus["s_axi_araddr"][at : at + 2] = ADDRESSES[name]
            seen, status = self.golden.advance(rows)
            self.shown = dict(zip(STATUS, status[-1].tolist(), strict=True))
            after = self._words()
            reads = [
                (n * SLOT, after[name])
                for n, name in enumerate(names)
                if name in after and after[name] == before.get(name)
            ]
            yield Chunk(inputs | bus, seen, status, 0.0, k, reads)

    def _read_in(self, k: int, batch: dict[str, int]) -> list[str]:
        """Registers read in period ``k``: those of faults while the script is silent, after it each one once."""
        if k >= self.periods:
            return self.readable[(k - self.periods) * self.per_period :][: self.per_period]
        turn = k * self.per_period % len(WATCHED)
        return [] if batch or k < self.settled else [*WATCHED, *WATCHED][turn : turn + self.per_period]

    def _words(self) -> dict[str, int]:
        """What a read of each register would answer now, of those that the golden board knows."""
        file, latch = self.golden.registers, self.golden.state.of_core.of_fault_latch
        known = self.shown | {"fault_flags": latch.flags, "first_fault": latch.first}
        known["irq_cause"] = self.golden.state.of_interrupts.causes
        if self.golden.observed is not None:
            known |= self.golden.observed._asdict()
        file.status |= known
        return {
            name: file.read(register.address)[1]
            for name, register in file.map.items()
            if register.kind in (Kind.SETTING, Kind.COMMAND) or all(field.name in known for field in register.fields)
        }


STARTED = {0: {"irq_clear": 15, "clear_trip": 1}, 1: {"enable": 1}, 2: {"i_q_ext": CURRENT}}


def cleared(at: int, **more: int) -> dict[int, dict[str, int]]:
    """The board's fault goes with the first write, the core's, which the board kept up until then, with the second."""
    return {at: {"clear_trip": 1, **more}, at + 1: {"clear_trip": 1, "irq_clear": 15}}


def host_and_pin(first: int) -> dict[int, dict[str, int]]:
    """The host is silent for longer than the heartbeat and comes back; then the trip pin, and each cause of irq."""
    back = first + HEARTBEAT + 3
    return {
        first: {"heartbeat": HEARTBEAT},
        **cleared(back),
        **{back + k: {"i_q_ext": CURRENT + k} for k in (2, 4, 6)},
        back + 7: {"heartbeat": 0},
        **{back + 10 + k: {"irq_mask": mask} for k, mask in enumerate((14, 13, 11, 7, 15, 0))},
        back + 17: {"clear_trip": 1, "irq_clear": 15},
        back + 19: {"take_snapshot": 1},
    }


def serial_run() -> FaultRun:
    """position_lost is there all the time, a modulator's overcurrent comes and goes; limits are met by both signs."""
    script = {
        **STARTED,
        **cleared(6),
        8: {"board_ignore": LOST | OVER},
        11: {"board_ignore": LOST | INDEX},
        **cleared(12),
        **cleared(15),
        17: {"board_ignore": OVER | INDEX},
        **cleared(18, board_ignore=LOST),
        **host_and_pin(20),
        **cleared(50),
    }
    high, low = {4: 0, 9: 1, 14: 2}, {48: 1}  # period: phase whose stream is at its end

    def pins(inputs: dict[str, np.ndarray], clocks: np.ndarray, k: int) -> None:
        bits = np.tile((clocks // 4 % 2)[:, None], 4)  # half of the bits: no current, half of the bus range
        for phases, level in ((high, 1), (low, 0)):
            if k in phases:
                bits[100:300, phases[k]] = level
        inputs["mod_data"][:] = bits @ (1 << np.arange(4))
        at = 20 + HEARTBEAT + 9
        inputs["trip"][200 : 200 + FILTERED] = at <= k < at + 2
        inputs["trip"][220 : 221 + FILTERED] = k == at + 2

    return FaultRun(serial_and_modulators(), script, pins)


def edges_run() -> FaultRun:
    """The shaft turns by a count in 16 clocks; Z is at one place for the first index, at another for the next."""
    script = {
        **STARTED,
        3: {"board_ignore": LOST | OVER},
        10: {"clear_encoder": 1},
        **cleared(11),
        14: {"board_ignore": INDEX},
        **host_and_pin(20),
    }

    def pins(inputs: dict[str, np.ndarray], clocks: np.ndarray, k: int) -> None:
        count = clocks // 16
        inputs["pin_a"][:] = (count % 4 == 1) | (count % 4 == 2)
        inputs["pin_b"][:] = (count % 4 == 2) | (count % 4 == 3)
        place = 8 if 6 <= k < 9 or k >= 16 else 0
        inputs["pin_z"][:] = count % 16 == place
        at = 5 + np.arange(len(clocks) // 160) * 160
        inputs["codes_valid_in"][at] = 1
        for name in ("code_a_in", "code_b_in", "code_c_in"):
            inputs[name][:] = 1 << 15
        inputs["code_u_dc_in"][:] = 46000 if k in (29, 30) else 1 << 15  # 702 V: the brake resistor is on
        inputs["trip"][70:71] = k == 20 + HEARTBEAT + 11

    return FaultRun(edges(), script, pins)
