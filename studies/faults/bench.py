# SPDX-License-Identifier: BSD-3-Clause
"""Closed loop with faults: core and plant clock by clock, the golden core in parallel, every clock compared.

A case changes codes, bus voltage, strobes, pins or registers of a period.  Both cores get the same inputs; the
plant follows the gates of the device under test.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from fluxproof.checkout import ROOT
from fluxproof.cosim.closed_loop import SAMPLE_DELAY, gate_words
from fluxproof.cosim.driven_plant import INPUT_PORTS, build_plant
from fluxproof.cosim.golden_clock import SEEN, GoldenClock
from fluxproof.cosim.scenarios import RPM
from fluxproof.plant import sensor_params
from fluxproof.plant.sensors import current_code, position_code, u_dc_code
from golden_model import clocked, fluxproof
from golden_model import drive as drives
from golden_model.io.fault_latch import ENCODER, LATE, NAMES
from golden_model.registers import registers
from golden_model.units import from_si

DRIVE = ROOT / "docs" / "drives" / "paper001.toml"
NEAR_RPM = 15.0  # of the reference: speed is reached again
NO_CURRENT_A = 0.05  # all phases below: the current has decayed
CLEAR_AT = 20  # clock of a period with the pulse on clear_trip


class Core(Protocol):
    """Interface of the device under test: that of GoldenClock, without the values of the samples."""

    def advance(self, clocks: int, sample: Mapping[str, int] | None = None, **pins: int) -> np.ndarray:
        """Rows of SEEN, one per clock."""

    def change(self, values: Mapping[str, int]) -> None:
        """Set registers."""

    def values(self) -> tuple[int, ...]:
        """Observed of the last sample."""


@dataclass
class Plan:
    """Inputs of one period, which a case may change; clocks count from sample_trigger."""

    k: int
    u_dc: float  # [V] at the inverter
    codes: dict[str, int] = field(default_factory=dict)  # adc_a .. position_code
    strobes: dict[int, dict[str, int]] = field(default_factory=dict)  # clock -> codes that differ
    pins: dict[int, dict[str, int]] = field(default_factory=dict)  # clock -> enable, trip, clear_trip
    registers: dict[str, int] = field(default_factory=dict)  # from this period on

    def pulse(self, pin: str, at: int) -> None:
        """One clock of 1."""
        self.pins.setdefault(at, {})[pin] = 1
        self.pins.setdefault(at + 1, {})[pin] = 0


@dataclass(frozen=True)
class Case:
    """A fault from period ``start`` to ``stop``; the trip is cleared at ``clears``; ``trips``: expected first fault."""

    name: str
    text: str
    disturb: Callable[[Plan], None] = lambda plan: None
    bus: Callable[[int], float] | None = None  # [V] by period
    trips: str | None = None
    flags: tuple[str, ...] = ()  # flags expected just before the first clear
    start: int = 400
    stop: int = 600
    clears: tuple[int, ...] = (650,)
    periods: int = 1400
    rpm: float = 732.0
    load: float = 1.0  # [Nm]


@dataclass
class Outcome:
    """The recorded response, and the clocks of the first trip."""

    seen: np.ndarray  # (clocks, len(SEEN)) of the device
    decided: int | None  # clock of the first trip's cause
    strobed: int | None  # clock of the sample that tripped
    clocks: int
    samples: int
    differences: int
    first_difference: str | None
    i_abc: np.ndarray  # (periods, 3) [A]
    omega_m: np.ndarray  # (periods,) [rad/s]
    period_clocks: int

    def column(self, name: str) -> np.ndarray:
        """A port after every clock."""
        return self.seen[:, SEEN.index(name)]

    def begin(self, period: int) -> int:
        """The first clock of a period; sample_trigger came with the one before."""
        return 1 + period * self.period_clocks

    @property
    def tripped_at(self) -> int | None:
        """The first clock at which the trip is visible."""
        found = np.flatnonzero(self.column("tripped"))
        return int(found[0]) + 1 if len(found) else None


def named(word: int) -> list[str]:
    """The faults in a word of fault_latch."""
    return [name for bit, name in enumerate(NAMES) if word >> bit & 1]


class Pair:
    """The device and the golden core in step."""

    def __init__(self, core: Core, register_set):
        self.core, self.golden = core, GoldenClock(register_set.values, register_set.config)
        self.rows: list[np.ndarray] = []
        self.entered: list[int] = []  # clocks of the samples
        self.decided: tuple[int, int | None] | None = None  # clock of the first trip's cause, of its sample
        self.samples = self.differences = 0
        self.first_difference: str | None = None

    def advance(self, clocks: int, sample=None, **pins: int) -> np.ndarray:
        """Advance both with the same inputs and compare every clock."""
        golden = self.golden
        begin, count = golden.clock, len(golden.samples)
        wanted = golden.advance(clocks, sample, **pins)
        got = self.core.advance(clocks, sample, **pins)
        for row, name in np.argwhere(wanted != got)[:1]:
            self.differ(begin + row, f"{SEEN[name]}: got {got[row, name]}, wanted {wanted[row, name]}")
        self.rows.append(got)
        self._judge(begin, pins, len(golden.samples) > count)
        return got

    def _judge(self, begin: int, pins: Mapping[str, int], entered: bool) -> None:
        """Record the clock of the first trip's cause: pin, value of a sample, or missing sample."""
        late = self.entered[-1] + self.golden.registers.watchdog if self.entered else None
        if entered:
            self.entered.append(begin)
        if self.decided is not None:
            return
        if pins.get("trip"):
            self.decided = (begin, None)
        elif late is not None and late <= begin and not self.golden.registers.fault_ignore >> LATE & 1:
            self.decided = (late, None)
        elif entered and self.golden.observed.sample_trip:
            self.decided = (begin + clocked.CHECKS_CLOCKS - 1, begin)
        elif entered and self.golden.observed.encoder_lost and not self.golden.registers.fault_ignore >> ENCODER & 1:
            self.decided = (begin + clocked.DUE["emf"][0], begin)

    def compare_values(self) -> None:
        """``==`` on every value of the last sample, once they are valid."""
        if not self.entered or self.golden.clock - self.entered[-1] < clocked.INTERVAL:
            return
        for name, got, wanted in zip(fluxproof.Observed._fields, self.core.values(), self.golden.observed, strict=True):
            if got != wanted:
                self.differ(self.golden.clock, f"{name}: got {got}, wanted {wanted}")
        self.samples += 1

    def differ(self, clock: int, what: str) -> None:
        self.differences += 1
        self.first_difference = self.first_difference or f"clock {clock}: {what}"

    def change(self, values: Mapping[str, int]) -> None:
        """Registers of both, from the next clock on."""
        self.golden.registers = self.golden.registers._replace(**values)
        self.core.change(values)


