# SPDX-License-Identifier: BSD-3-Clause
"""The golden core clock by clock: raw samples may enter at any clock, the port values are returned after every clock.

fluxproof.step calculates the values of a sample at once; the clocked part (golden_model/clocked.py) gets them after
the declared latencies.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from golden_model import clocked, fluxproof
from golden_model.control.reference_table import BLANK
from golden_model.kernel import kernel

SEEN = clocked.Seen._fields
COLUMN = {name: k for k, name in enumerate(clocked.Inputs._fields)}
Due = tuple[int, Mapping[str, int]]  # values of a sample and the clock from which on they are valid


def rows_of(inputs: clocked.Inputs, due: Iterable[Due], clock: int, count: int) -> np.ndarray:
    """The inputs of ``count`` clocks from ``clock`` on, one row each, with what is due in them; see inputs_of."""
    rows = np.empty((count, len(COLUMN)), np.int64)
    rows[:] = inputs
    for at, values in due:
        for name, value in values.items():
            rows[max(at - clock, 0) :, COLUMN[name]] = value
    return rows


@kernel
def inputs_of(x):
    """A row of rows_of by names."""
    # Unpacked, because a star compiles only for a tuple; int for the same types where it runs as plain Python.
    return clocked.Inputs(
        int(x[0]), int(x[1]), int(x[2]), int(x[3]), int(x[4]), int(x[5]), int(x[6]), int(x[7]),
        int(x[8]), int(x[9]), int(x[10]), int(x[11]), int(x[12]), int(x[13]), int(x[14]), int(x[15]),
    )  # fmt: skip


assert len(COLUMN) == 16  # a field with a default that inputs_of does not give would always be 0


def arrive(inputs: clocked.Inputs, due: list[Due], clock: int) -> tuple[clocked.Inputs, list[Due]]:
    """(the inputs with what is due by ``clock``, what is due later)."""
    for at, values in due:
        if at <= clock:
            inputs = inputs._replace(**values)
    return inputs, [(at, values) for at, values in due if at > clock]


@kernel
def run_clocks(state, inputs, regs, carrier_half, until_trigger, seen):
    """A clock for each row of ``inputs`` and ``seen``: (state, clocks made, whether the last took a sample)."""
    entered = 0
    for k in range(seen.shape[0]):
        state, entered, now = clocked.step(state, inputs_of(inputs[k]), regs, carrier_half)
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
        self._due: list[Due] = []

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
            strobe = sample is not None and left == clocks
            length = 1 if strobe else left
            seen = np.zeros((length, len(SEEN)), np.int64)
            self.state, made, entered = run_clocks(
                self.state,
                rows_of(self.inputs._replace(sample_valid=int(strobe)), self._due, self.clock, length),
                self.registers,
                self.config.carrier_half,
                until_trigger,
                seen,
            )
            if entered and sample is not None:
                self._enter(sample)
            self.clock += made
            self.inputs, self._due = arrive(self.inputs, self._due, self.clock)
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
