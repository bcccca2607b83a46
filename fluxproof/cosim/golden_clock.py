# SPDX-License-Identifier: BSD-3-Clause
"""The golden core clock by clock: raw samples may enter at any clock, the port values are returned after every clock.

fluxproof.step calculates the values of a sample at once; the clocked part (golden_model/clocked.py) gets them after
the declared latencies.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from golden_model import clocked, fluxproof
from golden_model.control.reference_table import BLANK
from golden_model.kernel import kernel

SEEN = clocked.Seen._fields


@kernel
def run_clocks(state, inputs, regs, carrier_half, until_trigger, seen):
    """Clocks with the same inputs, one row of ``seen`` each: (state, clocks made, whether the last took a sample)."""
    entered = 0
    for k in range(seen.shape[0]):
        state, entered, now = clocked.step(state, inputs, regs, carrier_half)
        row = seen[k]  # unpacked, because a loop compiles to a hundred times as much code
        row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9] = now
        if until_trigger and now.sample_trigger:
            return state, k + 1, entered
    return state, seen.shape[0], entered


class GoldenClock:
    """One golden core after its reset; ``registers`` may be replaced at any clock.  ``table``: as RegisterSet."""

    def __init__(self, registers: fluxproof.Registers, config: fluxproof.Config, table: np.ndarray = BLANK):
        self.registers, self.config, self.table = registers, config, table
        self.state, self.of_samples = clocked.State(), fluxproof.State()
        self.inputs = clocked.Inputs()
        self.clock = 0
        self.running = 0
        self.samples: list[fluxproof.Sample] = []  # accepted samples
        self.observed: fluxproof.Observed | None = None  # values of the last accepted sample
        self._due: list[tuple[int, dict[str, int]]] = []

    def advance(
        self, clocks: int, sample: Mapping[str, int] | None = None, until_trigger: bool = False, **pins: int
    ) -> np.ndarray:
        """(clocks made, len(SEEN)) integers; fewer than ``clocks`` if ``until_trigger`` found sample_trigger.

        ``sample``: the raw sample's ports, applied with sample_valid at the first clock.  ``pins``: enable, trip,
        clear_trip, host_write from now on.
        """
        self.inputs = self.inputs._replace(**pins)
        rows, left = [], clocks
        while left:
            for at, values in self._due:
                if at == self.clock:
                    self.inputs = self.inputs._replace(**values)
            self._due = [due for due in self._due if due[0] > self.clock]
            strobe = sample is not None and left == clocks
            length = 1 if strobe else min([left, *(at - self.clock for at, _ in self._due)])
            seen = np.zeros((length, len(SEEN)), np.int64)
            self.state, made, entered = run_clocks(
                self.state,
                self.inputs._replace(sample_valid=int(strobe)),
                self.registers,
                self.config.carrier_half,
                until_trigger,
                seen,
            )
            if entered and sample is not None:
                self._enter(sample)
            self.clock += made
            left -= made
            self.running = int(seen[made - 1, SEEN.index("running")])
            rows.append(seen[:made])
            if until_trigger and seen[made - 1, SEEN.index("sample_trigger")]:
                break
        return np.concatenate(rows)

    def _enter(self, sample: Mapping[str, int]) -> None:
        """The results of a sample that enters at this clock, and their clocks."""
        self.samples.append(fluxproof.Sample(*sample.values(), run=self.running))
        # The duties use what is in force: a minimum pulse that the gates refuse is not, nor double_update given while
        # they are on.
        gates = self.state.of_gate_generation
        registers = self.registers._replace(min_pulse=gates.min_pulse, double_update=gates.double_update)
        given = fluxproof.given_by_registers(registers)
        self.of_samples, observed = fluxproof.step_table(
            self.of_samples, self.samples[-1], registers, self.config, given, self.table
        )
        self.observed = observed
        for after, names in clocked.DUE.values():
            self._due.append((self.clock + after, {name: getattr(observed, name) for name in names}))
