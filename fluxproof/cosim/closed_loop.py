# SPDX-License-Identifier: BSD-3-Clause
"""Closed loop: gate edges switch the plant, the plant's sensors feed the core, the golden model runs in parallel.

The device under test runs one PWM period at a time (see Device): the VHDL in GHDL, its Verilog
conversion in Verilator, or the golden model itself.  All see the same codes; every observed value and every gate
edge is compared with ``==``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Protocol

import numpy as np

from fluxproof.cosim.golden_clock import SEEN, GoldenClock
from fluxproof.plant import (
    FREE,
    Inverter,
    Machine,
    Sensors,
    SwitchingPlant,
    centred_gates,
    half_gates,
    sensor_params,
)
from fluxproof.plant.sensors import current_code, position_code, u_dc_code
from golden_model import fluxproof
from golden_model.io import sample_latch
from golden_model.kernel import kernel

INPUT_PORTS = tuple(p.name for p in sample_latch.BLOCK.inputs if p.name != "run_in")
SAMPLE_DELAY = 4  # clocks from sample_trigger to sample_valid: the conversion time of an ADC, shortened


@dataclass(frozen=True)
class Scenario:
    """References, load and bus voltage per sample, a period of the loops here: arrays of equal length."""

    omega_ref: np.ndarray  # integers, per unit format
    load: np.ndarray  # [Nm]
    u_dc: np.ndarray  # [V]
    i_d_ref: np.ndarray  # integers
    i_q_ext: np.ndarray  # integers
    speed_mode: np.ndarray  # 0 or 1
    enable: np.ndarray  # 0 or 1
    brake: np.ndarray | None = None  # [Nm] largest torque of a brake on the shaft, see ``load_torque``
    changes: Mapping[int, Mapping[str, int]] = field(default_factory=dict)  # period -> registers from there on
    omega_m: float = 0.0  # mechanical speed at the start [rad/s]
    clear_faults: np.ndarray | None = None  # 0 or 1; None: never
    temp_winding: np.ndarray | None = None  # winding temperature [degC]; NaN: reading lost; None: no sensor

    def __len__(self) -> int:
        return len(self.load)

    def first(self, periods: int | None) -> Scenario:
        """The scenario's first ``periods``; None: all of it."""
        if periods is None:
            return self
        columns = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{k: v[:periods] for k, v in columns.items() if isinstance(v, np.ndarray)})

    def slow_inputs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(temperature, whether it is valid, clear_faults) as inputs of the core."""
        zeros = np.zeros(len(self), np.int64)
        clear = zeros if self.clear_faults is None else self.clear_faults
        if self.temp_winding is None:
            return zeros, zeros, clear
        valid = np.isfinite(self.temp_winding)
        sixty_fourths = np.round(64.0 * np.where(valid, self.temp_winding, 0.0)).astype(np.int64)
        return sixty_fourths, valid.astype(np.int64), clear


BRAKE_SLOPE = 10.0  # Nm per rad/s: a held shaft creeps below half a rad/s, and a period still integrates well


@kernel
def load_torque(load, brake, omega_m):
    """Load [Nm] plus a brake torque that opposes the motion, up to ``brake`` [Nm]."""
    return load + max(-brake, min(brake, BRAKE_SLOPE * omega_m))


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

    async def start(self, registers, enable: int) -> Period:
        """Reset, set the registers, run to the first sample_trigger."""
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
        self.core = GoldenClock(register_set.values, register_set.config)
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
    # of the device: rows of (period, clock, gate word)
    gate_edges: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    state: fluxproof.State | None = None  # the golden model's, at the end


PLANT_SIGNALS = {
    "i_a": lambda p: p.i_abc[0],
    "i_d": lambda p: p.i_dq[0],
    "i_q": lambda p: p.i_dq[1],
    "lambda_d": lambda p: p.lambda_dq[0],
    "lambda_q": lambda p: p.lambda_dq[1],
    "omega_m": lambda p: p.omega_m,
    "torque": lambda p: p.torque,
}


def described_sensors(drive) -> Sensors:
    """Sensors as drive.toml describes them."""
    s = drive.sensors
    return Sensors(
        current_bits=s.adc_bits,
        current_full_scale_a=s.current_range_a,
        u_dc_bits=s.adc_bits,
        u_dc_full_scale_v=s.u_dc_range_v,
        position_bits=s.position_bits,
        position_counts=drive.encoder.counts or 0,
    )


def build_plant(
    drive, sensors: Sensors | None = None, machine: Machine | None = None, omega_m: float = 0.0, mode: int = FREE
) -> tuple[SwitchingPlant, Sensors]:
    """Plant and sensors as drive.toml describes them; the dead time is that of the device's gates."""
    machine = machine or Machine.from_mapping(vars(drive.machine))
    return SwitchingPlant(machine, Inverter(), mode, omega_m=omega_m), sensors or described_sensors(drive)


def read_out(values: Mapping[str, int]) -> fluxproof.Observed:
    """A device's values of a sample in the golden model's type."""
    return fluxproof.Observed(*(values[name] for name in fluxproof.Observed._fields))


