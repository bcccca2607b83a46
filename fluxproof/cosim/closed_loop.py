# SPDX-License-Identifier: BSD-3-Clause
"""Closed loop: gate edges switch the plant, the plant's sensors feed the core, the golden model runs in parallel.

The device under test runs one PWM period at a time (see Device): the VHDL in GHDL, its Verilog
conversion in Verilator, or the golden model itself.  All see the same codes; every observed value and every gate
edge is compared with ``==``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from fluxproof.cosim.driven_plant import PLANT_SIGNALS, PlantPeriods, Scenario
from fluxproof.cosim.golden_clock import SEEN, GoldenClock
from fluxproof.plant import (
    FREE,
    Machine,
    Sensors,
    centred_gates,
    half_gates,
)
from golden_model import fluxproof
from golden_model.torque_table import table_words

SAMPLE_DELAY = 4  # clocks from sample_trigger to sample_valid: the conversion time of an ADC, shortened


@dataclass
class Period:
    """The outputs of a device from one sample_trigger to the next: a PWM period, half of one with double_update."""

    observed: dict[str, int | str] | None  # None if no sample was processed; text where a simulator has no 0 or 1
    edge_clocks: np.ndarray
    gate_words: np.ndarray
    clocks: int
    sample_to_duty: int
    running: int | str  # when the sample was taken
    flags: tuple[int | str, ...] = ()  # FLAGS at the end


class Device(Protocol):
    """Runs one period: takes the sample SAMPLE_DELAY clocks after sample_trigger."""

    async def start(self, registers, enable: int, words: Sequence[int] = ()) -> Period:
        """Load the torque table with these values of table_word, reset, set the registers, run to a sample_trigger."""
        ...

    async def period(self, inputs: dict[str, int], enable: int) -> Period:
        """From this sample_trigger to the next; ``inputs`` are the raw sample's ports."""
        ...

    def change(self, registers: Mapping[str, int]) -> None:
        """Set registers, now, between two periods."""
        ...


def gate_words(seen: np.ndarray) -> np.ndarray:
    """Six bits, upper gates first, after every clock of GoldenClock.advance."""
    return seen[:, SEEN.index("gate_high")] + 8 * seen[:, SEEN.index("gate_low")]


FLAGS = ("fault_flags", "first_fault", "early_samples")


class GoldenPeriods:
    """The golden core as a period machine; an edge on the last clock belongs to the next period."""

    def __init__(self, register_set):
        self.core = GoldenClock(register_set.values, register_set.config, register_set.table)
        self.word, self.carried = 0, None

    def run(self, inputs: dict[str, int] | None, enable: int) -> Period:
        """Run from this sample_trigger to the next, with a sample or None."""
        core, limit, seen, running = self.core, 4 * self.core.config.carrier_half, [], 0
        if inputs is not None:
            seen = [core.advance(SAMPLE_DELAY, enable=enable)]
            running = core.running
        seen.append(core.advance(limit, inputs, until_trigger=True, enable=enable))
        seen = np.concatenate(seen)
        words = gate_words(seen)
        clocks = np.flatnonzero(np.diff(words, prepend=self.word))
        edges = [(int(c) + 1, int(words[c])) for c in clocks]
        self.word, length = int(words[-1]), len(seen)
        if self.carried is not None:
            edges.insert(0, (0, self.carried))
        self.carried = edges.pop()[1] if edges and edges[-1][0] == length else None
        columns = np.array(edges, np.int64).reshape(-1, 2).T
        flags = tuple(int(seen[-1, SEEN.index(name)]) for name in FLAGS)
        return Period(None, columns[0], columns[1], length, 0, running, flags)


@dataclass
class Result:
    """The recorded run: one row per period, integers of the core, plant in SI units."""

    samples: np.ndarray | None = None  # (n, 13) what the core was given, in the order of fluxproof.Sample
    observed: dict[str, np.ndarray] = field(default_factory=dict)
    plant: dict[str, np.ndarray] = field(default_factory=dict)
    periods_compared: int = 0
    differences: int = 0
    first_difference: str | None = None
    sample_to_duty_clocks: int = 0
    # of the device after the start and after every period: FLAGS, and whether it ran when the sample was taken
    flags: list[tuple[int | str, ...]] = field(default_factory=list)
    running: list[int | str] = field(default_factory=list)
    # of the device: rows of (period, clock, gate word)
    gate_edges: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    state: fluxproof.State | None = None  # the golden model's, at the end


def read_out(values: Mapping[str, Any]) -> fluxproof.Observed:
    """A device's values of a sample in the golden model's type."""
    return fluxproof.Observed(**{name: values[name] for name in fluxproof.Observed._fields})


