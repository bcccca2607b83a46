# SPDX-License-Identifier: BSD-3-Clause
"""The RTL, converted to Verilog and compiled, as a device of the closed loop (cosim/closed_loop.py).

Fast enough for the full ratio of 200 MHz to 10 kHz, 20,000 clocks a period: what works on samples stands between them
(sleeping.py), which a build with its witness shows to change no register.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fluxproof.cosim.closed_loop import FLAGS, SAMPLE_DELAY, Period
from fluxproof.cosim.sleeping import with_sleep
from fluxproof.cosim.verilated import VerilatedCore
from golden_model.fluxproof import Config, Observed


class VerilatedDevice:
    """One core; an edge on the clock that ends a period belongs to the next one."""

    def __init__(self, config: Config):
        generics = {name.upper(): value for name, value in config._asdict().items()}
        self.core = VerilatedCore(generics, rewrite=with_sleep)
        self.limit = 4 * config.carrier_half
        self.carried: list[tuple[int, int]] = []

    async def start(self, registers, enable: int, words: Sequence[int] = ()) -> Period:
        for word in words:  # of the torque table, which a reset does not change
            self.core.set("table_word", word)
            self.core.tick()
        self.core.reset()
        self.core.set_many({**registers._asdict(), "enable": enable})
        return self._finish(*self.core.run_period(self.limit), None, 0, 0)

    async def period(self, inputs: dict[str, int], enable: int) -> Period:
        self.core.set("enable", enable)
        at = SAMPLE_DELAY + 1
        ended = self.core.run_period(self.limit, sample=inputs, sample_at=at)
        # A tick's outputs are seen by the next one: hence one clock more than the ticks between.
        core = self.core
        return self._finish(*ended, core.get_many(Observed._fields), core.duty_at - at + 1, core.running_at)

    def change(self, registers) -> None:
        self.core.set_many(registers)

    def _finish(self, clocks, edge_clocks, words, observed, duty_clocks, running) -> Period:
        edges = self.carried + [(int(c), int(w)) for c, w in zip(edge_clocks, words, strict=True)]
        self.carried = [(0, w) for c, w in edges if c == clocks]
        edges = [(c, w) for c, w in edges if c != clocks]
        columns = np.array(edges, np.int64).reshape(-1, 2).T
        flags = tuple(self.core.get_many(FLAGS).values())
        return Period(observed, columns[0], columns[1], clocks, duty_clocks, running, flags)
