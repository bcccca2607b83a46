"""The key experiments of paper 001 through the VHDL in GHDL, every bit compared with the golden model beside it."""

from __future__ import annotations

import dataclasses
import json
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from fluxproof.cosim import ghdl
from fluxproof.cosim.closed_loop import Scenario
from fluxproof.cosim.scenarios import RPM, scenario
from fluxproof.golden_model import drive as drives
from fluxproof.golden_model.registers import RegisterSet, registers
from fluxproof.golden_model.units import from_si
from fluxproof.plant import Machine
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
RTL_CARRIER = 1000  # clocks in half a PWM period: GHDL pays by the clock


class RtlRun(NamedTuple):
    """A key experiment for the VHDL: shorter, on the same plant, with the golden model beside it."""

    title: str
    scenario: Scenario
    registers: RegisterSet
    machine: Machine | None
    end: (
        tuple[float, float] | None
    )  # where the error must have settled [s]; None: the inverter has its dead time


def runs(drive) -> dict[str, RtlRun]:
    """The key experiments, for a drive with fewer clocks in a period."""
    full = registers(drive)
    own = scaled(full, {}, **ALONE)
    wrong = scaled(own, dict.fromkeys(MAGNETIC, 1.3))
    ramp = np.interp(np.arange(2600), [0, 500, 1700, 2600], [200, 200, -200, -200])
    reversal = scenario(drive, 0.26, rpm={0.0: 0.0}, load={0.0: 2.0}, start_rpm=200)
    reversal.omega_ref[:] = [
        from_si("omega_ref", rpm * RPM * drive.machine.pole_pairs, drive) for rpm in ramp
    ]
    changes = {
        t: {n: round(getattr(own.values, n) * f) for n in ("l_q", "lambda_mg")}
        for t, f in ((0.05, 1.3), (0.15, 0.7))
    }
    steps = scenario(drive, 0.25, rpm={0.0: 183}, load={0.0: 3.05}, changes=changes, start_rpm=183)
    loaded = scenario(drive, 0.25, rpm={0.0: 239}, load={0.08: TORQUE_N}, start_rpm=239)
    learning = scaled(full, {"eta_v": 400, "zeta": 200, "k_lp": 4})
    switched = {0.08: {"compensate": 1}, 0.16: {"compensate": 0}}
    dead = scenario(drive, 0.2, rpm={0.0: 300}, load={0.0: 3.0}, changes=switched, start_rpm=300)
    dead = dataclasses.replace(dead, temp_winding=np.linspace(20.0, 60.0, len(dead)))
    return {
        "fig_4": RtlRun("Fig. 4: 239 rpm, torque step, x 1.3", loaded, wrong, None, (0.23, 0.25)),
        "figs_13_15": RtlRun(
            "Figs. 13, 15: L_q and lambda_mg x 1.3, then x 0.7", steps, own, None, (0.23, 0.25)
        ),
        "inverter": RtlRun("V_dead, psi_m, R(T): compensation off, on, off", dead, learning, None, None),
        "reversal": RtlRun(
            "A motor that saturates, through zero", reversal, own, saturating_machine(), (0.24, 0.26)
        ),
    }


def in_ghdl(name: str) -> tuple[str, Experiment]:
    """One key experiment through the VHDL: (its name, what it found)."""
    drive = drives.with_carrier(DRIVE, RTL_CARRIER)
    run = runs(drive)[name]
    environment = {
        "FLUXPROOF_CARRIER_HALF": str(RTL_CARRIER),
        "FLUXPROOF_EXPERIMENT": name,
    }
    generics = {key.upper(): value for key, value in run.registers.config._asdict().items()}
    folder = ghdl.run_folder("fluxproof", generics, key=f"papers-{name}")
    for file in ("result.npz", "summary.json"):  # nothing old may pass for new
        (folder / file).unlink(missing_ok=True)
    ghdl.run("fluxproof", "studies.papers.dut_papers", generics, environment, key=f"papers-{name}")
    problem = ghdl.failure(folder)
    title = f"In the VHDL: {run.title}"
    if problem and not (folder / "summary.json").exists():
        return name, Experiment(title, [Finding(title, None, problem.partition("\n")[0], "", False)])
    summary, arrays = json.loads((folder / "summary.json").read_text()), np.load(folder / "result.npz")
    part = {
        kind: {k[len(kind) + 1 :]: arrays[k] for k in arrays if k.startswith(kind)}
        for kind in ("observed", "plant")
    }
    view = trace(SimpleNamespace(**part), run.scenario, drive)
    equal = summary["differences"] == 0
    found = [
        Finding(
            f"{title}: periods compared with the golden model",
            None,
            summary["periods_compared"],
            "periods",
            True,
        ),
        Finding(f"{title}: differences", None, summary["differences"], "bits or edges", equal),
        Finding(f"{title}: raw sample to duties", None, summary["sample_to_duty_clocks"], "clocks", True),
    ]
    if run.end:
        left = mean_error(view, window(*run.end))
        found.append(Finding(f"{title}: steady error", 0.0, left, "% of lambda_n", left < 0.2))
    return name, Experiment(title, found, {"estimate": view})