def setup(carrier_half: int):
    """(drive, register set) of the drive under test."""
    drive = drives.with_carrier(drives.load(DRIVE), carrier_half)
    return drive, registers(drive)


def run(case: Case, core: Core, drive, register_set) -> Outcome:
    """Run a case; ``core`` has been reset and its registers are set."""
    period, pair = 2 * register_set.config.carrier_half, Pair(core, register_set)
    plant, described = build_plant(drive, omega_m=case.rpm * RPM)
    codes = sensor_params(described)
    omega_ref = from_si("omega_ref", case.rpm * RPM * drive.machine.pole_pairs, drive)
    references = dict.fromkeys(INPUT_PORTS[5:], 0) | {"omega_ref_in": omega_ref, "speed_mode_in": 1}
    pair.advance(1, enable=1, trip=0, clear_trip=0)  # sample_trigger comes with the first clock
    currents, speeds = [], []
    for k in range(case.periods):
        currents.append(tuple(plant.i_abc))
        speeds.append(plant.omega_m)
        plan = Plan(k, drive.inverter.dc_bus_v if case.bus is None else case.bus(k))
        plan.codes = {f"adc_{x}": int(current_code(codes, n, plant.i_abc[n], k)) for n, x in enumerate("abc")}
        plan.codes["adc_u_dc"] = int(u_dc_code(codes, plan.u_dc, k))
        plan.codes["position_code"] = int(position_code(codes, plant.theta_m, k))
        plan.strobes = {SAMPLE_DELAY: {}}
        if k in case.clears:
            plan.pulse("clear_trip", CLEAR_AT)
        case.disturb(plan)
        words = gate_words(_play(plan, pair, references, period))
        edges = np.flatnonzero(np.diff(words, prepend=-1))
        times = edges * (drive.sample_time_s / period)
        plant.advance(times, words[edges], plan.u_dc, case.load, drive.sample_time_s)
    decided, strobed = pair.decided or (None, None)
    return Outcome(
        np.concatenate(pair.rows), decided, strobed, pair.golden.clock, pair.samples, pair.differences,
        pair.first_difference, np.array(currents), np.array(speeds), period,
    )  # fmt: skip


def _play(plan: Plan, pair: Pair, references: Mapping[str, int], period: int) -> np.ndarray:
    """One period of both cores; returns the device's outputs per clock."""
    if plan.registers:
        pair.change(plan.registers)
    rows, cuts = [], sorted({0, *plan.strobes, *plan.pins, period})
    for at, until in zip(cuts, cuts[1:], strict=False):
        sample = None
        if at in plan.strobes:
            pair.compare_values()
            sample = dict(
                zip(
                    INPUT_PORTS,
                    [*(plan.codes | plan.strobes[at]).values(), *references.values()],
                    strict=True,
                )
            )
        rows.append(pair.advance(until - at, sample, **plan.pins.get(at, {})))
    return np.concatenate(rows)
