# SPDX-License-Identifier: BSD-3-Clause
"""A drive on the golden fluxproof_board, clock by clock: pins of A/B/Z or Hall sensors, codes of the converters, plant.

The shaft moves on within a period with the speed of its start; the codes of currents and bus are those of the trigger.
Encoders with a clock of their own become a code from elsewhere (golden_model.drive.with_carrier).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np

from fluxproof.cosim.axi_clock import Write
from fluxproof.cosim.board_clock import PINS, SEEN, BoardClock, GoldenBlocks
from fluxproof.cosim.driven_plant import build_plant
from fluxproof.plant import sensor_params
from fluxproof.plant.sensors import current_code, position_code, u_dc_code
from golden_model.board_registers import board_generics, board_registers
from golden_model.drive import Drive
from golden_model.drive_keys import needed
from golden_model.io import board_faults, fault_latch
from golden_model.registers import registers
from golden_model.units import TURN_RAD, from_si
from studies.rough.rtl import Beside

CODES_AT = 60  # clock of a period at which the codes are there
SLOT = 70  # clocks between two writes
LINE = 4.0  # counts of a line
TURN_BITS = {"pin_a": (1.0, 2.0), "pin_b": (2.0, 2.0)}  # count at which the line rises, and for how many it is 1


class RoughBoard:
    """``spoil(pins, board)`` changes the pins of a period in place; ``faults`` are those that tripped first.

    ``watched``: with each board goes its RTL, added to this list.
    """

    watched: ClassVar[list[Beside] | None] = None

    def __init__(self, drive: Drive, theta_m: float = 0.0, omega_m: float = 0.0):
        self.drive, self.clock_hz = drive, round(drive.core.clock_hz)
        self.set = registers(drive)
        blocks = GoldenBlocks(self.set.config, trip_filter=drive.core.trip_filter_clocks, **board_generics(drive))
        self.golden = BoardClock(blocks, self.clock_hz)
        self.plant, sensors = build_plant(drive, omega_m=omega_m)
        self.codes, self.place = sensor_params(sensors), theta_m  # of the encoder at the plant's zero [mechanical rad]
        self.length, self.period = 2 * self.set.config.carrier_half, 0
        self.spoil: Callable[[dict, RoughBoard], None] = lambda pins, board: None
        self.peak_a, self.gates_on, self.farthest = 0.0, 0, [0.0, 0.0]
        self.fault_period: int | None = None
        self.rtl = None if self.watched is None else Beside(self.golden)
        if self.watched is not None and self.rtl is not None:
            self.watched.append(self.rtl)
        lead = BoardClock(blocks, self.clock_hz).advance(np.zeros((4 * self.length, len(PINS)), np.int64))[0]
        self._clocks(int(np.flatnonzero(lead[:, SEEN.index("sample_trigger")])[0]) + 1)
        self.load(board_registers(drive))

    # ---------------------------------------------------------------- the host

    def load(self, values: dict[str, int]) -> None:
        """Every register that is not zero, as many a period as the bus takes."""
        writes, each = [(n, v) for n, v in values.items() if v], self.length // SLOT
        for at in range(0, len(writes), each):
            self.run(1, **dict(writes[at : at + each]))

    def run(self, periods: int, **writes: int) -> None:
        """Periods of PWM, the writes at the begin of the first."""
        batch = [Write(n * SLOT, name, value) for n, (name, value) in enumerate(writes.items())]
        for at, name, value in batch:
            self.golden.write(name, value, self.golden.clock + at)
        for k in range(periods):
            self._clocks(self.length, [] if k else batch)
            if self.fault_period is None and self.faults:
                self.fault_period = self.period
            self.period += 1

    def run_s(self, seconds: float, **writes: int) -> None:
        """The same for a time."""
        self.run(max(1, round(seconds / self.drive.sample_time_s)), **writes)

    def until_off(self, seconds: float) -> None:
        """At most this time, until the gates are tripped."""
        for _ in range(round(seconds / self.drive.sample_time_s)):
            if self.tripped:
                return
            self.run(1)

    def speed(self, part: float) -> int:
        """The register omega_ref of a part of the rated speed."""
        m = self.drive.machine
        return from_si("omega_ref", part * m.rated_speed_rad_s * m.pole_pairs, self.drive)

    # ---------------------------------------------------------------- what is seen

    @property
    def faults(self) -> list[str]:
        """What tripped first, by the names of core and board."""
        state = self.golden.state
        core, board = state.of_core.of_fault_latch.first, state.of_faults.first
        found = [n for k, n in enumerate(board_faults.NAMES) if board >> k & 1]
        return found + [n for k, n in enumerate(fault_latch.NAMES) if core >> k & 1 and not (n == "trip" and found)]

    @property
    def tripped(self) -> bool:
        return bool(self.golden.state.wires.tripped)

    @property
    def referenced(self) -> bool:
        return bool(self.golden.state.wires.encoder_flags & 1)

    # ---------------------------------------------------------------- clocks

    def _clocks(self, length: int, writes: Sequence[Write] = ()) -> None:
        omega, theta = float(self.plant.omega_m), float(self.plant.theta_m)
        angle = self.place + theta + omega * np.arange(length) / self.clock_hz
        pins = {name: np.zeros(length, np.int64) for name in PINS}
        self._encoder(pins, angle)
        valid = np.arange(length) == min(CODES_AT, length - 1)
        pins["codes_valid_in"] = valid.astype(np.int64)
        for n, x in enumerate("abc"):
            pins[f"code_{x}_in"][:] = current_code(self.codes, n, self.plant.i_abc[n], 0)
        pins["code_u_dc_in"][:] = u_dc_code(self.codes, self.drive.inverter.dc_bus_v, 0)
        self.spoil(pins, self)
        seen, _ = self.golden.advance(np.stack([pins[n] for n in PINS], axis=1))
        if self.rtl is not None:
            self.rtl.period(pins, writes, seen)
        words = seen[:, SEEN.index("gate_high")] + 8 * seen[:, SEEN.index("gate_low")]
        self.gates_on += int(np.count_nonzero(words))
        at = np.flatnonzero(np.diff(words, prepend=-1))
        seconds = length / self.clock_hz
        self.plant.advance(at / self.clock_hz, words[at], self.drive.inverter.dc_bus_v, 0.0, seconds)
        self.peak_a = max(self.peak_a, float(np.abs(self.plant.i_abc).max()))
        moved = float(self.plant.theta_m)
        self.farthest = [min(self.farthest[0], moved), max(self.farthest[1], moved)]

    def _encoder(self, pins: dict[str, np.ndarray], angle: np.ndarray) -> None:
        e, pairs = self.drive.encoder, self.drive.machine.pole_pairs
        if e.kind == "abz":
            counts = needed(e.counts)
            place = angle / TURN_RAD * counts
            for name, (rises, high) in TURN_BITS.items():
                pins[name] = ((place - rises) % LINE < high).astype(np.int64)
            pins["pin_z"] = (place % counts < 1.0).astype(np.int64)
        elif e.kind == "hall":
            turns = angle * pairs / TURN_RAD
            for k, x in enumerate("abc"):
                pins[f"hall_{x}"] = ((turns - k / 3) % 1.0 < 0.5).astype(np.int64)
        else:
            pins["position_in"][:] = position_code(self.codes, float(angle[0]), 0)
