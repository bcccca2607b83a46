# SPDX-License-Identifier: BSD-3-Clause
"""A board with the HIL top on it: the motor is in the RTL, so that time is clocks and nothing else moves."""

from __future__ import annotations

import math

import numpy as np

from cocotb_tests.support.host.rtl_board import RtlBoard
from fluxproof.hil.load import Word, load_words
from fluxproof.plant import Bus, Inverter, Machine, Sensors
from golden_model.formats import MOTOR_SPEED
from golden_model.io import motor_map
from golden_model.io.register_map import OKAY
from golden_model.motor.motor_model import STEP

PACKET = 200  # clocks from a trigger in which the packet of its sample ends


class HilBoard(RtlBoard):
    """``machine``, ``inverter``, ``sensors``: of the motor, and its ``bus``, loaded at the start."""

    top = "fluxproof_hil"

    def __init__(self, drive, machine: Machine, inverter: Inverter, sensors: Sensors, bus: Bus):
        super().__init__(drive)
        self.map = motor_map.registers()
        self.stream: list[np.ndarray] = []  # words of the telemetry
        self.buses: list[int] = []  # voltage of the bus, a value a period
        self.core.tick = self.listen
        self.load(load_words(drive, machine, inverter, sensors, bus))
        self.turn_rad_s = 2.0 * math.pi * drive.core.clock_hz / STEP * MOTOR_SPEED.lsb

    def load(self, words: list[Word]) -> None:
        for name, value in words:
            assert self.write(self.map[name].address, value & 0xFFFFFFFF) == OKAY, name

    def listen(self, n: int = 1) -> None:
        """``n`` clocks, whose telemetry is kept."""
        rows = self.core.trace(n, ("m_axis_tvalid", "m_axis_tdata"))
        self.stream.append(rows[rows[:, 0] == 1, 1])

    def capture(self) -> bytes:
        """The stream as a DMA leaves it in memory."""
        return np.concatenate(self.stream).astype("<u4").tobytes()

    def value(self, name: str) -> int:
        """A register of the motor."""
        word = self.read(self.map[name].address)[1]
        return word - (word >> 31 << 32) if self.map[name].port.fmt.signed else word

    def run_period(self) -> None:
        self.speeds.append(self.value("motor_omega_m") * self.turn_rad_s)
        self.buses.append(self.value("motor_u_bus"))
        self.listen(PACKET)
        spent = self.core.clock - self.began
        clocks, _, _ = self.core.run_period(self.limit)
        self.began = self.core.clock
        self.time += (spent + clocks) * self.clock_s
        self.gate_word = self.core.gate_word
        self.number += 1
