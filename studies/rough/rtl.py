# SPDX-License-Identifier: BSD-3-Clause
"""The RTL of both tops beside a situation, converted and run by Verilator: every pin at every clock as the golden one.

fluxproof_board gets the situation's pins and writes.  fluxproof_axi, which has no front ends, gets the samples that
these made, the same writes and the trip pin, beside a golden fluxproof_axi of its own (fluxproof/cosim/axi_clock.py).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fluxproof.cosim import axi_clock
from fluxproof.cosim.axi_clock import AxiClock, Write, bus_of
from fluxproof.cosim.board_clock import SEEN, BoardClock
from fluxproof.cosim.verilated import VerilatedCore

CONSTANT = {"s_axi_wstrb": 15, "s_axi_bready": 1, "s_axi_rready": 1, "m_axis_tready": 1}


def started(generics: dict[str, int], top: str) -> VerilatedCore:
    """The converted top behind its reset."""
    core = VerilatedCore(generics, top=top)
    core.set_many(CONSTANT)
    core.reset()
    core.tick(2)
    return core


class Beside:
    """Both tops from their reset on; ``first``: where one of them first differed, ``clocks``: how many."""

    def __init__(self, golden: BoardClock):
        self.golden, self.clocks, self.first = golden, 0, ""
        blocks, clock_hz = golden.blocks, golden.clock_hz
        self.board = started(blocks.generics(clock_hz), "fluxproof_board")
        self.golden_axi = AxiClock(blocks, clock_hz)
        self.axi = started(self.golden_axi.generics(), "fluxproof_axi")

    def period(self, pins: dict[str, np.ndarray], writes: Sequence[Write], seen: np.ndarray) -> None:
        """Clocks that the golden board has just made: what it got, and ``seen``, its rows of SEEN."""
        got = self.board.play(pins | bus_of(writes, len(seen)), SEEN)
        self._compare("fluxproof_board", got, seen, SEEN)
        given, wanted = self.golden_axi.beside(self.golden, writes, pins["trip"])
        names = axi_clock.SEEN
        self._compare("fluxproof_axi", self.axi.play(given, names), wanted, names)
        self.clocks += len(seen)

    def _compare(self, top: str, got: np.ndarray, wanted: np.ndarray, names: tuple[str, ...]) -> None:
        if not self.first and (got != wanted).any():
            k, n = np.argwhere(got != wanted)[0]
            self.first = f"{top}, clock {self.clocks + k}: {names[n]} is {got[k, n]} instead of {wanted[k, n]}"
