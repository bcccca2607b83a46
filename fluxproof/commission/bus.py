# SPDX-License-Identifier: BSD-3-Clause
"""Registers by name: the protocol that commissioning speaks, and the window of a Zynq through userspace I/O.

A snapshot is one sample of the core: the codes of sensors and encoder, kept by ``take_snapshot``, and the currents,
voltages and angles computed from it.  The latter are read one by one within the same PWM period; theta_me before and
after them, and the kept position code, show whether a new sample came in between.  Then it is taken again.
"""

from __future__ import annotations

import mmap
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np

from golden_model.drive_keys import DriveError
from golden_model.io import board_map, position
from golden_model.io.register_map import IDENTIFICATION, Kind

CODES = ("snap_code", "snap_position", "snap_adc_a", "snap_adc_b", "snap_adc_c", "snap_adc_u_dc")
VALUES = ("i_d", "i_q", "omega_me", "u_dc", "u_d", "u_q")  # the voltages last: they are computed last
WINDOW = 4096  # bytes
RUNNING = 1 << 0  # of the register flags
ATTEMPTS, POLLS = 200, 10000


class BusError(Exception):
    """The core did not answer as the register map says; one line."""


class Bus(Protocol):
    """What commissioning needs of a board."""

    def read(self, name: str) -> int:
        """The integer in a register."""
        ...

    def write(self, name: str, value: int) -> None:
        """Set a register; BusError where its range does not hold the value, or where the gates have to be off."""
        ...

    def snapshot(self) -> dict[str, int]:
        """CODES, VALUES and theta_me of one sample, not of the one that follows the last snapshot."""
        ...

    def wait(self, seconds: float) -> None:
        """Let the drive run."""
        ...

    def now(self) -> float:
        """Seconds since any moment."""
        ...


def checked(registers, name: str, value: int, running: Callable[[], bool]) -> int:
    """The address of a register that takes the value; BusError for any other, and for a still setting while the gates
    switch: the core would refuse it, which ends a process through userspace I/O.
    """
    register = registers.get(name)
    if register is None or not register.kind.writable:
        raise BusError(f"{name} is not a register that can be written")
    if not register.port.low <= value <= register.port.high:
        raise BusError(f"{name} = {value} is out of range: {register.port.low} to {register.port.high}")
    if register.kind is Kind.STILL and running():
        raise BusError(f"{name} is taken while the gates are off alone: enable = 0 before")
    return register.address


class UioBus:
    """The 4 KiB of a fluxproof_board, mapped from /dev/uioN (or from a file of that size)."""

    def __init__(self, path: str | Path):
        self.registers = board_map.registers()
        self.clock, self.sleep = time.monotonic, time.sleep
        try:
            handle = os.open(path, os.O_RDWR | os.O_SYNC)
            try:
                self._memory = mmap.mmap(handle, WINDOW)
            finally:
                os.close(handle)
        except ValueError:
            raise DriveError(f"{path}: is not the {WINDOW} bytes of a core's registers: allowed is /dev/uioN") from None
        except OSError as error:
            raise DriveError(f"{path}: cannot be mapped: {error.strerror or error}") from None
        self._words = np.frombuffer(self._memory, np.uint32)
        self._signed = np.frombuffer(self._memory, np.int32)
        if (found := self.read("identification")) != IDENTIFICATION:
            raise DriveError(f"{path}: no Fluxproof core here: identification is {found:#010x}")

    def read(self, name: str) -> int:
        register = self.registers[name]
        words = self._signed if register.port.fmt.signed else self._words
        return int(words[register.address // 4])

    def write(self, name: str, value: int) -> None:
        address = checked(self.registers, name, value, lambda: bool(self.read("flags") & RUNNING))
        self._words[address // 4] = value & 0xFFFFFFFF

    def snapshot(self) -> dict[str, int]:
        for _ in range(ATTEMPTS):
            self.write("take_snapshot", 1)
            for _ in range(POLLS):
                if self.read("snap_ready"):
                    break
            else:
                raise BusError("snap_ready stays 0: no samples, the converters or the position do not answer")
            before = self.read("theta_me")
            seen = {name: self.read(name) for name in (*CODES, *VALUES)}
            if self.read("theta_me") == before == self._angle(seen["snap_position"]):
                return seen | {"theta_me": before}
        raise BusError(f"no snapshot within one sample in {ATTEMPTS} attempts: the host is too slow for this PWM")

    def _angle(self, code: int) -> int:
        r = self.read
        (theta,) = position.step.py_func(code, r("reverse"), r("pole_pairs"), r("theta_offset"), r("position_bits"))
        return theta

    def wait(self, seconds: float) -> None:
        self.sleep(seconds)

    def now(self) -> float:
        return self.clock()
