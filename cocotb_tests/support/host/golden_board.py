# SPDX-License-Identifier: BSD-3-Clause
"""A board with the golden model on it: registers, core, gates at the clock."""

from __future__ import annotations

from cocotb_tests.support.host.piped_board import Board
from fluxproof.cosim.closed_loop import FLAGS, GoldenPeriods
from fluxproof.cosim.driven_plant import INPUT_PORTS
from golden_model import fluxproof
from golden_model.io.register_file import RegisterFile
from golden_model.registers import registers

REFERENCES = ("omega_ref", "i_d_ref", "i_q_ext", "speed_mode", "temp_winding", "temp_valid", "clear_faults")


class GoldenBoard(Board):
    """From the end of the core's reset; ``version`` is what the core says it is."""

    def __init__(self, drive, version: int, trip_at: float | None = None):
        super().__init__(drive, trip_at)
        register_set = registers(drive)
        self.generics = {**register_set.config._asdict(), "clock_hz": round(drive.core.clock_hz)}
        self.registers = RegisterFile(self.generics, version)
        self.periods = GoldenPeriods(register_set)
        self.flags = (0,) * len(FLAGS)
        self._settings()
        self.periods.run(None, 0)

    def write(self, address: int, word: int) -> int:
        return self.registers.write(address, word)

    def read(self, address: int) -> tuple[int, int]:
        if self.number:
            self._status()
        return self.registers.read(address)

    def period(self, codes: dict[str, int], tripping: bool) -> None:
        self._settings()
        values, core = self.registers.values, self.periods.core
        core.inputs = core.inputs._replace(trip=int(tripping), clear_trip=values["clear_trip"])
        raw = {**codes, **{name: values[name] for name in REFERENCES}}
        made = self.periods.run(dict(zip(INPUT_PORTS, raw.values(), strict=True)), values["enable"])
        values["clear_trip"] = values["clear_faults"] = 0  # pulses
        self.advance(made.edge_clocks * (self.period_s / made.clocks), made.gate_words, self.period_s)
        self.gate_word, self.flags = self.periods.word, made.flags

    def _settings(self) -> None:
        values = {name: self.registers.values[name] for name in fluxproof.Registers._fields}
        self.periods.core.registers = fluxproof.Registers(**values)

    def _status(self) -> None:
        """What the registers show after the last period."""
        gates, r = self.periods.core.state.of_gate_generation, self.periods.core.registers
        good = 0 < r.dead_time < r.min_pulse <= self.generics["carrier_half"]
        shown = self.periods.core.observed._asdict() | dict(zip(FLAGS, self.flags, strict=True))
        shown |= {"running": self.periods.core.running, "tripped": gates.tripped, "min_pulse_used": gates.min_pulse}
        shown |= {"setting_refused": int(not good), "double_used": gates.double_update}
        self.registers.status |= {name: shown[name] for name in self.registers.status if name in shown}
