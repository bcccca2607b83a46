# SPDX-License-Identifier: BSD-3-Clause
"""The wiring of the whole core: mutants of the top's own cells and connections, judged by the golden core.

Three runs, each clock of them compared: every operating condition in 50 ms in closed loop (`compressed` in
fluxproof/cosim/scenarios.py), the same with bits of some settings inverted from time to time, and samples with any
settings.  Inputs and expected outputs come from the golden core alone, by the names of the ports.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from types import MappingProxyType

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.closed_loop import GoldenPeriods
from fluxproof.cosim.driven_plant import INPUT_PORTS, PlantPeriods
from fluxproof.cosim.golden_clock import SEEN, GoldenClock
from fluxproof.cosim.runs import closed_loop, generics
from fluxproof.cosim.values import random_value
from fluxproof.cosim.verilog import VerilogPort
from golden_model import clocked
from golden_model.fluxproof import OBSERVED, REGISTERS, Observed
from golden_model.io import fault_latch, offset_check, sample_latch
from scripts.mutate.harness import Trial
from scripts.prove.pipeline import core_ends

CARRIER_HALF = 125  # odd: no bit of a duty falls off for good where it becomes clocks
# Carrier, compare values and the pulse in force are from 0 to CARRIER_HALF, as the benches of gate_generation and
# pwm_compare see: the bits above are always 0, and these mutations of them change nothing.
_ABOVE = rf"({'|'.join(map(str, range(CARRIER_HALF.bit_length(), 16)))})"
_COUNTS = r"-port (?:compare_[abc]|carrier|min_pulse_used) -portbit"
NO_CHANGE = re.compile(rf"-mode const0 .*{_COUNTS} {_ABOVE}$|-mode cnot1 .*{_COUNTS} \d+ -ctrlbit {_ABOVE}$")
IN_RESET = 4
MUTANTS = 100
SEED, SETTINGS = 3, 2100  # of any_settings
# Limits, and the value of the sample or of the core that is compared with them.
LIMITS = {
    "i_trip": "i_a",
    "u_dc_min": "u_dc",
    "u_dc_max": "u_dc",
    "t_min": "temp_winding_in",
    "t_max": "temp_winding_in",
    "i_max": "i_q_ref",
    "omega_0": "omega_me",
    "omega_min": "omega_me",
    "delta_max": "delta_lambda_d",
    "v_thr": "v_dead",
    "v_comp_max": "v_comp",
    "i_learn": "i_q",
    "omega_psi_min": "omega_chord",
    "sum_trip": "i_c",
    "i_open": "i_b",
    "offset_max": "i_a",
    "omega_trip": "omega_me",
    "omega_away": "omega_me",
    "omega_stall": "omega_me",
    "brake_on": "u_dc",
    "brake_off": "u_dc",
    "regen_start": "u_dc",
}
HARMLESS = ("delta_max", "v_thr", "v_comp_max", "i_learn", "omega_psi_min")
# What the estimators learn from a sample shows at once, down to its low bits.
FAST = {name: REGISTERS[name].high for name in ("eta_v", "eta_psi", "gamma", "zeta", "v_comp_max")}
# The flux follows a voltage that is far too large, to the ends of its range and back.
ADRIFT = {"t_s": REGISTERS["t_s"].high, "omega_0": REGISTERS["omega_0"].low}
INVERTED = 12  # settings of which a bit is inverted at a time
BITS = {"ADC_BITS": 16, "POSITION_BITS": 16}


class Recorder(GoldenClock):
    """A golden core that writes down what it gets and shows, clock by clock."""

    def __init__(self, registers, config):
        super().__init__(registers, config)
        self.writes: list[tuple[int, str, int]] = []
        self.checks: list[tuple[int, str, int]] = []
        self.driven: dict[str, int] = {}
        self.held: dict[str, int] = {}  # pins that stay as they are here
        self.entered: int | None = None  # clock of the last sample, until its values are compared
        self.all_entered: set[int] = set()

    def drive(self, at: int, values: Mapping[str, int]) -> None:
        """Inputs from clock ``at`` on, where they differ from the last."""
        new = {name: int(value) for name, value in values.items() if self.driven.get(name) != value}
        self.driven |= new
        self.writes += [(at, name, value) for name, value in new.items()]

    def advance(self, clocks, sample=None, until_trigger=False, **pins):
        begin, count, pins = self.clock, len(self.samples), self.held | pins
        self.drive(begin, self.registers._asdict() | pins)
        due = self.entered is not None and begin - self.entered >= clocked.INTERVAL
        if due:
            self.checks += [(begin, name, int(v)) for name, v in zip(Observed._fields, self.observed, strict=True)]
            self.entered = None
        if sample is not None:
            self.drive(begin, {**sample, "sample_valid": 1})
            self.drive(begin + 1, {"sample_valid": 0})
        rows = super().advance(clocks, sample, until_trigger, **pins)
        if len(self.samples) > count:
            self.entered = begin
            self.all_entered.add(begin)
        for at, row in enumerate(rows, begin + 1):
            self.checks += [(at, name, int(value)) for name, value in zip(SEEN, row, strict=True)]
        self.checks.append((self.clock, "carrier", self.state.of_gate_generation.carrier))
        return rows

    def trial(self, ports: Iterable[VerilogPort]) -> Trial:
        """All that happened so far, for the ports of the converted core."""
        ports = tuple(ports)
        number = {p.name: k for k, p in enumerate(ports)}
        strobes = [
            (at, name, int(at - latency in self.all_entered))
            for name, latency in core_ends()
            for at in range(1, self.clock + 1)
        ]
        reset = [(-IN_RESET, number["rst"], 1), (0, number["rst"], 0)]
        tables = [
            np.array(sorted([*first, *((at, number[name], value) for at, name, value in rows)]), np.int64)
            for first, rows in ((reset, self.writes), ([], self.checks + strobes))
        ]
        return Trial(ports, IN_RESET, self.clock, *tables, np.empty(0, np.int64), np.empty(0, np.int64))


def every_event(inverted: int = 0, changed: Mapping[str, int] = MappingProxyType({}), seed: int = SEED) -> Recorder:
    """The scenario `compressed` in closed loop, with these settings ``changed``.

    inverted: in every second period a bit is inverted in each of so many settings, where the range allows it; now and
    then the power stage trips.
    """
    run = closed_loop(str(DRIVES / "paper001.toml"), CARRIER_HALF, "compressed")
    golden = GoldenPeriods(run.registers)
    golden.core = Recorder(run.registers.values, run.registers.config)
    plant, scenario, settings = PlantPeriods(run.drive, run.scenario), run.scenario, golden.core.registers
    rng, settings = np.random.default_rng(seed), settings._replace(**changed)
    golden.run(None, int(scenario.enable[0]))
    for k in range(len(scenario)):
        if inverted:
            golden.core.registers = beside(settings, inverted * (k % 2), rng)
            if k % 4 == 3:  # limits of the estimators, which stop nothing
                met = beside_seen(golden.core.observed._asdict(), rng, HARMLESS)
                golden.core.registers = golden.core.registers._replace(**met)
            golden.core.held = {"clear_trip": int(rng.integers(4) == 0), "trip": int(rng.integers(100) == 0)}
        period = golden.run(plant.inputs(k), int(scenario.enable[k]))
        plant.advance(k, period.edge_clocks * (plant.period_s / period.clocks), period.gate_words)
    return golden.core


def beside_seen(
    seen: Mapping[str, int], rng: np.random.Generator, names: Iterable[str] = tuple(LIMITS)
) -> dict[str, int]:
    """Limits at the size of what is compared with them, or one bit beside it: there every bit of both counts."""
    found = {}
    for name in names:
        port, of = REGISTERS[name], LIMITS[name]
        value = seen[of] if port.fmt.signed else abs(seen[of])
        drop = OBSERVED[of].fmt.frac_bits - port.fmt.frac_bits if of in OBSERVED else 0
        value = value >> drop if drop > 0 else value << -drop
        if rng.integers(2):
            value ^= 1 << int(rng.integers(port.fmt.width - bool(port.fmt.signed)))
        found[name] = min(max(value, port.low), port.high)
    return found


def beside(settings, count: int, rng: np.random.Generator):
    """The settings with one bit, or all from a bit down at random, inverted in ``count`` of them, drawn at random."""
    changed = {}
    # A changed double_update waits until the gates are off: a trip would take it while a sample is in flight.
    for name in rng.choice([name for name in REGISTERS if name != "double_update"], count, replace=False):
        port, value = REGISTERS[name], getattr(settings, name)
        bit = 1 << int(rng.integers(port.fmt.width - bool(port.fmt.signed)))
        other = value ^ (bit if rng.integers(2) else int(rng.integers(bit, 2 * bit)))
        changed[name] = other if port.low <= other <= port.high else value
    return settings._replace(**changed)


def any_settings() -> Recorder:
    """Samples of any codes with any registers, each three times: every bit of every setting reaches its block."""
    run = closed_loop(str(DRIVES / "paper001.toml"), CARRIER_HALF, "compressed", 1)
    golden, rng = Recorder(run.registers.values, run.registers.config), np.random.default_rng(SEED)
    golden.advance(1, enable=1)
    ports = {p.name: p for p in sample_latch.BLOCK.ports(BITS)}
    sample: dict[str, int] = {}
    for k in range(SETTINGS):
        changed = {name: random_value(rng, port) for name, port in REGISTERS.items()}
        runs = k // 3 % 3 < 2  # nearly every one of these samples is a fault: only where none trips can the gates run
        if k % 3:  # the same again, with limits that are just met or missed
            changed = beside_seen(golden.observed._asdict() | sample, rng)
        else:
            sample = {name: random_value(rng, ports[name]) for name in INPUT_PORTS}
        if runs:  # but one fault now and then
            kept = REGISTERS["fault_ignore"].high
            changed["fault_ignore"] = kept ^ (1 << int(rng.integers(kept.bit_length())) if k % 3 == 2 else 0)
        golden.registers = golden.registers._replace(**changed)
        golden.advance(4, enable=int(k % 3 > 0), clear_trip=int(runs or rng.integers(4) == 0))
        r = golden.registers
        if k % 3 == 0 and 0 < r.dead_time < r.min_pulse <= CARRIER_HALF:
            golden.advance(2 * CARRIER_HALF)  # the valley takes them before the sample, not while it is in flight
        clocks = clocked.INTERVAL + int(rng.integers(1, 80))
        early = int(rng.integers(2, clocked.INTERVAL)) if k % 5 == 0 else clocks
        golden.advance(early, sample, enable=1, clear_trip=0)
        if early < clocks:  # one too early: counted, not taken
            golden.advance(clocks - early, sample)
    for bit in (None, None, *range(REGISTERS["offset_max"].fmt.width)):
        at_rest(golden, sample, bit)
    return golden


def at_rest(golden: Recorder, sample: Mapping[str, int], bit: int | None) -> None:
    """As many samples with the gates off as the zero of the sensors takes to be found wrong, then it alone trips.

    bit: of the limit, which is this far from the largest current; none: the limit is 0.
    """
    largest = max(abs(getattr(golden.observed, name)) for name in ("i_a", "i_b", "i_c"))
    limit = 0 if bit is None else largest >> OBSERVED["i_a"].fmt.frac_bits - REGISTERS["offset_max"].fmt.frac_bits
    limit = min(limit ^ 1 << bit if bit is not None else limit, REGISTERS["offset_max"].high)
    alone = REGISTERS["fault_ignore"].high ^ (1 << fault_latch.OFFSET)
    golden.registers = golden.registers._replace(omega_stall=REGISTERS["omega_stall"].high, offset_max=limit)
    golden.registers = golden.registers._replace(fault_ignore=alone, k_filter=REGISTERS["k_filter"].high)
    golden.advance(4, enable=0, clear_trip=1)
    for _ in range(offset_check.LAST + 4):
        golden.advance(clocked.INTERVAL + 3, sample, enable=0, clear_trip=0)
    golden.advance(40, enable=1)


def config() -> dict[str, int]:
    """The generics of the core under test."""
    return generics(closed_loop(str(DRIVES / "paper001.toml"), CARRIER_HALF, "compressed", 1).config)
