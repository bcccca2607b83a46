# SPDX-License-Identifier: BSD-3-Clause
"""The golden model over recorded samples, compared with ``==``, compiled: a million samples take about a second."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from golden_model import fluxproof
from golden_model.control.reference_table import BLANK
from golden_model.kernel import kernel

FIELDS = fluxproof.Observed._fields


@kernel
def given_of(registers, given, k):
    """What the speed of row ``k`` came from; ``given`` (n, 3) as fluxproof.Given, or of no row: the registers."""
    if k < len(given):
        return fluxproof.Given(given[k, 0], given[k, 1], given[k, 2], registers.emf_samples, registers.gear_code)
    return fluxproof.given_by_registers(registers)


@kernel
def run_until_different(state, samples, given, registers, config, table, recorded, column, start, stop, wrong):
    """Replay rows start..stop-1: (row of the first difference or stop, state before that row).

    samples (n, 13), recorded (n, m) int64; column (m,) int64: index in ``recorded`` of each of Observed, -1 if it
    was not recorded.  wrong (m,) int64 receives 1 for the values that differ in that row.
    """
    for k in range(start, stop):
        x = samples[k]
        sample = fluxproof.Sample(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12])
        of_speed = given_of(registers, given, k)
        following, out = fluxproof.step_table(state, sample, registers, config, of_speed, table)
        different = False
        for n, value in enumerate(out):
            if column[n] >= 0 and recorded[k, column[n]] != value:
                wrong[column[n]] = 1
                different = True
        if different:
            return k, state
        state = following
    return stop, state


@kernel
def count_differences(state, samples, given, registers, config, table, recorded, column, start, stop, last):
    """Replay rows start..stop-1 and count the values that differ; ``last`` (1,) receives the last such row."""
    count = 0
    for k in range(start, stop):
        x = samples[k]
        sample = fluxproof.Sample(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12])
        of_speed = given_of(registers, given, k)
        state, out = fluxproof.step_table(state, sample, registers, config, of_speed, table)
        for n, value in enumerate(out):
            if column[n] >= 0 and recorded[k, column[n]] != value:
                count += 1
                last[0] = k
    return count


class Run(NamedTuple):
    """Data of a recording for a replay.  ``patch``: (row, column, value), one raw value to replace."""

    samples: np.ndarray  # (n, 13) int64
    recorded: np.ndarray  # (n, m) int64
    names: tuple  # of the m recorded signals
    column: np.ndarray  # int64, one of Observed each
    registers: fluxproof.Registers
    config: fluxproof.Config
    given: np.ndarray  # (n, 3) int64, fluxproof.Given of each row where it was recorded, else (0, 3)
    patch: tuple | None = None
    table: np.ndarray = BLANK  # words of the torque table
    changes: tuple[tuple[int, dict[str, int]], ...] = ()  # (row, registers from there on), rows rising

    def until_different(self, state, start, stop):
        """(row of the first difference or ``stop``, state before it, names that differ there)."""
        wrong = np.zeros(len(self.names), np.int64)
        row = start
        for begin, end, registers in self._stretches(start, stop):
            row, state = self._run(run_until_different, state, registers, self.column, begin, end, wrong)
            if row < end:
                break
        return int(row), plain_state(state), [n for n, bad in zip(self.names, wrong, strict=True) if bad]

    def differences(self, state, start, stop):
        """(number of values that differ in start..stop-1, last row with a difference or -1)."""
        last, count = np.full(1, -1, np.int64), 0
        for begin, end, registers in self._stretches(start, stop):
            found = self._run(count_differences, state, registers, self.column, begin, end, last)
            count += int(found)
            if end < stop:
                state = self.state_at(state, begin, end)
        return count, int(last[0])

    def state_at(self, state, start, row) -> fluxproof.State:
        """The golden state before ``row`` of a run that starts with ``state`` before ``start``."""
        blind, wrong = np.full(len(FIELDS), -1, np.int64), np.zeros(len(self.names), np.int64)
        for begin, end, registers in self._stretches(start, row):
            _, state = self._run(run_until_different, state, registers, blind, begin, end, wrong)
        return plain_state(state)

    def registers_at(self, row) -> fluxproof.Registers:
        """The registers in force in a row."""
        return self.registers._replace(**{k: v for at, new in self.changes if at <= row for k, v in new.items()})

    def _stretches(self, start, stop):
        """(first row, end, registers in force) of the rows start..stop-1."""
        ends = [row for row, _ in self.changes if start < row < stop]
        for begin, end in zip([start, *ends], [*ends, stop], strict=True):
            yield begin, end, self.registers_at(begin)

    def _run(self, function, state, registers, column, start, stop, out):
        """Call a kernel with the patch in place."""
        if self.patch is None:
            return function(
                state, self.samples, self.given, registers, self.config, self.table, self.recorded, column, start,
                stop, out,
            )  # fmt: skip
        row, field, value = self.patch
        kept, self.samples[row, field] = self.samples[row, field], value
        try:
            return self._replace(patch=None)._run(function, state, registers, column, start, stop, out)
        finally:
            self.samples[row, field] = kept

    def of_speed(self, row) -> fluxproof.Given:
        """What the speed of one row came from."""
        return fluxproof.Given(*map(int, given_of.py_func(self.registers_at(row), self.given, row)))

    def sample(self, row) -> fluxproof.Sample:
        """One row as the core's input."""
        values = list(map(int, self.samples[row]))
        if self.patch is not None and self.patch[0] == row:
            values[self.patch[1]] = self.patch[2]
        return fluxproof.Sample(*values)


def run_of(samples, observed: dict, registers: dict, config: dict, table=None, changes=()) -> Run:
    """A Run from a dump's ``meta``; ``observed`` {name: (n,)} may contain any of the core's signals.

    ``table``: words of the torque table; ``changes``: [(row, {register: integer})], rows rising.
    """
    names = tuple(name for name in FIELDS if name in observed)
    column = np.array([names.index(name) if name in names else -1 for name in FIELDS], np.int64)
    recorded = np.ascontiguousarray(np.stack([observed[name] for name in names], axis=1), np.int64)
    values = fluxproof.Registers(**{name: int(registers[name]) for name in fluxproof.Registers._fields})
    defaults = fluxproof.Config._field_defaults  # a dump of an older core does not know every generic
    generics = fluxproof.Config(**{name: int(config.get(name, value)) for name, value in defaults.items()})
    given = _given(observed, values)
    words = BLANK if table is None else table
    rows = np.array(samples, np.int64, order="C")
    return Run(rows, recorded, names, column, values, generics, given, None, words, tuple(changes))


def _given(observed: dict, values: fluxproof.Registers) -> np.ndarray:
    """fluxproof.Given of each row: where the speed was given it is the recorded one; (0, 3) where not recorded."""
    if not {"speed_was_given", "position_restarted", "omega_me"} <= set(observed):
        return np.zeros((0, 3), np.int64)
    given = np.array(observed["speed_was_given"], np.int64)
    omega = np.where(given == 1, observed["omega_me"], values.omega_given)
    return np.ascontiguousarray(np.stack([given, omega, observed["position_restarted"]], axis=1), np.int64)


def plain_state(state) -> fluxproof.State:
    """The state with Python integers, so that every call has the same types and is compiled once."""
    return fluxproof.State._make(map(_plain_part, state))


def _plain_part(part):
    kind: Any = type(part)
    return kind(*map(int, part)) if isinstance(part, tuple) else int(part)
