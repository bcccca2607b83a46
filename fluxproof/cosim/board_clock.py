# SPDX-License-Identifier: BSD-3-Clause
"""The golden fluxproof_board clock by clock: pins in, pins out; the core's samples as in golden_clock.

The front ends' twins (golden_model/encoders, converters, io) and the clocked part of the core are wired as in
rtl/generated/fluxproof_board.vhd: what an instance reads from another is what that had registered before the clock.
Registers are written by name; a write on the bus takes effect ``BUS`` clocks after its address and data were first
valid, a setting then waits for the end of the sample in flight, and a still one is refused while the gates switch
(io/register_access.vhd).  The trip pin, which acts
without a clock, changes between two clocks here; with a filter it is a pin like the others (io/power_stage.vhd).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fluxproof.cosim.golden_clock import Due, arrive, inputs_of, rows_of
from golden_model import clocked, fluxproof
from golden_model.common import input_filter
from golden_model.converters import current_front
from golden_model.encoders import forced_position, master_encoder, position_front
from golden_model.io import board_faults, board_map, board_snapshot, interrupts, sample_join
from golden_model.io.register_file import RegisterFile
from golden_model.io.register_map import OKAY, Kind
from golden_model.kernel import kernel

BUS = 7
HOST_WRITE = "host_write"  # the strobe of an accepted write
REFERENCES = ("omega_ref", "i_d_ref", "i_q_ext", "speed_mode", "temp_winding", "temp_valid", "clear_faults")
# The pins in the order of the blocks' inputs; what is not a pin comes from another block or a register.
POSITION_PINS = tuple(p.name for p in position_front.BLOCK.inputs[:8])
CONVERTER_PINS = tuple(p.name for p in current_front.BLOCK.inputs[:12])
PINS = (*POSITION_PINS, *CONVERTER_PINS, "master_a", "master_b", "trip")
AT_CONVERTERS, AT_TRIP = len(POSITION_PINS), len(PINS) - 1
GATES = ("gate_high", "gate_low", "sample_trigger", "irq")
SEEN = (
    *GATES,
    "serial_clock",
    "serial_out",
    "serial_drive",
    "convst",
    "cs_n",
    "sclk",
    "den",
    "daddr",
    "mod_clock",
    "brake",
)
# What is not a pin, of the same rows
STATUS = tuple(board_map.STATUS)
position_step, converter_step, forced_step = position_front.step, current_front.step, forced_position.step
master_step = master_encoder.step
join_step, faults_step, snapshot_step = sample_join.step, board_faults.step, board_snapshot.step
interrupts_step, filter_step = interrupts.step, input_filter.step


class Wires(NamedTuple):
    """Registered outputs that other instances read at the next clock."""

    trigger: int = 0
    gate_high: int = 0
    gate_low: int = 0
    sample_valid: int = 0
    codes_done: int = 0
    adc_a: int = 0
    adc_b: int = 0
    adc_c: int = 0
    adc_u_dc: int = 0
    encoder_code: int = 0
    encoder_restart: int = 0
    master_code: int = 0
    omega_now: int = 0
    position_done: int = 0
    encoder_count: int = 0
    encoder_flags: int = 0
    index_wrong: int = 0
    position_lost: int = 0
    converter_over: int = 0
    angle_unknown: int = 0
    hall_wrong: int = 0
    forced: int = 0
    position_code: int = 0
    position_restart: int = 0
    speed_now: int = 0
    board_stop: int = 0
    core_clear: int = 0
    running: int = 0
    tripped: int = 0
    fault_flags: int = 0
    setting_refused: int = 0
    irq: int = 0


class State(NamedTuple):
    of_core: clocked.State = clocked.State()
    of_position: position_front.State = position_front.State()
    of_master: master_encoder.State = master_encoder.State()
    of_converters: current_front.State = current_front.State()
    of_forcing: forced_position.State = forced_position.State()
    of_join: sample_join.State = sample_join.State()
    of_faults: board_faults.State = board_faults.State()
    of_snapshot: board_snapshot.State = board_snapshot.State()
    of_interrupts: interrupts.State = interrupts.State()
    of_filter: input_filter.State = input_filter.State()
    caught: int = 0  # of the trip pin
    trip_1: int = 0
    trip_2: int = 0
    wires: Wires = Wires()


class BoardRegisters(NamedTuple):
    """The registers that the front ends, the snapshot and the interrupt read."""

    position: tuple  # position_front.Registers
    master: tuple  # master_encoder.Registers
    converters: tuple  # current_front.Registers
    # Of the core
    reverse: int
    omega_given: int
    speed_given: int
    irq_mask: int
    irq_clear: int
    # Of the board
    clear_encoder: int
    take_snapshot: int
    position_source: int
    forced_angle: int
    forced_rate: int
    board_ignore: int


@kernel
def core_clock(state, inputs, regs, irq, ways, carrier_half, trip_filter):
    """A clock of core, interrupts and power stage, whose samples enter by ``state.wires.sample_valid``.

    ``irq``: (irq_mask, irq_clear); ``ways`` to the gates: (stop by the board, clear_trip, pin trip).
    Returns (core, interrupts, (filter, caught, trip_1), whether a sample has entered, what the core shows, irq, off).
    """
    w, i = state.wires, inputs
    stop, clear_trip, pin = ways
    core_trip = 1 if stop or state.trip_2 else 0
    now = clocked.Inputs(
        sample_valid=w.sample_valid, enable=i.enable, trip=core_trip,
        clear_trip=clear_trip, host_write=i.host_write, sample_faults=i.sample_faults, sample_trip=i.sample_trip,
        current_offset=i.current_offset, motion_faults=i.motion_faults, open_load=i.open_load,
        encoder_lost=i.encoder_lost, motor_differs=i.motor_differs,
        brake_asked=i.brake_asked, compare_a=i.compare_a, compare_b=i.compare_b, compare_c=i.compare_c,
    )  # fmt: skip
    core, entered, seen = clocked.step(state.of_core, now, regs, carrier_half)
    causes, (_, line) = interrupts_step(
        state.of_interrupts, w.tripped, w.fault_flags, w.setting_refused, w.running, i.motor_differs, irq[0], irq[1]
    )
    # The power stage: a trip is caught without a clock, and let go when the core has it
    of_filter, trip_on, trip_next = state.of_filter, pin, pin
    if trip_filter:  # its level changes with the clock: the gates go off behind this edge
        trip_on = state.of_filter.level
        of_filter, (trip_next, _) = filter_step(state.of_filter, pin, trip_filter)
    caught = 1 if trip_on or state.caught else 0
    kept = 1 if trip_on or trip_next or (caught and not state.trip_2) else 0
    off = 1 if caught or trip_next else 0
    return core, causes, (of_filter, kept, caught), entered, seen, line, off


@kernel
def one_clock(state, inputs, regs, b, pins, carrier_half, config):
    """One clock: (next state, whether a sample has entered, core, position, converters, board, snapshot, gates off)."""
    w, p, c = state.wires, pins, AT_CONVERTERS
    encoder, currents, adc_bits, position_bits, lines, trip_filter, master_built = config
    position, seen_position = position_step(
        state.of_position,
        position_front.Inputs(
            pin_a=p[0], pin_b=p[1], pin_z=p[2], hall_a=p[3], hall_b=p[4], hall_c=p[5], serial_data=p[6],
            position_in=p[7], sample_trigger=w.trigger, codes_valid=w.codes_done, clear_encoder=b.clear_encoder,
            omega_set=b.omega_given, reverse=b.reverse,
        ),
        b.position,
        encoder,
        position_bits,
    )  # fmt: skip
    master, (master_code, master_illegal) = master_step(
        state.of_master,
        master_encoder.Inputs(
            master_a=p[AT_TRIP - 2], master_b=p[AT_TRIP - 1], sample_trigger=w.trigger, clear_encoder=b.clear_encoder
        ),
        b.master,
        master_built,
    )
    converters, seen_converters = converter_step(
        state.of_converters,
        current_front.Inputs(
            miso=p[c], busy=p[c + 1], eoc=p[c + 2], drdy=p[c + 3], drp_do=p[c + 4], mod_data=p[c + 5],
            mod_clock_in=p[c + 6], code_a_in=p[c + 7], code_b_in=p[c + 8], code_c_in=p[c + 9],
            code_u_dc_in=p[c + 10], codes_valid_in=p[c + 11], sample_trigger=w.trigger, clear_encoder=b.clear_encoder,
        ),
        b.converters,
        currents,
        adc_bits,
        lines,
    )  # fmt: skip
    forcing, (position_code, position_restart, speed_now, forced) = forced_step(
        state.of_forcing, w.encoder_code, w.encoder_restart, b.speed_given, w.trigger, b.position_source,
        b.forced_angle, b.forced_rate, position_bits,
    )  # fmt: skip
    join, (sample_valid,) = join_step(state.of_join, w.trigger, w.codes_done, w.position_done)
    faults, (board_flags, board_first, board_stop, core_clear) = faults_step(
        state.of_faults, w.index_wrong, w.position_lost, w.converter_over, w.angle_unknown, w.hall_wrong, w.forced,
        inputs.enable, inputs.clear_trip, b.board_ignore,
    )  # fmt: skip
    snapshot, seen_snapshot = snapshot_step(
        state.of_snapshot, w.sample_valid, b.take_snapshot, w.encoder_code, w.position_code, w.encoder_count,
        w.encoder_flags, w.adc_a, w.adc_b, w.adc_c, w.adc_u_dc, adc_bits, position_bits,
    )  # fmt: skip
    core, causes, stage, entered, seen_core, irq, off = core_clock(
        state, inputs, regs, (b.irq_mask, b.irq_clear), (w.board_stop, w.core_clear, p[AT_TRIP]), carrier_half,
        trip_filter,
    )  # fmt: skip
    x, y, z = seen_position, seen_converters, seen_core
    wires = Wires(
        trigger=z.sample_trigger,
        gate_high=z.gate_high,
        gate_low=z.gate_low,
        sample_valid=sample_valid,
        codes_done=y.codes_done,
        adc_a=y.adc_a,
        adc_b=y.adc_b,
        adc_c=y.adc_c,
        adc_u_dc=y.adc_u_dc,
        encoder_code=x.encoder_code,
        encoder_restart=x.encoder_restart,
        master_code=master_code,
        omega_now=x.omega_now,
        position_done=x.position_done,
        encoder_count=x.encoder_count,
        encoder_flags=x.encoder_flags,
        index_wrong=x.index_wrong,
        position_lost=x.position_lost,
        converter_over=y.converter_over,
        angle_unknown=x.angle_unknown,
        hall_wrong=x.hall_wrong,
        forced=forced,
        position_code=position_code,
        position_restart=position_restart,
        speed_now=speed_now,
        board_stop=board_stop,
        core_clear=core_clear,
        running=z.running,
        tripped=z.tripped,
        fault_flags=z.fault_flags,
        setting_refused=z.setting_refused,
        irq=irq,
    )
    following = State(
        of_core=core,
        of_position=position,
        of_master=master,
        of_converters=converters,
        of_forcing=forcing,
        of_join=join,
        of_faults=faults,
        of_snapshot=snapshot,
        of_interrupts=causes,
        of_filter=stage[0],
        caught=stage[1],
        trip_1=stage[2],
        trip_2=state.trip_1,
        wires=wires,
    )
    board = (forced, board_flags, board_first, master_illegal)
    return following, entered, seen_core, seen_position, seen_converters, board, seen_snapshot, off


@kernel
def run_clocks(state, inputs, regs, b, pins, carrier_half, config, until_idle, seen, status):
    """A clock for each row of ``pins`` and ``inputs`` until a sample enters or, with ``until_idle``, none is in flight.

    Returns (state, clocks made, whether a sample has entered at the last, the wires that it entered with).
    """
    before = state.wires
    entered = 0
    for k in range(len(pins)):
        if k > 0 and until_idle and not state.of_core.sample_busy:
            return state, k, 0, before
        before = state.wires
        state, entered, core, position, converters, board, snapshot, off = one_clock(
            state, inputs_of(inputs[k]), regs, b, pins[k], carrier_half, config
        )
        x = seen[k]
        x[0], x[1] = 0 if off else before.gate_high, 0 if off else before.gate_low
        x[2], x[3] = before.trigger, state.wires.irq
        x[4], x[5], x[6] = position.serial_clock, position.serial_out, position.serial_drive
        x[7], x[8], x[9] = converters.convst, converters.cs_n, converters.sclk
        x[10], x[11], x[12] = converters.den, converters.daddr, converters.mod_clock
        x[13] = core.brake
        y = status[k]
        y[0], y[1], y[2] = position.encoder_flags, position.encoder_count, position.index_count
        y[3], y[4], y[5] = position.illegal_count, position.lost_counts, position.bridged_count
        y[6], y[7] = converters.converter_errors, converters.converter_refused
        y[8], y[9], y[10], y[20] = board
        y[11], y[12], y[13], y[14], y[15], y[16], y[17], y[18], y[19] = snapshot
        if entered:
            return state, k + 1, entered, before
    return state, len(pins), entered, before


class GoldenBlocks:
    """Which kind of front ends: the generics of fluxproof_board that the golden board needs."""

    def __init__(
        self,
        config: fluxproof.Config,
        encoder: int = 1,
        currents: int = 1,
        spi_lines: int = 4,
        trip_filter: int = 0,
        master: int = 0,
    ):
        self.core, self.encoder, self.currents, self.spi_lines = config, encoder, currents, spi_lines
        self.trip_filter, self.master = trip_filter, master

    def generics(self, clock_hz: int) -> dict[str, int]:
        """By the names of the VHDL."""
        own = {"ENCODER": self.encoder, "CURRENTS": self.currents, "SPI_LINES": self.spi_lines}
        own |= {"TRIP_FILTER": self.trip_filter, "MASTER": self.master}
        return {name.upper(): value for name, value in self.core._asdict().items()} | own | {"CLOCK_HZ": clock_hz}


class BoardClock:
    """One golden board after its reset; ``clock`` counts from the first clock without reset inside."""

    seen_names: tuple[str, ...] = SEEN
    status_names: tuple[str, ...] = STATUS

    def __init__(self, blocks: GoldenBlocks, clock_hz: int):
        self.blocks, self.clock_hz, core = blocks, clock_hz, blocks.core
        generics = {**core._asdict(), "clock_hz": clock_hz}
        self.registers = RegisterFile(generics, beside={"master": blocks.master})
        self.registers.map = board_map.registers()
        self.registers.at = {register.address: register for register in self.registers.map.values()}
        self.registers.reset()
        self.config = (blocks.encoder, blocks.currents, core.adc_bits, core.position_bits, blocks.spi_lines)
        self.config += (blocks.trip_filter, blocks.master)
        self.state, self.of_samples = State(), fluxproof.State()
        self.inputs = clocked.Inputs()
        self.clock = 0
        self.observed: fluxproof.Observed | None = None
        self.samples = 0
        self.history: list[tuple[fluxproof.Sample, fluxproof.Observed]] = []  # of the samples
        self.strobes: list[int] = []  # the clocks at which they entered
        self._due: list[Due] = []
        self._writes: list[tuple[int, str, int]] = []
        self._taken: list[tuple[int, str, int]] = []  # registers that change, and host_write with them
        self._ran = 0  # whether the gates switched, a clock before the coming one
        self._barred = False  # the write that waits is a still setting, and they did
        self.refused: list[str] = []  # still settings that were written while they switched

    def write(self, name: str, value: int, at: int) -> None:
        """A write whose address and data are on the bus at clock ``at``; one at a time, in their order."""
        if at < self.clock or (self._writes and at < self._writes[-1][0]):
            raise ValueError(f"{name} is written at clock {at}, too late or out of order")
        self._writes.append((at + BUS, name, value))

    def advance(self, pins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A clock for each row of ``pins`` (columns PINS): (rows of SEEN, rows of STATUS), as each clock left them."""
        seen = np.zeros((len(pins), len(self.seen_names)), np.int64)
        status = np.zeros((len(pins), len(self.status_names)), np.int64)
        at = 0
        while at < len(pins):
            waits = self._take_writes()
            stops = [when - self.clock for when, *_ in (*self._writes, *self._taken) if when > self.clock]
            length = min([len(pins) - at, *stops])
            part = slice(at, at + length)
            inputs = rows_of(self.inputs, self._due, self.clock, length)
            self.state, made, entered, wires = self._run(inputs, pins[part], waits, seen[part], status[part])
            self._ran = wires.running
            references = [self.registers.values[name] for name in REFERENCES]
            self.clock += made
            at += made
            self._take_due()
            if entered:
                self._enter(wires, references)
        return seen, status

    def _run(self, inputs: np.ndarray, pins: np.ndarray, waits: bool, seen: np.ndarray, status: np.ndarray):
        """Clocks as in ``run_clocks``."""
        return run_clocks(
            self.state, inputs, self._settings(), self._board(), pins, self.blocks.core.carrier_half,
            self.config, waits, seen, status,
        )  # fmt: skip

    def _settings(self) -> fluxproof.Registers:
        return self.registers.settings()

    def _board(self) -> BoardRegisters:
        def record(of, **parts):
            return of(**parts, **{name: self.registers.values.get(name, 0) for name in of._fields if name not in parts})

        position, converters = record(position_front.Registers), record(current_front.Registers)
        master = record(master_encoder.Registers)
        return record(BoardRegisters, position=position, master=master, converters=converters)

    def _take_due(self) -> None:
        """Results of a sample and registers that change with the clock that has passed."""
        self.inputs, self._due = arrive(self.inputs, self._due, self.clock)
        taken, self._taken = self._taken, [write for write in self._taken if write[0] > self.clock]
        for when, name, value in taken:
            if when > self.clock:
                continue
            if name == HOST_WRITE:  # one clock, the first in which the register holds what was written
                self.inputs = self.inputs._replace(host_write=value)
                self._taken += [(self.clock + 1, HOST_WRITE, 0)] * value
                continue
            register = self.registers.map[name]
            if self.registers.write(register.address, value & 0xFFFFFFFF) != OKAY:
                raise ValueError(f"{name} = {value} is refused")
            if register.kind is Kind.PULSE and value:
                self._taken.append((self.clock + 1, name, 0))
        values = self.registers.values
        self.inputs = self.inputs._replace(enable=values["enable"], clear_trip=values["clear_trip"])

    def _take_writes(self) -> bool:
        """Accepts writes whose registers change at the coming clock; True where one waits for the end of a sample."""
        while self._writes and self._writes[0][0] <= self.clock:
            _, name, value = self._writes[0]
            kind = self.registers.map[name].kind
            self._barred = kind is Kind.STILL and (self._barred or bool(self._ran))
            if kind in (Kind.SETTING, Kind.STILL) and self.state.of_core.sample_busy:
                return True
            if self._barred:
                self._barred = False
                self.refused.append(name)
                self._writes.pop(0)
                continue
            self._taken += [(self.clock + 1, name, value), (self.clock + 1, HOST_WRITE, 1)]
            self._writes.pop(0)
        return False

    def _enter(self, w: Wires, references: list[int]) -> None:
        """The results of a sample that has entered with these wires, and their clocks; settings are those after it."""
        self.samples += 1
        values = self.registers.values
        sample = fluxproof.Sample(w.adc_a, w.adc_b, w.adc_c, w.adc_u_dc, w.position_code, *references, run=w.running)
        gates = self.state.of_core.of_gate_generation
        registers = self._settings()._replace(
            min_pulse=gates.min_pulse,
            double_update=gates.double_update,
            gear_code=w.master_code if self.blocks.master else values["gear_code"],
            omega_given=w.omega_now,
            speed_given=w.speed_now,
            position_restart=1 if values["position_restart"] or w.position_restart else 0,
            emf_samples=0 if w.forced else values["emf_samples"],
            residual_samples=0 if w.forced else values["residual_samples"],
        )
        self.of_samples, observed = fluxproof.step(self.of_samples, sample, registers, self.blocks.core)
        self.observed = observed
        del self.history[self.samples - 1 :], self.strobes[self.samples - 1 :]  # of a clock that is made again
        self.strobes.append(self.clock - 1)
        self.history.append((sample, observed))
        for after, names in clocked.DUE.values():
            self._due.append((self.clock - 1 + after, {name: getattr(observed, name) for name in names}))
