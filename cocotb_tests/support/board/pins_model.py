# SPDX-License-Identifier: BSD-3-Clause
"""What is wired to the pins of a board: a model of the encoder and of the converters that a drive file names.

The models are those of cocotb_tests/support/peripherals, not derived from the RTL.  ``drive(...)``
gives the levels of a period's clocks; what the board's outputs are at a clock shows at the pins from the next clock
on.  All of it can be copied, because a period is repeated until outputs and pins agree.
"""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

import numba
import numpy as np

from cocotb_tests.support.peripherals import absolute_model as models
from cocotb_tests.support.peripherals.converter_model import SpiConverter, Xadc
from cocotb_tests.support.peripherals.incremental_model import Incremental
from fluxproof.plant.sensors import current_code, u_dc_code
from golden_model.board_registers import PAIRS, spi_bits, spi_lines

CALCULATION, MONOFLOP = 4, 3  # periods of the serial clock: EnDat's time to the start bit; until SSI lets go
XADC_S = 1.0e-6  # a conversion


@dataclass
class Motor:
    """The shaft at each clock [mechanical rad], the currents at the trigger [A], and at each clock where asked for."""

    angle: np.ndarray
    i_abc: np.ndarray
    waveform: np.ndarray | None = None  # shape (clocks, 3)


class Edges:
    """A, B and Z."""

    def __init__(self, drive, seed: int):
        self.counts, self.encoder = drive.encoder.counts, Incremental(drive.encoder.counts)
        self.rng = np.random.default_rng(seed)

    def drive(self, _outputs, motor: Motor) -> dict[str, np.ndarray]:
        return self.encoder.pins(motor.angle * self.counts / (2 * np.pi), self.rng)


class Halls:
    """Three sensors a third of an electrical turn apart, each 1 for half a turn, a from the d axis on."""

    def __init__(self, drive, _seed: int):
        self.pairs = drive.machine.pole_pairs

    def drive(self, _outputs, motor: Motor) -> dict[str, np.ndarray]:
        turns = motor.angle * self.pairs / (2 * np.pi)
        return {f"hall_{x}": ((turns - k / 3) % 1.0 < 0.5).astype(np.int64) for k, x in enumerate("abc")}


@numba.njit(cache=True)
def ssi_line(memory, clock, level, frame, timeout):
    line = np.empty(len(clock), np.int64)
    for k in range(len(clock)):
        line[k] = level
        level = models.ssi(memory, clock[k], frame, len(frame), 0, timeout)
    return line, level


@numba.njit(cache=True)
def biss_line(memory, clock, level, frame, timeout):
    line = np.empty(len(clock), np.int64)
    for k in range(len(clock)):
        line[k] = level
        level = models.biss(memory, clock[k], frame, len(frame), CALCULATION, timeout)
    return line, level


@numba.njit(cache=True)
def endat_line(memory, clock, out, drives, level, frame, timeout, mode):
    """The line of both ends; a line that nobody drives reads 1."""
    line = np.empty(len(clock), np.int64)
    for k in range(len(clock)):
        line[k] = level
        sent, sends = models.endat(memory, clock[k], out[k], frame, len(frame), CALCULATION, timeout, mode)
        level = out[k] if drives[k] else sent if sends else 1
    return line, level


class Serial:
    """SSI, BiSS-C or EnDat 2.2: the place at the first falling edge of the clock, one frame a period."""

    def __init__(self, drive, _seed: int):
        self.e, self.memory, self.level = drive.encoder, np.zeros(models.MEMORY, np.int64), 1
        self.timeout = round(MONOFLOP * drive.core.clock_hz / drive.encoder.clock_hz)
        models.reset(self.memory)

    def frame(self, angle: float) -> np.ndarray:
        e, turns = self.e, angle / (2 * np.pi)
        value = int(np.floor(turns * 2**e.bits)) % 2 ** (e.bits + e.turns_bits)
        word = models.bits_of(value, e.bits + e.turns_bits)
        if e.kind == "ssi":
            return np.array(models.ssi_word(word, e.gray, e.crc is not False))
        return np.array(models.biss_frame(word) if e.kind == "biss" else models.endat_frame(word, [0, 1]))

    def drive(self, outputs: dict[str, np.ndarray], motor: Motor) -> dict[str, np.ndarray]:
        clock = outputs["serial_clock"]
        low = np.flatnonzero(clock == 0)
        frame = self.frame(float(motor.angle[low[0] if len(low) else 0]))
        if self.e.kind == "endat":
            out, drives = outputs["serial_out"], outputs["serial_drive"]
            line, self.level = endat_line(self.memory, clock, out, drives, self.level, frame, self.timeout, 0b111000)
        else:
            told = ssi_line if self.e.kind == "ssi" else biss_line
            line, self.level = told(self.memory, clock, self.level, frame, self.timeout)
        return {"serial_data": line}


class Channels:
    """The codes of the sensors, by the names of what they measure."""

    def __init__(self, drive, sensors):
        self.sensors, self.volts = sensors, drive.inverter.dc_bus_v
        self.names = [*("bc" if drive.current_sensors == 2 else "abc"), "u_dc"]

    def codes(self, i_abc) -> list[int]:
        """In the order of the converters' inputs."""
        told = {x: int(current_code(self.sensors, k, i_abc[k], 0)) for k, x in enumerate("abc")}
        told["u_dc"] = int(u_dc_code(self.sensors, self.volts, 0))
        return [told[name] for name in self.names]


