# SPDX-License-Identifier: BSD-3-Clause
"""Faults of a board at its pins, without a motor: each front end's fault, what is ignored, the lost host, the trip pin.

The pins follow a script, so that every wire from a fault to the gates is used once: a fault that is not ignored turns
the gates off, an ignored one does not, and the wrong one in its place does the opposite.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fluxproof.checkout import DRIVES
from fluxproof.cosim.board_clock import PINS, STATUS, BoardClock, GoldenBlocks
from golden_model.board_registers import board_generics, board_registers
from golden_model.converters.sinc_overcurrent import TOTAL
from golden_model.drive import Drive, load, with_carrier
from golden_model.fluxproof import REGISTERS
from golden_model.formats import PU
from golden_model.front_ends import Converters, Encoder
from golden_model.generated.register_names import ADDRESSES
from golden_model.io.fault_latch import NAMES
from golden_model.io.register_map import Kind
from golden_model.registers import registers

SLOT = 70  # clocks between two accesses: a setting waits for the end of a sample
Steps = Sequence[tuple[dict[str, int], int]]
WRITE = ("s_axi_awaddr", "s_axi_wdata", "s_axi_awvalid", "s_axi_wvalid")
READ = ("s_axi_araddr", "s_axi_arvalid")
WATCHED = ("fault_flags", "first_fault", "board_flags", "board_first", "irq_cause")
INDEX, LOST, OVER, NO_INDEX, HALL = 1, 2, 4, 8, 16  # bits of board_ignore
CURRENT = PU.to_int(0.05)  # the voltage that a regulator without a motor asks for grows, and the duties with it
HEARTBEAT = 3  # periods
LENGTHS = (32, 31, 30, 29, 27, 25, 23, 22, 21, 19, 17, 13)  # of the fast overcurrent's filter, in bits
BITS = 30, 400  # clocks of a period between which the line of the encoder is 0: a frame has ended, the next begins at 1
OFFSET_SAMPLES = 70  # periods with the gates off until the zero of the sensors is judged
AGAINST = -1000  # omega_ref against the turning shaft
FILTERED = 3  # clocks: a pulse of so many at the pin trip has no effect where it is filtered


def serial_and_modulators() -> Drive:
    """An SSI encoder that never answers, and delta-sigma modulators, the trip pin filtered; 480 clocks a period."""
    drive = with_carrier(load(DRIVES / "spindle_400v.toml"), 240)
    clock = drive.core.clock_hz
    return replace(
        drive,
        encoder=Encoder("ssi", bits=8, clock_hz=clock / 8, crc=False),
        converters=Converters("delta_sigma", clock_hz=clock / 4, oversampling=32, round_trip_s=2.0 / clock),
        core=replace(drive.core, estimators=False, trip_filter_s=FILTERED / clock),
    )


def edges() -> Drive:
    """An A/B/Z encoder of 16 counts, codes from elsewhere; 160 clocks a period."""
    drive = with_carrier(load(DRIVES / "spindle_400v.toml"), 80)
    return replace(
        drive,
        encoder=Encoder("abz", counts=16, filter_s=0.0),
        converters=Converters(),
        core=replace(drive.core, estimators=False),
    )


@dataclass
class Chunk:
    """A period: inputs by the names of the pins, what the golden board shows (columns SEEN, STATUS); no motor turns.

    ``reads``: clock at which a read is on the bus, its word, for registers that do not change in the period.
    """

    inputs: dict[str, np.ndarray]
    seen: np.ndarray
    status: np.ndarray
    omega_m: float
    number: int
    reads: list[tuple[int, int]]


class FaultRun:
    """As a BoardLoop runs: ``script`` is {period after the settings: {register: value}}, ``pins`` make the pins.

    ``patient`` goes on behind it, for who has the time: (writes, periods that follow without a write) in turn.
    """

    def __init__(self, drive: Drive, script: dict[int, dict[str, int]], pins, patient: Steps = ()):
        self.drive, self.pins = drive, pins
        self.short = at = max(script) + 2
        self.script = dict(script)
        for writes, idle in patient:
            self.script[at] = writes
            at += 1 + idle
        self.long = at
        self.clock_hz = round(drive.core.clock_hz)
        config = registers(drive).config
        self.blocks = GoldenBlocks(config, trip_filter=drive.core.trip_filter_clocks, **board_generics(drive))
        self.golden = BoardClock(self.blocks, self.clock_hz)
        self.length = 2 * config.carrier_half
        ignored = REGISTERS["fault_ignore"].high & ~(1 << NAMES.index("trip") | 1 << NAMES.index("host_lost"))
        values = board_registers(drive) | {"fault_ignore": ignored, "board_ignore": LOST, "irq_mask": 0}
        self.queue = [(name, value) for name, value in values.items() if value]
        self.per_period = self.length // SLOT
        self.readable = list(self.golden.registers.map)  # read after the script, in this order
        self.shown: dict[str, int] = {}
        self.settled = -(-len(self.queue) // self.per_period)

    @property
    def periods(self) -> int:
        """Settings and script."""
        return self.settled + self.short

    @property
    def with_reads(self) -> int:
        """The same, what is for the patient, then every register read once."""
        return self.settled + self.long + -(-len(self.readable) // self.per_period)

    def generics(self) -> dict[str, int]:
        """Of the VHDL."""
        return self.blocks.generics(self.clock_hz)

    def run(self, periods: int) -> Iterator[Chunk]:
        """Period by period, from the first clock without reset."""
        for k in range(periods):
            batch = dict(self.queue[k * self.per_period : (k + 1) * self.per_period])
            batch = batch or self.script.get(k - self.settled, {})
            bus = {name: np.zeros(self.length, np.int64) for name in (*WRITE, *READ)}
            begin, before = self.golden.clock, self._words()
            for n, (name, value) in enumerate(batch.items()):
                at = n * SLOT
                self.golden.write(name, value, begin + at)
                bus["s_axi_awvalid"][at : at + 2] = bus["s_axi_wvalid"][at : at + 2] = 1
                bus["s_axi_awaddr"][at : at + 2] = ADDRESSES[name]
                bus["s_axi_wdata"][at : at + 2] = value & 0xFFFFFFFF
            inputs = {name: np.zeros(self.length, np.int64) for name in PINS}
            self.pins(inputs, np.arange(begin, begin + self.length), k - self.settled)
            rows = np.stack([inputs[name] for name in PINS], axis=1)
            names = self._read_in(k, batch)
            for n, name in enumerate(names):
                at = n * SLOT
                bus["s_axi_arvalid"][at : at + 2] = 1
                bus["s_axi_araddr"][at : at + 2] = ADDRESSES[name]
            seen, status = self.golden.advance(rows)
            self.shown = dict(zip(STATUS, status[-1].tolist(), strict=True))
            after = self._words()
            reads = [
                (n * SLOT, after[name])
                for n, name in enumerate(names)
                if name in after and after[name] == before.get(name)
            ]
            yield Chunk(inputs | bus, seen, status, 0.0, k, reads)

    def _read_in(self, k: int, batch: dict[str, int]) -> list[str]:
        """Registers read in period ``k``: those of faults while the script is silent, after it each one once."""
        if (read := k - self.settled - self.long) >= 0:
            return self.readable[read * self.per_period :][: self.per_period]
        turn = k * self.per_period % len(WATCHED)
        return [] if batch or k < self.settled else [*WATCHED, *WATCHED][turn : turn + self.per_period]

    def _words(self) -> dict[str, int]:
        return words(self.golden, self.shown)


def words(golden: BoardClock, shown: dict[str, int]) -> dict[str, int]:
    """What a read of each register would answer now, of those that the golden top knows; ``shown``: its STATUS."""
    file, latch = golden.registers, golden.state.of_core.of_fault_latch
    known = shown | {"fault_flags": latch.flags, "first_fault": latch.first}
    known["irq_cause"] = golden.state.of_interrupts.causes
    if golden.observed is not None:
        known |= golden.observed._asdict()
    file.status |= known
    return {
        name: file.read(register.address)[1]
        for name, register in file.map.items()
        if register.kind in (Kind.SETTING, Kind.STILL, Kind.COMMAND)
        or all(field.name in known for field in register.fields)
    }


STARTED = {0: {"irq_clear": 15, "clear_trip": 1}, 1: {"enable": 1}, 2: {"i_q_ext": CURRENT}}


def cleared(at: int, **more: int) -> dict[int, dict[str, int]]:
    """The board's fault goes with the first write, the core's, which the board kept up until then, with the second."""
    return {at: {"clear_trip": 1, **more}, at + 1: {"clear_trip": 1, "irq_clear": 15}}


def host_and_pin(first: int) -> dict[int, dict[str, int]]:
    """The host is silent for longer than the heartbeat and comes back; then the trip pin, and each cause of irq."""
    back = first + HEARTBEAT + 3
    return {
        first: {"heartbeat": HEARTBEAT},
        **cleared(back),
        **{back + k: {"i_q_ext": CURRENT + k} for k in (2, 4, 6)},
        back + 7: {"heartbeat": 0},
        **{back + 10 + k: {"irq_mask": mask} for k, mask in enumerate((14, 13, 11, 7, 15, 0))},
        back + 17: {"clear_trip": 1, "irq_clear": 15},
        back + 19: {"take_snapshot": 1},
    }


def each_fault(drive: Drive, idle: int, rail: bool = False) -> list[tuple[dict[str, int], int]]:
    """Each fault of the core that settings can make, alone not ignored; then made no longer, and cleared."""
    usual, most = board_registers(drive), {name: port.high for name, port in REGISTERS.items()}
    none = {"i_trip": 0, "sum_trip": 0, "u_dc_max": 0, "jump_max": 0, "omega_trip": 0}
    stalled = {"way_stall": most["way_stall"], "stall_samples": 1, "i_max": 0, "speed_mode": 1}
    made = {
        "overcurrent": ("i_trip",),
        "current_sum": ("sum_trip",),
        "u_dc_low": {"u_dc_min": most["u_dc_min"]},
        "u_dc_high": ("u_dc_max",),
        "position": ("jump_max",),
        "watchdog": {"watchdog": SLOT},
        "overspeed": ("omega_trip",),
        "runaway": {"omega_away": 0, "runaway_samples": 1, "speed_mode": 1, "omega_ref": AGAINST},
        "stall": stalled,
        "open_load": stalled | {"i_open": most["i_open"]},
        "encoder_lost": {"emf_min": 0, "emf_i": 0, "emf_w": 0, "emf_samples": 1},
        "current_offset": {"enable": 0, "offset_max": 0, "omega_stall": most["omega_stall"]},
    }
    steps: list[tuple[dict[str, int], int]] = []
    for name, writes in made.items():
        writes = writes if isinstance(writes, dict) else {n: none[n] for n in writes}
        back = {n: usual.get(n, 0) for n in writes if n not in ("enable",)}
        steps.append(({"fault_ignore": most["fault_ignore"] & ~(1 << NAMES.index(name))}, 0))
        steps += [({n: value}, 0) for n, value in writes.items()]
        steps[-1] = (steps[-1][0], OFFSET_SAMPLES if name == "current_offset" else idle)
        if name == "current_offset":
            steps.append(({"enable": 1}, idle))
        steps += [({n: value}, 0) for n, value in back.items()]
        steps += [({"clear_trip": 1}, 0), ({"clear_trip": 1}, idle), ({"irq_clear": 15}, idle)]
    return steps


def rail() -> Steps:
    """Codes at their end, which the pins make, alone not ignored."""
    every = REGISTERS["fault_ignore"].high
    return [({"fault_ignore": every & ~(1 << NAMES.index("at_rail"))}, 5), ({"fault_ignore": every}, 0)]


def each_limit() -> Steps:
    """The fast overcurrent with a stream of ones, whose total is oversampling**3: one above each limit, then at it.

    What a bit of a limit does shows where the total has this bit, or has it not: with enough lengths, both.
    """
    steps: list[tuple[dict[str, int], int]] = [({"board_ignore": LOST | OVER | NO_INDEX | HALL}, 0)]
    none, most = {"irq_mask": 0, "heartbeat": 0}, TOTAL.hi  # writes that give the filter time before the clear
    for length in LENGTHS:
        total = length**3
        steps += [({"trip_oversampling": length, "limit_high": most, "limit_low": 0}, 1)]
        steps += [({"limit_high": total + 1, "limit_low": total - 1, **none, "clear_trip": 1}, 1)]
        steps += [({"limit_high": total}, 1), ({"limit_high": total + 1, **none, "clear_trip": 1}, 0)]
        steps += [({"limit_low": total}, 1)]
    return [*steps, ({"limit_high": most, "limit_low": 0, **none, "clear_trip": 1}, 1)]


def each_mask(usual: dict[str, int]) -> Steps:
    """Each cause of the interrupt with every mask, and cleared by every bit that is not its own."""
    alone = {
        0: [({"enable": 0}, 0), ({"fault_ignore": 0, "watchdog": SLOT}, 2), ({"watchdog": usual["watchdog"]}, 1)],
        1: [
            ({"fault_ignore": REGISTERS["fault_ignore"].high, "enable": 1}, 0),
            ({"clear_trip": 1}, 1),
            ({"i_trip": 0}, 1),
        ],
        2: [({"i_trip": usual["i_trip"], "enable": 0}, 1), ({"min_pulse": 0}, 1)],
        3: [({"min_pulse": usual["min_pulse"]}, 1), ({"clear_trip": 1, "enable": 1}, 2), ({"enable": 0}, 1)],
    }
    steps: list[tuple[dict[str, int], int]] = []
    for cause, made in alone.items():
        steps += [*made, ({"irq_clear": 31 & ~(1 << cause)}, 1)]
        steps += [({"irq_mask": mask}, 0) for mask in range(32)]
        steps += [({"irq_mask": 0}, 0), *(({"irq_clear": 1 << k}, 1) for k in range(5) if k != cause)]
    return [*steps, ({"irq_clear": 31, "enable": 1}, 1), ({"clear_trip": 1}, 1)]


def serial_run() -> FaultRun:
    """position_lost is there all the time, a modulator's overcurrent comes and goes; limits are met by both signs."""
    script = {
        **STARTED,
        **cleared(6),
        8: {"board_ignore": LOST | OVER},
        11: {"board_ignore": LOST | INDEX},
        **cleared(12),
        **cleared(15),
        17: {"board_ignore": OVER | INDEX},
        **cleared(18, board_ignore=LOST),
        **host_and_pin(20),
        **cleared(50),
    }
    high, low = {4: 0, 9: 1, 14: 2}, {48: 1}  # period: phase whose stream is at its end

    def pins(inputs: dict[str, np.ndarray], clocks: np.ndarray, k: int) -> None:
        bits = np.tile((clocks // 4 % 2)[:, None], 4)  # half of the bits: no current, half of the bus range
        for phases, level in ((high, 1), (low, 0)):
            if k in phases:
                bits[100:300, phases[k]] = level
        if k in all_ones:
            bits[:] = 1  # the bus as well: the brake resistor is on
        inputs["mod_data"][:] = bits @ (1 << np.arange(4))
        # A frame is good where the line is 1 at its begin and 0 at its end
        at_clock = clocks % len(clocks)
        inputs["serial_data"][:] = ((at_clock < BITS[0]) | (at_clock >= BITS[1])) & (k >= answers)
        at = 20 + HEARTBEAT + 9
        inputs["trip"][200 : 200 + FILTERED] = at <= k < at + 2
        inputs["trip"][220 : 221 + FILTERED] = k == at + 2

    drive = serial_and_modulators()
    lost: Steps = [({"board_ignore": OVER}, 2), ({"board_ignore": LOST | OVER}, 0), ({"clear_trip": 1}, 1)]
    limits = [*each_limit(), *rail(), *lost, ({"trip_oversampling": board_registers(drive)["trip_oversampling"]}, 2)]
    known: Steps = [
        ({"clear_encoder": 1, "clear_trip": 1}, 1),
        ({"board_ignore": LOST}, 1), ({"clear_trip": 1}, 2), ({"board_ignore": 0}, 2),
        ({"board_ignore": OVER}, 0), ({"limit_high": 0}, 1), ({"limit_high": TOTAL.hi}, 1), ({"clear_trip": 1}, 0),
        # Frames longer than a period, then codes that come later than the position
        ({"half_period": 40}, 4), ({"half_period": board_registers(drive)["half_period"]}, 2),
        ({"oversampling": 64}, 3), ({"oversampling": board_registers(drive)["oversampling"]}, 2),
        ({"board_ignore": LOST | OVER}, 1), ({"clear_encoder": 1}, 1), ({"clear_trip": 1}, 1),
    ]  # fmt: skip
    patient = [*limits, *known, *each_fault(drive, 1), *each_mask(board_registers(drive))]
    begin = max(script) + 2
    all_ones = range(begin, begin + sum(1 + idle for _, idle in limits))
    answers = all_ones.stop - 2
    return FaultRun(drive, script, pins, patient)


def edges_run() -> FaultRun:
    """The shaft turns by a count in 16 clocks; Z is at one place for the first index, at another for the next."""
    script = {
        **STARTED,
        3: {"board_ignore": LOST | OVER},
        10: {"clear_encoder": 1},
        **cleared(11),
        14: {"board_ignore": INDEX},
        **cleared(15),  # the first clear found the index unknown: the gates run again before the host is silent
        **host_and_pin(20),
    }

    def pins(inputs: dict[str, np.ndarray], clocks: np.ndarray, k: int) -> None:
        count = np.minimum(clocks, stands) // 16
        inputs["pin_a"][:] = (count % 4 == 1) | (count % 4 == 2)
        inputs["pin_b"][:] = (count % 4 == 2) | (count % 4 == 3)
        place = 8 if 6 <= k < 9 or k >= 16 else 0
        inputs["pin_z"][:] = count % 16 == place
        # Once the codes come after the position, once there are none
        at = (60 if k == begin + 9 else 5) + np.arange(len(clocks) // 160 * (k != begin + 11)) * 160
        inputs["codes_valid_in"][at] = 1
        for name in ("code_b_in", "code_c_in"):
            inputs[name][:] = 1 << 15
        inputs["code_a_in"][:] = (1 << 16) - 1 if begin <= k < begin + 6 else 1 << 15
        inputs["code_u_dc_in"][:] = 46000 if k in (29, 30) else 1 << 15  # 702 V: the brake resistor is on
        inputs["trip"][70:71] = k in (20 + HEARTBEAT + 11, tripped)

    begin, usual = max(script) + 2, board_registers(edges())
    unknown: Steps = [
        ({"board_ignore": INDEX | NO_INDEX}, 0), ({"clear_encoder": 1}, 1), ({"clear_trip": 1}, 2),
        ({"board_ignore": INDEX | NO_INDEX | HALL}, 2), ({"board_ignore": INDEX}, 3),
        ({"board_ignore": INDEX | NO_INDEX}, 0), ({"clear_trip": 1}, 1),
    ]  # fmt: skip
    # Then the pin alone, the first of all faults, read while it stands
    alone = REGISTERS["fault_ignore"].high & ~(1 << NAMES.index("trip"))
    pin: Steps = [({"fault_ignore": alone, "clear_trip": 1}, 1), ({"clear_trip": 1}, 1), ({"irq_clear": 15}, 8)]
    patient = [*rail(), ({"clear_trip": 1}, 7), *each_fault(edges(), 3), *each_mask(usual), *unknown]
    tripped = begin + sum(1 + idle for _, idle in patient) + 5
    run = FaultRun(edges(), script, pins, [*patient, *pin, ({"clear_trip": 1}, 1)])
    stands = run.periods * run.length  # clock from which the shaft stands
    return run
