# SPDX-License-Identifier: BSD-3-Clause
"""Cores for studies/faults/bench.py: the converted RTL in Verilator, and the golden core itself.

Both record their inputs: ``writes`` contains the inputs that change before each clock, so that the VHDL in GHDL can
get the same.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fluxproof.cosim.golden_clock import SEEN, GoldenClock
from golden_model.fluxproof import Observed


class Noted:
    """Records the inputs clock by clock; base of both cores' ``advance``."""

    def __init__(self, register_set):
        self.writes: list[dict[str, int]] = []
        self._next: dict[str, int] = {}
        self.change(register_set.values._asdict())

    def change(self, values: Mapping[str, int]) -> None:
        """Set registers from the next clock on."""
        self._next |= values
        self._set(values)

    def advance(self, clocks: int, sample: Mapping[str, int] | None = None, **pins: int) -> np.ndarray:
        """(clocks, len(SEEN)); the sample comes with the first clock, and its codes stay on the pins."""
        first = pins if sample is None else {**pins, **sample, "sample_valid": 1}
        self.writes += [self._next | first, *({} for _ in range(clocks - 1))]
        self._next = {} if sample is None else {"sample_valid": 0}
        if sample is not None and clocks > 1:
            self.writes[1 - clocks], self._next = self._next, {}
        return self._run(clocks, sample, pins)


class VerilatedClock(Noted):
    """The converted RTL after its reset, its registers set."""

    def __init__(self, register_set):
        from fluxproof.cosim.verilated import (
            VerilatedCore,
        )  # needs GHDL 5 and a compiler, which not every machine has

        config = register_set.config
        self.core = VerilatedCore({name.upper(): value for name, value in config._asdict().items()})
        self.core.reset()
        super().__init__(register_set)

    def _set(self, values):
        self.core.set_many(values)

    def _run(self, clocks, sample, pins):
        self.core.set_many(pins)
        if sample is None:
            return self.core.trace(clocks, SEEN)
        self.core.set_many({**sample, "sample_valid": 1})
        first = self.core.trace(1, SEEN)
        self.core.set("sample_valid", 0)
        return np.concatenate([first, self.core.trace(clocks - 1, SEEN)])

    def values(self) -> tuple[int, ...]:
        """Observed of the last sample."""
        return tuple(self.core.get_many(Observed._fields).values())


class GoldenCore(Noted):
    """The golden core in place of the RTL, with recorded inputs and outputs, without a simulator."""

    def __init__(self, register_set):
        self.core = GoldenClock(register_set.values, register_set.config)
        super().__init__(register_set)

    def _set(self, values):
        self.core.registers = self.core.registers._replace(**values)

    def _run(self, clocks, sample, pins):
        return self.core.advance(clocks, sample, **pins)

    def values(self) -> tuple[int, ...]:
        """Observed of the last sample."""
        return tuple(self.core.observed)
