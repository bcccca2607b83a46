"""A motor on fluxproof_board, period by period: the golden board, an A/B/Z encoder and SPI converters, the plant.

The encoder and converter models are those of encoder_models and converter_models.  What they answer depends on the
golden board's pins; a device that gets the same inputs and gives the same outputs at every clock is therefore in the
same loop.
The shaft moves on within a period with the speed of its start.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from random import Random

import numpy as np

from cocotb_tests.support.converter_models import SpiConverter
from cocotb_tests.support.encoder_models import Incremental
from fluxproof.cosim.board_clock import BUS, PINS, SEEN, STATUS, BoardClock, GoldenBlocks
from fluxproof.cosim.closed_loop import build_plant
from fluxproof.golden_model.drive import Drive, with_carrier
from fluxproof.golden_model.encoders import edge_timer, turn_counter
from fluxproof.golden_model.generated.register_names import ADDRESSES
from fluxproof.golden_model.io.sample_checks import JUMP
from fluxproof.golden_model.registers import registers
from fluxproof.plant import sensor_params
from fluxproof.plant.sensors import current_code, u_dc_code

COUNTS = 4000
SLOT = 120  # clocks between two writes: more than a sample takes
LINES = 4
AXI = ("s_axi_awaddr", "s_axi_wdata", "s_axi_awvalid", "s_axi_wvalid")
CONSTANT = {"s_axi_wstrb": 15, "s_axi_bready": 1, "s_axi_rready": 1, "m_axis_tready": 1}
CHIP = (16, 16, 0, 1, "cs", False, False, "fall")  # bits, word, skip, words, start, signed, first with CS, launch
SPI = {"clock_ratio": 4, "spi_bits": 16, "spi_delay": 3, "clock_idle": 1, "busy_timeout": 60}
SPI |= {f"channel_{x}": k for k, x in enumerate(("a", "b", "c", "u_dc"))}


@dataclass
class Chunk:
    """Clocks of inputs by the names of the pins, what the golden board shows (columns SEEN, STATUS), and the motor."""

    inputs: dict[str, np.ndarray]
    seen: np.ndarray
    status: np.ndarray
    omega_m: float
    number: int


class BoardLoop:
    """``writes``: {period: {register: value}} after the settings, which take the first periods (``settled``)."""

    def __init__(self, drive: Drive, writes: dict, carrier_half: int = 250, seed: int = 1, theta_m: float = 0.0):
        self.drive = with_carrier(drive, carrier_half)
        self.clock_hz = round(self.drive.core.clock_hz)
        self.registers = registers(self.drive)
        self.blocks = GoldenBlocks(self.registers.config)
        self.golden = BoardClock(self.blocks, self.clock_hz)
        self.plant, sensors = build_plant(self.drive)
        self.codes = sensor_params(sensors)
        self.rng, self.numpy_rng = Random(seed), np.random.default_rng(seed)
        self.encoder, self.start_angle = Incremental(COUNTS), theta_m
        self.chips = [SpiConverter(*CHIP) for _ in range(LINES)]
        self.length = 2 * carrier_half
        self.queue = list(self.settings().items())
        self.per_period = self.length // SLOT
        self.settled = -(-len(self.queue) // self.per_period) + 1
        self.writes = writes
        self.frame = None  # (convst, cs_n, sclk) of a period, row by row

    def settings(self) -> dict[str, int]:
        """Every register but those that are zero after reset."""
        position = turn_counter.setting(COUNTS, self.registers.config.position_bits)
        omega_base = self.drive.bases.omega_me_rad_s
        position["k_edge"] = edge_timer.setting(COUNTS, self.drive.machine.pole_pairs, self.clock_hz, omega_base)
        position |= {"filter_clocks": 2, "correct_max": 8}
        values = self.registers.values._asdict() | {"speed_given": 1, "jump_max": JUMP.to_int(2e-3)}
        return {name: value for name, value in (values | position | SPI).items() if value}

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
        plant, omega_m = self.plant, float(self.plant.omega_m)
        begin = self.golden.clock
        angle = self.start_angle + plant.theta_m + omega_m * np.arange(length) / self.clock_hz
        inputs = self.encoder.pins(angle * COUNTS / (2 * np.pi), self.numpy_rng)
        inputs |= {name: np.zeros(length, np.int64) for name in AXI}
        for n, (name, value) in enumerate(batch.items()):
            at = n * SLOT
            self.golden.write(name, value, begin + at)
            inputs["s_axi_awvalid"][at : at + 2] = inputs["s_axi_wvalid"][at : at + 2] = 1
            inputs["s_axi_awaddr"][at : at + 2] = ADDRESSES[name]
            inputs["s_axi_wdata"][at : at + 2] = value & 0xFFFFFFFF
        before, chips = self._kept(), self.chips
        for _ in range(2):  # the frame does not depend on what the converters say: once more if it was another one
            inputs["miso"] = self._miso(length)
            pins = np.stack([inputs.get(n, np.zeros(length, np.int64)) for n in PINS], axis=1)
            seen, status = self.golden.advance(pins)
            frame = seen[:, [SEEN.index(n) for n in ("convst", "cs_n", "sclk")]]
            if self.frame is not None and np.array_equal(frame, self.frame[:length]):
                break
            self.frame = np.resize(frame, (max(length, self.length), 3))
            self.chips = [SpiConverter(*CHIP) for _ in chips]
            self._restore(before)
        else:
            inputs["miso"] = self._miso(length)
            pins[:, PINS.index("miso")] = inputs["miso"]
            seen, status = self.golden.advance(pins)
        words = seen[:, SEEN.index("gate_high")] + 8 * seen[:, SEEN.index("gate_low")]
        at = np.flatnonzero(np.diff(words, prepend=-1))
        plant.advance(at / self.clock_hz, words[at], self.drive.inverter.dc_bus_v, 0.0, length / self.clock_hz)
        return Chunk(inputs, seen, status, omega_m, number)

    def _miso(self, length: int) -> np.ndarray:
        """The four lines during the frame of the period; the converters hold what flows at the trigger."""
        lines = np.zeros(length, np.int64)
        if self.frame is None or self.frame[:, 1].all():
            return lines
        level = [int(current_code(self.codes, n, self.plant.i_abc[n], 0)) for n in range(3)]
        level.append(int(u_dc_code(self.codes, self.drive.inverter.dc_bus_v, 0)))
        last = int(np.flatnonzero(self.frame[:, 1] == 0)[-1]) + 3
        for line, chip in enumerate(self.chips):
            chip.level = (level[line],)
            for k, (convst, cs_n, sclk) in enumerate(self.frame[: min(last, length - 1)].tolist()):
                bit, _ = chip.clock(self.rng, convst, cs_n, sclk)
                lines[k + 1] |= bit << line
        return lines

    def _kept(self):
        g = self.golden
        lists = (list(g._due), list(g._writes), list(g._taken), dict(g.registers.values))
        return (g.state, g.of_samples, g.inputs, g.clock, g.observed, g.samples, *lists)

    def _restore(self, kept) -> None:
        g = self.golden
        (g.state, g.of_samples, g.inputs, g.clock, g.observed, g.samples, due, writes, taken, values) = kept
        g._due, g._writes, g._taken, g.registers.values = list(due), list(writes), list(taken), dict(values)


__all__ = ["BUS", "CONSTANT", "STATUS", "BoardLoop", "Chunk"]
