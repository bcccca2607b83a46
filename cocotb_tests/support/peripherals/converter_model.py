# SPDX-License-Identifier: BSD-3-Clause
"""Converters as their data sheets describe them, not derived from the RTL: SPI converters, the XADC, a modulator.

Time counts clocks of the core.  ``clock(...)`` takes the pins as the FPGA's registers left them after clock t and
returns what the FPGA's pins show at clock t + 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

import numba
import numpy as np


@dataclass
class SpiConverter:
    """One SPI converter with ``words`` channels on its line.

    ``start``: "convst" holds the input at the rising edge of CONVST and is busy for ``convert`` clocks, beginning
    ``to_busy`` clocks after the edge; "cs" holds it at the falling edge of CS.  Each bit is shown with the edge
    ``launch`` of SCLK ("rise" or "fall"), with ``first_with_cs`` the first bit already with CS.  A bit is on the
    line ``valid`` clocks later; the one before stays for ``hold`` clocks, between the two the line is random, and so
    it is without CS.
    """

    bits: int
    word_bits: int
    skip: int
    words: int
    start: str
    signed: bool
    first_with_cs: bool
    launch: str
    valid: int = 3
    hold: int = 1
    convert: int = 20
    to_busy: int = 5
    stuck: bool = False  # BUSY stays high
    level: tuple = ()  # present analogue inputs, as codes of an offset binary converter
    held: tuple = ()  # at the last sampling instant
    time: int = 0
    started: int = -(10**6)
    was: tuple = (0, 1, 0)
    queue: list = field(default_factory=list)  # bits still to be shown
    shown: int = 0
    before: int = 0
    moved: int = -(10**6)

    def word(self, code: int) -> list[int]:
        """The bits of one channel, most significant first, with leading and trailing zeros."""
        raw = code ^ (1 << (self.bits - 1)) if self.signed else code
        after = self.word_bits - self.skip - self.bits
        return [0] * self.skip + [raw >> k & 1 for k in reversed(range(self.bits))] + [0] * after

    def clock(self, rng: Random, convst: int, cs_n: int, sclk: int) -> tuple[int, int]:
        """(line, BUSY) at the next clock."""
        was_convst, was_cs_n, was_sclk = self.was
        self.was = (convst, cs_n, sclk)
        if (self.start == "convst" and convst and not was_convst) or (self.start == "cs" and was_cs_n and not cs_n):
            self.held, self.started = self.level, self.time
        if was_cs_n and not cs_n:
            self.queue = [b for code in self.held for b in self.word(code)]
            if self.first_with_cs:
                self._show()
        elif not cs_n and sclk != was_sclk and sclk == (self.launch == "rise"):
            self._show()
        self.time += 1
        age = self.time - self.moved
        line = self.before if age <= self.hold else self.shown if age >= self.valid else rng.getrandbits(1)
        if cs_n:
            line = rng.getrandbits(1)
        since = self.time - self.started
        converting = self.start == "convst" and self.to_busy <= since < self.to_busy + self.convert
        return line, int(converting or self.stuck)

    def _show(self):
        self.before, self.shown = self.shown, self.queue.pop(0) if self.queue else 0
        self.moved = self.time


@dataclass
class Xadc:
    """The XADC in event mode with a sequence of channel pairs that are sampled simultaneously (UG480).

    A rising edge of CONVST holds the pair; BUSY is high from ``to_busy`` for ``convert`` clocks, then EOC for one
    clock, and the status registers of the pair hold the codes, left-aligned with ``noise`` in the unused bits.  The
    DRP answers ``wait`` clocks after DEN.  ``mute``: "eoc" or "drdy" never comes.
    """

    pairs: tuple[tuple[int, int], ...]  # DRP addresses
    convert: int = 52
    to_busy: int = 2
    mute: str = ""
    level: dict = field(default_factory=dict)  # {address: code of 12 bits}
    registers: dict = field(default_factory=dict)
    held: dict = field(default_factory=dict)
    time: int = 0
    started: int | None = None
    turn: int = 0
    was_convst: int = 0
    answer: tuple | None = None  # (clock, word)

    def clock(self, rng: Random, convst: int, den: int, daddr: int) -> dict[str, int]:
        """The inputs of the reader at the next clock."""
        if convst and not self.was_convst:
            assert self.started is None, "CONVST rises during a conversion"
            self.started = self.time
            self.held = {address: self.level[address] for address in self.pairs[self.turn]}
        self.was_convst = convst
        if den:
            assert self.answer is None, "DEN before DRDY"
            self.answer = (self.time + rng.randint(2, 8), self.registers.get(daddr, 0))
        self.time += 1
        pins = {"busy": 0, "eoc": 0, "drdy": 0, "drp_do": rng.getrandbits(16)}
        if self.started is not None and self.time - self.started >= self.to_busy:
            pins["busy"] = 1
            if self.time - self.started == self.to_busy + self.convert:
                pins |= {"busy": 0, "eoc": int(self.mute != "eoc")}
                self.registers |= {a: code << 4 | rng.getrandbits(4) for a, code in self.held.items()}
                self.turn = (self.turn + 1) % len(self.pairs)
                self.started = None
        if self.answer and self.answer[0] == self.time:
            pins |= {"drdy": int(self.mute != "drdy"), "drp_do": self.answer[1]}
            self.answer = None
        return pins


@numba.njit
def modulate(u: np.ndarray) -> np.ndarray:
    """Bits of an ideal second-order modulator, v = u + (1 - z**-1)**2 e: 1 for v = +1, 0 for v = -1; u from -1 to 1."""
    bits = np.empty(u.size, np.int64)
    e_1 = e_2 = 0.0
    for n in range(u.size):
        wanted = u[n] - 2.0 * e_1 + e_2
        v = 1.0 if wanted >= 0.0 else -1.0
        e_2, e_1 = e_1, v - wanted
        bits[n] = 1 if v > 0.0 else 0
    return bits