class Comparison:
    """A device and the golden model in parallel: both get the same samples, every period is compared."""

    def __init__(self, device: Device, register_set):
        self.device, self.config = device, register_set.config
        self.golden, self.result = GoldenPeriods(register_set), Result()
        self.samples: list[tuple[int, ...]] = []
        self.observed: list[fluxproof.Observed] = []
        self.edges: list[tuple[int, int, int]] = []

    def differ(self, what: str) -> None:
        """Count a difference and keep the message of the first one."""
        self.result.differences += 1
        self.result.first_difference = self.result.first_difference or f"period {len(self.observed)}: {what}"

    def change(self, registers: Mapping[str, int]) -> None:
        """Set registers of both between two periods."""
        self.golden.core.registers = self.golden.core.registers._replace(**registers)
        self.device.change(registers)

    async def start(self, enable: int) -> None:
        """Reset and run to the first sample_trigger."""
        got = await self.device.start(self.golden.core.registers, enable)
        if not np.array_equal(got.gate_words, self.golden.run(None, enable).gate_words):
            self.differ("gates before the first sample")

    async def period(self, inputs: dict[str, int], enable: int) -> Period:
        """One period on both; ``inputs`` by the names of INPUT_PORTS, in their order.  Returns the device's."""
        wanted = self.golden.run(inputs, enable)
        got, golden = await self.device.period(inputs, enable), self.golden.core.observed
        assert golden is not None  # a sample has entered
        self.compare(got, golden, wanted)
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
        if _edges(got) != _edges(wanted):
            self.differ(f"gate edges: got {_edges(got)}, wanted {_edges(wanted)}")
        seen, right = ((p.clocks, p.running, *p.flags) for p in (got, wanted))
        if seen != right:
            self.differ(f"clocks, running, {', '.join(FLAGS)}: got {seen}, wanted {right}")
        self.result.sample_to_duty_clocks = max(self.result.sample_to_duty_clocks, got.sample_to_duty)

    def finish(self) -> Result:
        """The recorded run with the device's values, which equal the golden ones if there is no difference."""
        self.result.periods_compared = len(self.observed)
        self.result.samples = np.array(self.samples, np.int64).reshape(-1, len(fluxproof.Sample._fields))
        self.result.observed = dict(zip(fluxproof.Observed._fields, np.array(self.observed).T, strict=True))
        self.result.gate_edges = np.array(self.edges, np.int64).reshape(-1, 3)
        return self.result


class PlantPeriods:
    """A scenario's plant period by period: its sensors' codes for the core, gate edges back.

    ``mode`` IMPOSED_SPEED: the scenario's load is the mechanical speed [rad/s].
    """

    def __init__(
        self,
        drive,
        scenario: Scenario,
        sensors: Sensors | None = None,
        machine: Machine | None = None,
        mode: int = FREE,
    ):
        self.scenario, self.period_s, self.mode = scenario, drive.sample_time_s, mode
        self.plant, described = build_plant(drive, sensors, machine, scenario.omega_m, mode)
        self.codes, self.slow_inputs, self.rows = sensor_params(described), scenario.slow_inputs(), []

    def inputs(self, k: int) -> dict[str, int]:
        """The raw sample's ports at the start of period ``k``; the plant's signals are recorded."""
        plant, codes, scenario = self.plant, self.codes, self.scenario
        self.rows.append([read(plant) for read in PLANT_SIGNALS.values()])
        values = (
            *(current_code(codes, n, plant.i_abc[n], k) for n in range(3)),
            u_dc_code(codes, float(scenario.u_dc[k]), k),
            position_code(codes, plant.theta_m, k),
            *(scenario.omega_ref[k], scenario.i_d_ref[k], scenario.i_q_ext[k], scenario.speed_mode[k]),
            *(column[k] for column in self.slow_inputs),
        )
        return dict(zip(INPUT_PORTS, map(int, values), strict=True))

    def advance(self, k: int, times: np.ndarray, words: np.ndarray) -> None:
        """Period ``k`` with these gate words from these times [s] on."""
        scenario, plant = self.scenario, self.plant
        brake = 0.0 if scenario.brake is None else scenario.brake[k]
        load = float(scenario.load[k])
        if self.mode == FREE:
            load = load_torque(load, float(brake), plant.omega_m)
        plant.advance(times, words, float(scenario.u_dc[k]), load, self.period_s)


async def cosimulate(
    device: Device,
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
            duties = np.array(comparison.observed[-1][-3:]) / comparison.config.carrier_half
        plant.advance(k, times, words)
        progress(k + 1, len(scenario))
    result = comparison.finish()
    result.plant = dict(zip(PLANT_SIGNALS, np.array(plant.rows).T, strict=True))
    return result


def _edges(period: Period) -> str:
    return " ".join(f"{c}:{w:06b}" for c, w in zip(period.edge_clocks, period.gate_words, strict=True))


def run_now(coroutine):
    """Run a coroutine that never waits, for devices that are plain function calls."""
    try:
        coroutine.send(None)
    except StopIteration as stop:
        return stop.value
    raise RuntimeError("the coroutine waits for a simulator; run it inside the simulator")