class Spi:
    """A converter a line that holds and shows its first bit with chip select, each further one at a falling edge."""

    def __init__(self, drive, sensors, seed: int):
        c, late = drive.converters, max(round(drive.converters.round_trip_s * drive.core.clock_hz), 1)
        if c.conversion_s is not None or c.two_words or c.mode not in (None, 2):
            raise ValueError("the model of a board has converters that chip select starts, one word a line, mode 2")
        bits = drive.sensors.adc_bits
        made = (bits, spi_bits(drive), c.skip_bits, 1, "cs", c.signed_codes, True, "fall", late, min(late, 1))
        self.chips, self.rng = [SpiConverter(*made) for _ in range(spi_lines(drive))], Random(seed)
        self.channels = Channels(drive, sensors)

    def drive(self, outputs: dict[str, np.ndarray], motor: Motor) -> dict[str, np.ndarray]:
        lines = np.zeros(len(motor.angle), np.int64)
        selected = np.flatnonzero(outputs["cs_n"] == 0)
        if len(selected) == 0:
            return {"miso": lines}
        last = min(int(selected[-1]) + 3, len(lines) - 1)
        frame = zip(*(outputs[n][:last].tolist() for n in ("convst", "cs_n", "sclk")), strict=True)
        for chip, code in zip(self.chips, self.channels.codes(motor.i_abc), strict=True):
            chip.level = (code,)
        for k, pins in enumerate(frame):
            for line, chip in enumerate(self.chips):
                lines[k + 1] |= chip.clock(self.rng, *pins)[0] << line
        return {"miso": lines}


class XadcPins:
    """Pairs of auxiliary inputs, as board_registers puts the channels on them; the fourth holds a temperature."""

    def __init__(self, drive, sensors, seed: int):
        self.xadc = Xadc(PAIRS, convert=round(XADC_S * drive.core.clock_hz))
        self.rng, self.channels = Random(seed), Channels(drive, sensors)
        self.now = {"busy": 0, "eoc": 0, "drdy": 0, "drp_do": 0}
        self.violated = ""  # a rule of the data sheet, in outputs that may not be the last repetition's

    def drive(self, outputs: dict[str, np.ndarray], motor: Motor) -> dict[str, np.ndarray]:
        addresses = [address for pair in PAIRS for address in pair]
        codes = [*self.channels.codes(motor.i_abc), 0x9A0][:4]
        self.xadc.level = dict(zip(addresses, codes, strict=True))
        rows = []
        for pins in zip(*(outputs[n].tolist() for n in ("convst", "den", "daddr")), strict=True):
            rows.append(tuple(self.now.values()))
            try:
                self.now = self.xadc.clock(self.rng, *pins) if not self.violated else self.now
            except AssertionError as error:
                self.violated = str(error)
        return dict(zip(self.now, np.array(rows, np.int64).T, strict=True))


@numba.njit(cache=True)
def modulated(clock, levels, state, late):
    """Bits of ideal second-order modulators, as in converter_model.modulate; a new one ``late`` clocks after a rise.

    levels (clocks, 4) from -1 to 1; state (4, 3): two errors and the bit, then the clock's level and the age in row 4.
    """
    line = np.empty(len(clock), np.int64)
    for k in range(len(clock)):
        if state[4, 1] == late:
            for n in range(4):
                wanted = levels[k, n] - 2.0 * state[n, 0] + state[n, 1]
                v = 1.0 if wanted >= 0.0 else -1.0
                state[n, 1], state[n, 0], state[n, 2] = state[n, 0], v - wanted, v
        state[4, 1] += 1.0
        word = 0
        for n in range(4):
            word |= (1 if state[n, 2] > 0.0 else 0) << n
        line[k] = word
        if clock[k] == 1 and state[4, 0] == 0.0:
            state[4, 1] = 1.0
        state[4, 0] = clock[k]
    return line


class Modulators:
    """Four delta-sigma modulators on one clock: a, b, c and the bus."""

    def __init__(self, drive, _sensors, _seed: int):
        s, self.volts = drive.sensors, drive.inverter.dc_bus_v
        self.amperes, self.full_v = s.current_range_a, s.u_dc_range_v
        self.late = max(round(drive.converters.round_trip_s * drive.core.clock_hz), 1)
        self.state = np.zeros((5, 3))

    def drive(self, outputs: dict[str, np.ndarray], motor: Motor) -> dict[str, np.ndarray]:
        levels = np.empty((len(motor.angle), 4))
        levels[:, :3] = (motor.i_abc if motor.waveform is None else motor.waveform) / self.amperes
        levels[:, 3] = 2.0 * self.volts / self.full_v - 1.0
        return {"mod_data": modulated(outputs["mod_clock"], levels, self.state, self.late)}


ENCODERS = {"abz": Edges, "hall": Halls, "ssi": Serial, "biss": Serial, "endat": Serial}
CONVERTERS = {"spi": Spi, "xadc": XadcPins, "delta_sigma": Modulators}


class Pins:
    """Encoder and converters of a drive."""

    def __init__(self, drive, sensors, seed: int):
        self.encoder = ENCODERS[drive.encoder.kind](drive, seed)
        self.converters = CONVERTERS[drive.converters.kind](drive, sensors, seed)
        self.waveform = drive.converters.kind == "delta_sigma"

    @property
    def violated(self) -> str:
        """The rule of a data sheet that the outputs break, or nothing."""
        return getattr(self.converters, "violated", "")

    def drive(self, outputs: dict[str, np.ndarray], motor: Motor) -> dict[str, np.ndarray]:
        """Levels of a period by the names of the pins, for the board's outputs at the same clocks."""
        return self.encoder.drive(outputs, motor) | self.converters.drive(outputs, motor)
