"""A board with the golden core on it: registers, gates at the clock, inverter, motor.  Software talks to it over pipes.

Two accesses and time, as software/fluxproof_bus.h has them; time runs only while software waits.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from golden_model import fluxproof
from golden_model.io import register_map
from golden_model.io.register_file import RegisterFile
from golden_model.registers import registers
from plant import sensor_params
from plant.sensors import current_code, position_code, u_dc_code
from scripts.cosim import FLAGS, INPUT_PORTS, GoldenPeriods, build_plant

REFERENCES = ("omega_ref", "i_d_ref", "i_q_ext", "speed_mode", "temp_winding", "temp_valid", "clear_faults")


class GoldenBoard:
    """One drive, from the end of its reset.  ``trip_at``: second at which the trip pin goes high for a period."""

    def __init__(self, drive, version: int, trip_at: float | None = None):
        register_set = registers(drive)
        generics = {**register_set.config._asdict(), "clock_hz": round(drive.core.clock_hz)}
        self.registers = RegisterFile(generics, version)
        self.drive, self.config = drive, register_set.config
        self.periods = GoldenPeriods(register_set)
        self.plant, sensors = build_plant(drive)
        self.codes = sensor_params(sensors)
        self.period_s = 1.0 / drive.inverter.pwm_frequency_hz
        self.trip_at, self.time, self.number = trip_at, 0.0, 0
        self.speeds: list[float] = []  # of the shaft, rad/s, before each period
        self.gate_word, self.flags = 0, (0,) * len(FLAGS)
        self._settings()
        self.periods.run(None, 0)

    def _settings(self) -> None:
        values = {name: self.registers.values[name] for name in fluxproof.Registers._fields}
        self.periods.core.registers = fluxproof.Registers(**values)

    def _period(self) -> None:
        """From one sample_trigger to the next, with what the registers hold now."""
        self._settings()
        values, plant, core = self.registers.values, self.plant, self.periods.core
        self.speeds.append(plant.omega_m)
        pressed = self.trip_at is not None and self.trip_at <= self.time < self.trip_at + self.period_s
        core.inputs = core.inputs._replace(trip=int(pressed), clear_trip=values["clear_trip"])
        raw = (
            *(current_code(self.codes, n, plant.i_abc[n], self.number) for n in range(3)),
            u_dc_code(self.codes, self.drive.inverter.dc_bus_v, self.number),
            position_code(self.codes, plant.theta_m, self.number),
            *(values[name] for name in REFERENCES),
        )
        made = self.periods.run(dict(zip(INPUT_PORTS, map(int, raw), strict=True)), values["enable"])
        values["clear_trip"] = values["clear_faults"] = 0  # pulses
        plant.advance(
            made.edge_clocks * (self.period_s / made.clocks),
            made.gate_words,
            self.drive.inverter.dc_bus_v,
            0.0,
            self.period_s,
        )
        self.gate_word = self.periods.word
        self.number += 1
        self.time += self.period_s
        self.flags = made.flags

    def _status(self) -> None:
        """What the registers show after the last period."""
        gates, r = self.periods.core.state.of_gate_generation, self.periods.core.registers
        good = 0 < r.dead_time < r.min_pulse <= self.config.carrier_half
        shown = self.periods.core.observed._asdict() | dict(zip(FLAGS, self.flags, strict=True))
        shown |= {"running": gates.running, "tripped": gates.tripped, "min_pulse_used": gates.min_pulse}
        shown |= {"setting_refused": int(not good)}
        self.registers.status |= {name: shown[name] for name in self.registers.status if name in shown}

    def answer(self, request: str) -> str:
        """One request of bus_pipe.c."""
        kind, *numbers = request.split()
        numbers = [int(n, 16) for n in numbers]
        if kind == "t":
            for _ in range(round(numbers[0] * 1e-6 / self.period_s)):
                self._period()
            return "ok"
        if kind == "w":
            return "ok" if self.registers.write(*numbers) == register_map.OKAY else "error"
        if self.number:
            self._status()
        response, word = self.registers.read(*numbers)
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
        for end in ends:
            os.close(end)
        with os.fdopen(to_program[1], "w") as answers, os.fdopen(from_program[0]) as requests:
            for request in requests:
                answers.write(self.answer(request) + "\n")
                answers.flush()
        said, complained = running.communicate()
        return subprocess.CompletedProcess(program, running.returncode, said, complained)
