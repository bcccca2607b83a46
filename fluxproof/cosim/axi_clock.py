# SPDX-License-Identifier: BSD-3-Clause
"""The golden fluxproof_axi clock by clock: codes and strobe in, pins out; registers and samples as in board_clock.

The front ends are missing, so that nothing but the pin stops the core and ``clear_trip`` reaches it at once; what
enters with ``sample_valid`` are the codes at the pins (rtl/generated/fluxproof_axi.vhd).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fluxproof.cosim.board_clock import BoardClock, GoldenBlocks, State, Wires, core_clock
from fluxproof.cosim.golden_clock import inputs_of
from golden_model.generated.register_names import ADDRESSES
from golden_model.io import register_map
from golden_model.kernel import kernel

PINS = ("sample_valid", "adc_a", "adc_b", "adc_c", "adc_u_dc", "position_code", "trip")
SEEN = ("gate_high", "gate_low", "sample_trigger", "irq", "brake")
CODES = PINS[1:-1]
NAMES = {address: name for name, address in ADDRESSES.items()}
NO_SPEED = "speed_given"  # there are no edges here: the speed is that of the code


class Write(NamedTuple):
    """A write on the bus from this clock of a stretch on."""

    at: int
    name: str
    value: int


def bus_of(writes: Sequence[Write], length: int) -> dict[str, np.ndarray]:
    """The inputs of AXI4-Lite in ``length`` clocks."""
    bus = {name: np.zeros(length, np.int64) for name in ("awaddr", "wdata", "awvalid", "wvalid")}
    for at, name, value in writes:
        part = slice(at, at + 2)
        bus["awvalid"][part] = bus["wvalid"][part] = 1
        bus["awaddr"][part], bus["wdata"][part] = ADDRESSES[name], value & 0xFFFFFFFF
    return {f"s_axi_{name}": values for name, values in bus.items()}


def accesses(inputs: Mapping[str, np.ndarray], kind: str) -> list[int]:
    """Clocks at which an access is first on the bus; ``kind``: aw for a write, ar for a read."""
    return [int(k) for k in np.flatnonzero(np.diff(inputs[f"s_axi_{kind}valid"], prepend=0) == 1)]


def writes_in(inputs: Mapping[str, np.ndarray]) -> list[Write]:
    """The writes among inputs of AXI4-Lite."""
    found = [(k, int(inputs["s_axi_awaddr"][k]), int(inputs["s_axi_wdata"][k])) for k in accesses(inputs, "aw")]
    return [Write(k, NAMES[address], word) for k, address, word in found]


@kernel
def one_clock(state, inputs, regs, b, pins, carrier_half, trip_filter):
    """(next state, the wires that a sample enters with, whether one has entered, what the core shows, gates off)."""
    s, w, p = state, state.wires, pins
    # numba wants every field: those of the front ends stay 0
    given = Wires(
        trigger=w.trigger, gate_high=w.gate_high, gate_low=w.gate_low, sample_valid=p[0], codes_done=0, adc_a=p[1],
        adc_b=p[2], adc_c=p[3], adc_u_dc=p[4], encoder_code=0, encoder_restart=0, master_code=0,
        omega_now=b.omega_given,
        position_done=0, encoder_count=0, encoder_flags=0, index_wrong=0, position_lost=0, converter_over=0,
        angle_unknown=0, hall_wrong=0, forced=0, position_code=p[5], position_restart=0, speed_now=b.speed_given,
        board_stop=0, core_clear=0, running=w.running, tripped=w.tripped, fault_flags=w.fault_flags,
        setting_refused=w.setting_refused, irq=w.irq,
    )  # fmt: skip
    now = State(
        of_core=s.of_core, of_position=s.of_position, of_master=s.of_master,
        of_converters=s.of_converters, of_forcing=s.of_forcing,
        of_join=s.of_join, of_faults=s.of_faults, of_snapshot=s.of_snapshot, of_interrupts=s.of_interrupts,
        of_filter=s.of_filter, caught=s.caught, trip_1=s.trip_1, trip_2=s.trip_2, wires=given,
    )  # fmt: skip
    core, causes, stage, entered, z, irq, off = core_clock(
        now, inputs, regs, (b.irq_mask, b.irq_clear), (0, inputs.clear_trip, p[6]), carrier_half, trip_filter
    )
    wires = Wires(
        trigger=z.sample_trigger, gate_high=z.gate_high, gate_low=z.gate_low, sample_valid=0, codes_done=0, adc_a=0,
        adc_b=0, adc_c=0, adc_u_dc=0, encoder_code=0, encoder_restart=0,
        master_code=0, omega_now=0, position_done=0,
        encoder_count=0, encoder_flags=0, index_wrong=0, position_lost=0, converter_over=0, angle_unknown=0,
        hall_wrong=0, forced=0, position_code=0, position_restart=0, speed_now=0, board_stop=0, core_clear=0,
        running=z.running, tripped=z.tripped, fault_flags=z.fault_flags, setting_refused=z.setting_refused, irq=irq,
    )  # fmt: skip
    following = State(
        of_core=core, of_position=s.of_position, of_master=s.of_master,
        of_converters=s.of_converters, of_forcing=s.of_forcing,
        of_join=s.of_join, of_faults=s.of_faults, of_snapshot=s.of_snapshot, of_interrupts=causes,
        of_filter=stage[0], caught=stage[1], trip_1=stage[2], trip_2=s.trip_1, wires=wires,
    )  # fmt: skip
    return following, given, entered, z, off


@kernel
def run_clocks(state, inputs, regs, b, pins, carrier_half, trip_filter, until_idle, seen):
    """As that of board_clock."""
    given = state.wires
    entered = 0
    for k in range(len(pins)):
        if k > 0 and until_idle and not state.of_core.sample_busy:
            return state, k, 0, given
        state, given, entered, core, off = one_clock(
            state, inputs_of(inputs[k]), regs, b, pins[k], carrier_half, trip_filter
        )
        x = seen[k]
        x[0], x[1] = 0 if off else given.gate_high, 0 if off else given.gate_low
        x[2], x[3], x[4] = given.trigger, state.wires.irq, core.brake
        if entered:
            return state, k + 1, entered, given
    return state, len(pins), entered, given


class AxiClock(BoardClock):
    """One golden fluxproof_axi after its reset: ``advance`` takes columns PINS and gives rows of SEEN."""

    seen_names, status_names = SEEN, ()

    def __init__(self, blocks: GoldenBlocks, clock_hz: int):
        super().__init__(blocks, clock_hz)
        self.registers.map = register_map.registers()
        self.registers.at = {register.address: register for register in self.registers.map.values()}
        self.registers.reset()

    def generics(self) -> dict[str, int]:
        """By the names of the VHDL."""
        generics = self.blocks.generics(self.clock_hz)
        own = ("ENCODER", "CURRENTS", "SPI_LINES", "MASTER")
        return {name: value for name, value in generics.items() if name not in own}

    def beside(
        self, board: BoardClock, writes: Sequence[Write], trip: np.ndarray
    ) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """(inputs, rows of SEEN) for the clocks that ``board`` has just made, with its samples, writes and trip pin."""
        begin, length = self.clock, len(trip)
        known = [w for w in writes if w.name in self.registers.map and w.name != NO_SPEED]
        for at, name, value in known:
            self.write(name, value, begin + at)
        given = {name: np.zeros(length, np.int64) for name in PINS} | {"trip": trip}
        for clock, (sample, _) in zip(board.strobes[::-1], board.history[::-1], strict=True):
            if clock < begin:
                break
            given["sample_valid"][clock - begin] = 1
            for name in CODES:
                given[name][clock - begin] = getattr(sample, name)
        seen, _ = self.advance(np.stack([given[name] for name in PINS], axis=1))
        return given | bus_of(known, length), seen

    def _run(self, inputs: np.ndarray, pins: np.ndarray, waits: bool, seen: np.ndarray, status: np.ndarray):
        del status  # no front ends, whose registers it would hold
        return run_clocks(
            self.state, inputs, self._settings(), self._board(), pins, self.blocks.core.carrier_half,
            self.blocks.trip_filter, waits, seen,
        )  # fmt: skip
