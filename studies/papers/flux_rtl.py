# SPDX-License-Identifier: BSD-3-Clause
"""The key experiments through the core, every bit compared with the golden model beside it.

In Verilator the RTL, converted to Verilog, runs all of each; the VHDL itself runs the first periods in GHDL.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.runs import ClosedLoop, InGhdl, InVerilator, Named
from fluxproof.cosim.scenarios import RPM, scenario
from fluxproof.plant import Machine
from golden_model import drive as drives
from golden_model.registers import RegisterSet, registers
from golden_model.units import from_si
from studies.papers.flux_bench import (
    ALONE,
    DRIVE,
    MAGNETIC,
    TORQUE_N,
    Experiment,
    Finding,
    mean_error,
    scaled,
    trace,
    window,
)
from studies.papers.flux_beyond import saturating_machine

OF_VSI = ("inverter",)  # runs that belong to paper 000
# Clocks in half a PWM period: a run takes its time by the clock, in GHDL a thousand times that in Verilator.
RTL_CARRIER, GHDL_CARRIER = 1000, 100
GHDL_PERIODS = 125


class RtlRun(NamedTuple):
    """A key experiment for the core: shorter, on the same plant, with the golden model beside it."""

    title: str
    scenario: Scenario
    registers: RegisterSet
    machine: Machine | None
    end: tuple[float, float] | None  # where the error must have settled [s]; None: the inverter has its dead time


def runs(drive) -> dict[str, RtlRun]:
    """The key experiments, for a drive with fewer clocks in a period."""
    full = registers(drive)
    own = scaled(full, {}, **ALONE)
    wrong = scaled(own, dict.fromkeys(MAGNETIC, 1.3))
    ramp = np.interp(np.arange(2600), [0, 500, 1700, 2600], [200, 200, -200, -200])
    reversal = scenario(drive, 0.26, rpm={0.0: 0.0}, load={0.0: 2.0}, start_rpm=200)
    reversal.omega_ref[:] = [from_si("omega_ref", rpm * RPM * drive.machine.pole_pairs, drive) for rpm in ramp]
    changes = {
        t: {n: round(getattr(own.values, n) * f) for n in ("l_q", "lambda_mg")} for t, f in ((0.05, 1.3), (0.15, 0.7))
    }
    steps = scenario(drive, 0.25, rpm={0.0: 183}, load={0.0: 3.05}, changes=changes, start_rpm=183)
    loaded = scenario(drive, 0.25, rpm={0.0: 239}, load={0.08: TORQUE_N}, start_rpm=239)
    learning = scaled(full, {"eta_v": 400, "zeta": 200, "k_lp": 4})
    switched = {0.08: {"compensate": 1}, 0.16: {"compensate": 0}}
    dead = scenario(drive, 0.2, rpm={0.0: 300}, load={0.0: 3.0}, changes=switched, start_rpm=300)
    dead = dataclasses.replace(dead, temp_winding=np.linspace(20.0, 60.0, len(dead)))
    return {
        "fig_4": RtlRun("Fig. 4: 239 rpm, torque step, x 1.3", loaded, wrong, None, (0.23, 0.25)),
        "figs_13_15": RtlRun("Figs. 13, 15: L_q and lambda_mg x 1.3, then x 0.7", steps, own, None, (0.23, 0.25)),
        "inverter": RtlRun("V_dead, psi_m, R(T): compensation off, on, off", dead, learning, None, None),
        "reversal": RtlRun("A motor that saturates, through zero", reversal, own, saturating_machine(), (0.24, 0.26)),
    }


def rtl_run(name: str, carrier_half: int, periods: int | None = None) -> ClosedLoop:
    """A key experiment, or its first ``periods``, as fluxproof/cosim/runs.py carries it out."""
    drive = drives.with_carrier(DRIVE, carrier_half)
    run = runs(drive)[name]
    return ClosedLoop(drive, run.registers, run.scenario.first(periods), run.machine, run.end is not None)


class KeyExperiment:
    """A key experiment in both engines and what it found."""

    def __init__(self, name: str):
        function = f"{__name__}:rtl_run"
        self.name = name
        self.rtl = runs(drives.with_carrier(DRIVE, RTL_CARRIER))[name]
        self.verilator = InVerilator(f"papers {name} in Verilator", Named(function, (name, RTL_CARRIER)))
        short = Named(function, (name, GHDL_CARRIER, GHDL_PERIODS))
        self.ghdl = InGhdl(f"papers {name} in GHDL", short)

    def carry_out(self, say: Callable[[str], None] = print) -> None:
        """Both runs, one after the other; a line of each."""
        for job in (self.verilator, self.ghdl):
            job.carry_out()
            counts = job.summary()
            found = "{periods_compared:,} periods, {differences:,} differences, {seconds:.0f} s"
            say(f"{job.name}: {found.format(**counts) if counts else job.problem}")

    def found(self) -> Experiment:
        """Its findings; where a run came to no end, the one finding that says so."""
        title = f"In the VHDL: {self.rtl.title}"
        for job in (self.verilator, self.ghdl):
            if not job.summary():
                return Experiment(title, [Finding(f"{title}, {job.name}", None, job.problem, "", False)])
        compiled, simulated = self.verilator.summary(), self.ghdl.summary()
        differences = compiled["differences"] + simulated["differences"]
        view = trace(self.verilator.result(), self.rtl.scenario, drives.with_carrier(DRIVE, RTL_CARRIER))
        clocks = compiled["sample_to_duty_clocks"]
        found = [
            Finding(
                f"{title}: periods compared with the golden model", None, compiled["periods_compared"], "periods", True
            ),
            Finding(f"{title}: differences", None, differences, "bits or edges", differences == 0),
            Finding(
                f"{title}: raw sample to duties", None, clocks, "clocks", clocks == simulated["sample_to_duty_clocks"]
            ),
        ]
        if self.rtl.end:
            left = mean_error(view, window(*self.rtl.end))
            found.append(Finding(f"{title}: steady error", 0.0, left, "% of lambda_n", left < 0.2))
        engines = f"{compiled['periods_compared']:,} periods in Verilator, {simulated['periods_compared']:,} in GHDL"
        return Experiment(f"{title} ({engines})", found, {"estimate": view})