class Comparison:
    """A device and the golden model in parallel: both get the same samples, every period is compared.

    Without a device the golden model runs alone.
    """

    def __init__(self, device: Device | None, register_set):
        self.device, self.config = device, register_set.config
        self.golden, self.result = GoldenPeriods(register_set), Result()
        self.words = table_words(register_set.table) if self.config.references else []
        self.samples: list[tuple[int | str, ...]] = []
        self.observed: list[fluxproof.Observed] = []
        self.edges: list[tuple[int, int, int]] = []

    def differ(self, what: str) -> None:
        """Count a difference and keep the message of the first one."""
        self.result.differences += 1
        self.result.first_difference = self.result.first_difference or f"period {len(self.observed)}: {what}"

    def change(self, registers: Mapping[str, int]) -> None:
        """Set registers of both between two periods."""
        self.golden.core.registers = self.golden.core.registers._replace(**registers)
        if self.device:
            self.device.change(registers)

    async def start(self, enable: int) -> None:
        """Reset and run to the first sample_trigger."""
        got = wanted = self.golden.run(None, enable)
        if self.device:
            got = await self.device.start(self.golden.core.registers, enable, self.words)
        if not np.array_equal(got.gate_words, wanted.gate_words):
            self.differ("gates before the first sample")
        self._note(got)

    def _note(self, got: Period) -> None:
        self.result.flags.append(got.flags)
        self.result.running.append(got.running)

    async def period(self, inputs: dict[str, int], enable: int) -> Period:
        """One period on both; ``inputs`` by the names of INPUT_PORTS, in their order.  Returns the device's."""
        wanted = self.golden.run(inputs, enable)
        got, golden = wanted, self.golden.core.observed
        assert golden is not None  # a sample has entered
        if self.device:
            got = await self.device.period(inputs, enable)
            self.compare(got, golden, wanted)
        self._note(got)
        k = len(self.observed)
        self.edges += [(k, int(c), int(w)) for c, w in zip(got.edge_clocks, got.gate_words, strict=True)]
        self.samples.append((*inputs.values(), got.running))
        self.observed.append(golden if got.observed is None else read_out(got.observed))
        return got

    def compare(self, got: Period, golden: fluxproof.Observed, wanted: Period) -> None:
        """``==`` on every observed value, every gate edge, the period's length and the run state."""
        if got.observed is None:
            self.differ("no sample came out")
            return
        for name, value in zip(fluxproof.Observed._fields, golden, strict=True):
            if got.observed[name] != value:
                self.differ(f"{name}: got {got.observed[name]}, wanted {value}")
        if not _same_edges(got, wanted):
            self.differ(f"gate edges: got {_edges(got)}, wanted {_edges(wanted)}")
        seen, right = ((p.clocks, p.running, *p.flags) for p in (got, wanted))
        if seen != right:
            self.differ(f"clocks, running, {', '.join(FLAGS)}: got {seen}, wanted {right}")
        self.result.sample_to_duty_clocks = max(self.result.sample_to_duty_clocks, got.sample_to_duty)

    def finish(self) -> Result:
        """The recorded run with the device's values, which equal the golden ones if there is no difference."""
        self.result.periods_compared = len(self.observed) if self.device else 0
        self.result.samples = np.array(self.samples, np.int64).reshape(-1, len(fluxproof.Sample._fields))
        self.result.observed = dict(zip(fluxproof.Observed._fields, np.array(self.observed).T, strict=True))
        self.result.gate_edges = np.array(self.edges, np.int64).reshape(-1, 3)
        return self.result


async def cosimulate(
    device: Device | None,
    drive,
    register_set,
    scenario: Scenario,
    progress: Callable[[int, int], None] = lambda done, total: None,
    sensors: Sensors | None = None,
    machine: Machine | None = None,
    ideal_inverter: bool = False,
    mode: int = FREE,
) -> Result:
    """Run ``scenario`` on ``device`` in closed loop and compare with the golden model at every period.

    ``device`` None: the golden model alone.
    ``mode`` IMPOSED_SPEED: the scenario's load is the mechanical speed [rad/s].
    ``ideal_inverter``: the plant follows the compare values in force, as if its inverter had no dead time; the
    gates are still compared edge by edge.
    """
    plant, duties = PlantPeriods(drive, scenario, sensors, machine, mode), np.zeros(3)
    levels, waits = np.zeros(3), np.zeros(3)  # of half_gates
    comparison = Comparison(device, register_set)
    await comparison.start(int(scenario.enable[0]))
    for k in range(len(scenario)):
        if k in scenario.changes:
            comparison.change(scenario.changes[k])
        got = await comparison.period(plant.inputs(k), int(scenario.enable[k]))
        times, words = got.edge_clocks * (plant.period_s / got.clocks), got.gate_words
        if ideal_inverter:
            if register_set.values.double_update:
                times, words = half_gates(duties, 1 - 2 * (k & 1), levels, waits, 0.0, plant.period_s)
            else:
                times, words = centred_gates(duties, 0.0, plant.period_s)
            last = comparison.observed[-1]
            duties = np.array([last.compare_a, last.compare_b, last.compare_c]) / comparison.config.carrier_half
        plant.advance(k, times, words)
        progress(k + 1, len(scenario))
    result = comparison.finish()
    result.plant = dict(zip(PLANT_SIGNALS, np.array(plant.rows).T, strict=True))
    return result


def _same_edges(got: Period, wanted: Period) -> bool:
    return np.array_equal(got.edge_clocks, wanted.edge_clocks) and np.array_equal(got.gate_words, wanted.gate_words)


def _edges(period: Period) -> str:
    return " ".join(f"{c}:{w:06b}" for c, w in zip(period.edge_clocks, period.gate_words, strict=True))


def run_now(coroutine):
    """Run a coroutine that never waits, for devices that are plain function calls."""
    try:
        coroutine.send(None)
    except StopIteration as stop:
        return stop.value
    raise RuntimeError("the coroutine waits for a simulator; run it inside the simulator")
