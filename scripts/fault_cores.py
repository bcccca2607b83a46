"""The converted RTL in Verilator as a core of scripts/fault_bench.py, and what it was told, for a replay in GHDL."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from golden_model.fluxproof import Observed
from scripts.golden_clock import SEEN
from scripts.verilated import VerilatedCore


class VerilatedClock:
    """One core after its reset, its registers set; ``writes`` holds the inputs that changed before each clock."""

    def __init__(self, register_set):
        config = register_set.config
        self.core = VerilatedCore({name.upper(): value for name, value in config._asdict().items()})
        self.core.reset()
        self.writes: list[dict[str, int]] = []
        self._next: dict[str, int] = {}
        self.change(register_set.values._asdict())

    def change(self, values: Mapping[str, int]) -> None:
        """Set inputs from the next clock on."""
        self.core.set_many(values)
        self._next |= values

    def advance(self, clocks: int, sample: Mapping[str, int] | None = None, **pins: int) -> np.ndarray:
        """(clocks, len(SEEN)); the sample comes with the first clock, and its codes stay on the pins."""
        self.change(pins)
        if sample is None:
            rows = self._trace(clocks)
        else:
            self.change({**sample, "sample_valid": 1})
            rows = self._trace(1)
            self.change({"sample_valid": 0})
            rows = np.concatenate([rows, self._trace(clocks - 1)])
        return rows

    def _trace(self, clocks: int) -> np.ndarray:
        if clocks:
            self.writes += [self._next, *({} for _ in range(clocks - 1))]
            self._next = {}
        return self.core.trace(clocks, SEEN)

    def values(self) -> tuple[int, ...]:
        """Observed of the last sample."""
        return tuple(self.core.get_many(Observed._fields).values())
