# SPDX-License-Identifier: BSD-3-Clause
"""A motor on fluxproof_board, period by period: the golden board, what is wired to its pins, the plant.

What encoder and converters answer depends on the golden board's pins; a device that gets the same inputs and gives the
same outputs at every clock is therefore in the same loop.  A period is repeated until outputs and pins agree: what
a pin shows at a clock follows from outputs before it, so each repetition makes more clocks right.
The shaft moves on within a period with the speed of its start.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from cocotb_tests.support.board.pins_model import Motor, Pins
from fluxproof.cosim.board_clock import BUS, PINS, SEEN, STATUS, BoardClock, GoldenBlocks
from fluxproof.cosim.driven_plant import build_plant
from fluxproof.plant import sensor_params
from golden_model.board_registers import board_generics, board_registers
from golden_model.drive import Drive, with_carrier
from golden_model.front_ends import Converters, Encoder
from golden_model.generated.register_names import ADDRESSES
from golden_model.registers import registers

COUNTS = 4000
SLOT = 70  # clocks between two writes: a setting waits for the end of a sample
AXI = ("s_axi_awaddr", "s_axi_wdata", "s_axi_awvalid", "s_axi_wvalid")
CONSTANT = {"s_axi_wstrb": 15, "s_axi_bready": 1, "s_axi_rready": 1, "m_axis_tready": 1}
ANSWERED = ("serial_clock", "serial_out", "serial_drive", "convst", "cs_n", "sclk", "den", "daddr", "mod_clock")
GATES = ("gate_high", "gate_low")
REPEATED, PIECES = 12, 40  # attempts at a period; parts of it at which currents are told
IDLE = {"serial_clock": 1, "cs_n": 1}


def with_abz_and_spi(drive: Drive, carrier_half: int, counts: int = COUNTS) -> Drive:
    """The drive with a slower clock, an A/B/Z encoder, believed at its first index, and SPI converters at a quarter of
    that clock."""
    slow = with_carrier(drive, carrier_half)
    clock = slow.core.clock_hz
    converters = Converters("spi", clock_hz=clock / 4, round_trip_s=3.0 / clock)
    return replace(
        slow, encoder=Encoder("abz", counts=counts, filter_s=2.0 / clock, index_passes=1), converters=converters
    )


@dataclass
class Chunk:
    """Clocks of inputs by the names of the pins, what the golden board shows (columns SEEN, STATUS), and the motor."""

    inputs: dict[str, np.ndarray]
    seen: np.ndarray
    status: np.ndarray
    omega_m: float
    number: int


class BoardLoop:
    """``writes``: {period: {register: value}} after the settings, which take the first periods (``settled``).

    ``theta_m``: what the encoder shows of the shaft's place at the start [mechanical rad]; ``omega_m``: speed [rad/s].
    """

    def __init__(self, drive: Drive, writes: dict, seed: int = 1, theta_m: float = 0.0, omega_m: float = 0.0):
        self.drive, self.start_angle, self.writes = drive, theta_m, writes
        self.clock_hz = round(drive.core.clock_hz)
        self.registers = registers(drive)
        self.blocks = GoldenBlocks(
            self.registers.config, trip_filter=drive.core.trip_filter_clocks, **board_generics(drive)
        )
        self.golden = BoardClock(self.blocks, self.clock_hz)
        self.plant, sensors = build_plant(drive, omega_m=omega_m)
        self.codes = sensor_params(sensors)
        self.pins = Pins(drive, self.codes, seed)
        self.length = 2 * self.registers.config.carrier_half
        self.queue = [(name, value) for name, value in board_registers(drive).items() if value]
        self.per_period = self.length // SLOT
        self.settled = -(-len(self.queue) // self.per_period) + 1
        self.before: np.ndarray | None = None  # SEEN of the period before
        self.trips: dict[int, slice] = {}  # period -> clocks at which the trip pin is 1
        self.spoil: Callable[[int, dict], None] = lambda number, inputs: None  # changes the pins of a period in place

    def generics(self) -> dict[str, int]:
        """Of the VHDL."""
        return self.blocks.generics(self.clock_hz)

    def run(self, periods: int) -> Iterator[Chunk]:
        """From the first clock without reset: up to the first trigger, then period by period."""
        first = BoardClock(self.blocks, self.clock_hz).advance(np.zeros((4 * self.length, len(PINS)), np.int64))[0]
        lead = int(np.flatnonzero(first[:, SEEN.index("sample_trigger")])[0]) + 1
        yield self._chunk(lead, -1, {})
        for k in range(periods):
            batch = dict(self.queue[: self.per_period])
            self.queue = self.queue[self.per_period :]
            yield self._chunk(self.length, k, batch or self.writes.get(k, {}))

    def _chunk(self, length: int, number: int, batch: dict[str, int]) -> Chunk:
        bus = self._written(length, batch)
        omega_m, before = float(self.plant.omega_m), self._kept()
        angle = self.start_angle + self.plant.theta_m + omega_m * np.arange(length) / self.clock_hz
        watched = [SEEN.index(n) for n in (*ANSWERED, *(GATES if self.pins.waveform else ()))]
        guess = self._first_guess(length)
        for _ in range(REPEATED):
            motor, pins = Motor(angle, self.plant.i_abc), copy.deepcopy(self.pins)
            if self.pins.waveform:
                motor.waveform = self._driven(copy.deepcopy(self.plant), guess, PIECES)
            inputs = pins.drive({n: guess[:, SEEN.index(n)] for n in ANSWERED}, motor)
            inputs["trip"] = np.zeros(length, np.int64)
            inputs["trip"][self.trips.get(number, slice(0))] = 1
            self.spoil(number, inputs)
            rows = np.stack([inputs.get(n, np.zeros(length, np.int64)) for n in PINS], axis=1)
            self._restore(before)
            seen, status = self.golden.advance(rows)
            agree, guess = np.array_equal(seen[:, watched], guess[:, watched]), seen
            if agree:
                break
        else:
            raise RuntimeError(f"period {number}: pins and outputs do not agree after {REPEATED} repetitions")
        if pins.violated:
            raise AssertionError(f"period {number}: {pins.violated}")
        self.pins, self.before = pins, seen
        self._driven(self.plant, seen, PIECES if self.pins.waveform else 1)
        return Chunk(inputs | bus, seen, status, omega_m, number)

    def _written(self, length: int, batch: dict[str, int]) -> dict[str, np.ndarray]:
        """The bus during a period; the golden board gets the same writes."""
        bus, begin = {name: np.zeros(length, np.int64) for name in AXI}, self.golden.clock
        for n, (name, value) in enumerate(batch.items()):
            at = n * SLOT
            self.golden.write(name, value, begin + at)
            bus["s_axi_awvalid"][at : at + 2] = bus["s_axi_wvalid"][at : at + 2] = 1
            bus["s_axi_awaddr"][at : at + 2] = ADDRESSES[name]
            bus["s_axi_wdata"][at : at + 2] = value & 0xFFFFFFFF
        return bus

    def _first_guess(self, length: int) -> np.ndarray:
        """The outputs of the period before, or those of a board at rest."""
        if self.before is not None and len(self.before) >= length:
            return self.before[:length]
        guess = np.zeros((length, len(SEEN)), np.int64)
        for name, level in IDLE.items():
            guess[:, SEEN.index(name)] = level
        return guess

    def _driven(self, plant, seen: np.ndarray, pieces: int) -> np.ndarray:
        """``plant`` moves on by the gates of ``seen``: its currents at each clock, straight between the pieces."""
        length = len(seen)
        words = seen[:, SEEN.index("gate_high")] + 8 * seen[:, SEEN.index("gate_low")]
        ends = np.linspace(0, length, pieces + 1).astype(int)
        currents = [np.array(plant.i_abc)]
        for begin, end in pairwise(ends):
            part = words[begin:end]
            at = np.flatnonzero(np.diff(part, prepend=-1))
            seconds = (end - begin) / self.clock_hz
            plant.advance(at / self.clock_hz, part[at], self.drive.inverter.dc_bus_v, 0.0, seconds)
            currents.append(np.array(plant.i_abc))
        return np.stack([np.interp(np.arange(length), ends, column) for column in np.array(currents).T], axis=1)

    def _kept(self):
        g = self.golden
        lists = (list(g._due), list(g._writes), list(g._taken), dict(g.registers.values))
        return (g.state, g.of_samples, g.inputs, g.clock, g.observed, g.samples, *lists)

    def _restore(self, kept) -> None:
        g = self.golden
        (g.state, g.of_samples, g.inputs, g.clock, g.observed, g.samples, due, writes, taken, values) = kept
        g._due, g._writes, g._taken, g.registers.values = list(due), list(writes), list(taken), dict(values)


__all__ = ["BUS", "CONSTANT", "STATUS", "BoardLoop", "Chunk", "with_abz_and_spi"]
