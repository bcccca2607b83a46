# SPDX-License-Identifier: BSD-3-Clause
"""A board for software to run on: a drive with its motor, reached as docs/software/fluxproof_bus.h has it, over pipes.

What is on it, the golden model or the RTL, comes in the classes below; time runs only while software waits.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
from pathlib import Path

from fluxproof.cosim.driven_plant import build_plant
from fluxproof.plant import sensor_params
from fluxproof.plant.sensors import current_code, position_code, u_dc_code
from golden_model.io import register_map


class Board:
    """Motor, inverter and converters.  ``trip_at``: second at which the trip pin is high for a period.

    ``signal``: (second, number of a signal) that the program gets then.
    """

    signal: tuple[float, int] | None = None

    def __init__(self, drive, trip_at: float | None = None):
        self.drive, self.trip_at = drive, trip_at
        self.plant, sensors = build_plant(drive)
        self.codes = sensor_params(sensors)
        self.period_s = drive.sample_time_s  # from one sample_trigger to the next
        self.u_dc = drive.inverter.dc_bus_v
        self.time, self.number = 0.0, 0
        self.speeds: list[float] = []  # of the shaft, rad/s, before each period
        self.gate_word = 0

    def write(self, address: int, word: int) -> int:
        """A write on the bus; returns the AXI response."""
        raise NotImplementedError

    def read(self, address: int) -> tuple[int, int]:
        """A read on the bus: (response, word)."""
        raise NotImplementedError

    def period(self, codes: dict[str, int], tripping: bool) -> None:
        """From one sample_trigger to the next; leaves gate_word, advances the plant and time."""
        raise NotImplementedError

    def raw_sample(self) -> dict[str, int]:
        """The present codes of the converters, by the names of the pins."""
        return {
            **{
                f"adc_{x}": int(current_code(self.codes, n, self.plant.i_abc[n], self.number))
                for n, x in enumerate("abc")
            },
            "adc_u_dc": int(u_dc_code(self.codes, self.u_dc, self.number)),
            "position_code": int(position_code(self.codes, self.plant.theta_m, self.number)),
        }

    def run_period(self) -> None:
        """One period with the codes of now."""
        self.speeds.append(self.plant.omega_m)
        tripping = self.trip_at is not None and self.trip_at <= self.time < self.trip_at + self.period_s
        self.period(self.raw_sample(), tripping)
        self.number += 1

    def advance(self, times, words, seconds: float) -> None:
        """The plant follows the gates."""
        self.plant.advance(times, words, self.u_dc, 0.0, seconds)
        self.time += seconds

    def answer(self, request: str) -> str:
        """One request of bus_pipe.c."""
        kind, *texts = request.split()
        numbers = [int(text, 16) for text in texts]
        if kind == "t":
            for _ in range(round(numbers[0] * 1e-6 / self.period_s)):
                self.run_period()
                if self.signal and self.time >= self.signal[0]:
                    self.running.send_signal(self.signal[1])
                    self.signal = None
            return "ok"
        if kind == "w":
            return "ok" if self.write(*numbers) == register_map.OKAY else "error"
        response, word = self.read(*numbers)
        return f"{word:x}" if response == register_map.OKAY else "error"

    def run(self, program: Path, *arguments: str) -> subprocess.CompletedProcess:
        """``program`` with this board on its bus, until it ends."""
        to_program, from_program = os.pipe(), os.pipe()
        ends = (to_program[0], from_program[1])
        running = subprocess.Popen(
            [str(program), *arguments],
            pass_fds=ends,
            env={**os.environ, "FLUXPROOF_PIPES": f"{ends[0]},{ends[1]}"},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.running = running
        for end in ends:
            os.close(end)
        answers = os.fdopen(to_program[1], "w", buffering=1)
        with contextlib.suppress(BrokenPipeError), answers, os.fdopen(from_program[0]) as requests:
            for request in requests:
                answer = self.answer(request)
                with contextlib.suppress(BrokenPipeError):  # the program may have ended meanwhile
                    answers.write(answer + "\n")
        said, complained = running.communicate()
        return subprocess.CompletedProcess(program, running.returncode, said, complained)
