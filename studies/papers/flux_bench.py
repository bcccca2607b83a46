# SPDX-License-Identifier: BSD-3-Clause
"""The drive of paper 001 on its bench: scenarios to traces in SI units, findings for build/papers/flux.json.

The golden model drives the switching plant.  The inverter is ideal as in the paper, whose estimator assumes its
dead time compensated; currents, bus and angle go through the converters of docs/drives/paper001.toml.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fluxproof.checkout import ROOT
from fluxproof.cosim.closed_loop import Result
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.scenarios import RPM, scenario
from fluxproof.plant import Machine
from golden_model import drive as drives
from golden_model.registers import RegisterSet, registers
from golden_model.units import from_si, si_per_lsb

PAPER_DRIVE = ROOT / "docs" / "drives" / "paper001.toml"
LAMBDA_N, TORQUE_N = 0.2021, 3.7  # Table 2
MAGNETIC = ("l_d", "l_q", "lambda_mg")
CURRENT_MODEL, MERGED, EARLIER, PROPOSED = range(4)  # register flux_mode


class Finding(NamedTuple):
    """One row of flux.json; ``paper`` is what the paper says or shows, None where it says nothing."""

    experiment: str
    paper: str | float | None
    ours: float | str
    unit: str
    passed: bool

    def row(self) -> dict:
        """The row with the keys of the file."""
        ours = self.ours if isinstance(self.ours, (str, int)) else float(f"{self.ours:.4g}")
        values = {"experiment": self.experiment, "paper": self.paper, "ours": ours, "unit": self.unit}
        return values | {"pass": bool(self.passed)}


class Trace(NamedTuple):
    """A run in SI units: ``estimate`` and ``actual`` are {"d", "q"} of flux linkages [Wb]."""

    ms: np.ndarray
    estimate: dict[str, np.ndarray]
    actual: dict[str, np.ndarray]
    rpm: np.ndarray
    rpm_ref: np.ndarray
    i_d: np.ndarray
    i_q: np.ndarray
    torque: np.ndarray
    torque_estimate: np.ndarray
    speed_limited: np.ndarray
    delta: dict[str, np.ndarray]
    faults: np.ndarray

    def error(self, axis: str) -> np.ndarray:
        """Estimate minus actual flux linkage, in parts of lambda_n."""
        return (self.estimate[axis] - self.actual[axis]) / LAMBDA_N

    def worst(self, part: slice) -> float:
        """Largest error of either axis in a part of the run, in percent of lambda_n."""
        return 100 * max(np.abs(self.error(axis)[part]).max() for axis in "dq")

    def rms(self, part: slice) -> float:
        """Rms error of the flux vector in a part of the run, in percent of lambda_n."""
        return 100 * math.sqrt(sum(np.mean(self.error(axis)[part] ** 2) for axis in "dq"))


@dataclass
class Experiment:
    """What one experiment found, and what there is to draw: {name: Trace or arrays}."""

    title: str
    findings: list[Finding]
    traces: dict = field(default_factory=dict)


DRIVE = drives.load(PAPER_DRIVE)
ALONE = {"compensate": 0, "eta_v": 0}  # paper 001 alone: neither paper 000's compensation nor its estimate
NOMINAL = registers(DRIVE)._replace(values=registers(DRIVE).values._replace(**ALONE))
T_S = DRIVE.sample_time_s


def scaled(register_set: RegisterSet, factors: dict[str, float] | None = None, **changes: int) -> RegisterSet:
    """The same registers, some times a factor, some replaced."""
    values = register_set.values
    new = {name: round(getattr(values, name) * factor) for name, factor in (factors or {}).items()}
    return register_set._replace(values=values._replace(**new, **changes))


def wrong_by(factor: float, **changes: int) -> RegisterSet:
    """All three magnetic parameters of the estimator times ``factor``; the regulators keep their gains."""
    return scaled(NOMINAL, dict.fromkeys(MAGNETIC, factor), **changes)


def limit_current(amperes: float) -> dict[str, int]:
    """The register that limits the speed regulator's output."""
    return {"i_max": from_si("i_q_ref", amperes, DRIVE)}


def trace(result: Result, scene: Scenario, drive=DRIVE) -> Trace:
    """A result in SI units."""
    seen, plant = result.observed, result.plant

    def si(name: str) -> np.ndarray:
        return seen[name] * si_per_lsb(name, drive)

    per_rpm = drive.machine.pole_pairs * RPM
    return Trace(
        ms=np.arange(len(scene)) * drive.sample_time_s * 1e3,
        estimate={"d": si("lambda_d"), "q": si("lambda_q")},
        actual={"d": plant["lambda_d"], "q": plant["lambda_q"]},
        rpm=plant["omega_m"] / RPM,
        rpm_ref=scene.omega_ref * si_per_lsb("omega_ref", drive) / per_rpm,
        i_d=plant["i_d"],
        i_q=plant["i_q"],
        torque=plant["torque"],
        torque_estimate=si("torque"),
        speed_limited=seen["speed_limited"],
        delta={"d": si("delta_lambda_d"), "q": si("delta_lambda_q")},
        faults=seen["flux_faults"],
    )


def run(scene: Scenario, register_set: RegisterSet = NOMINAL, machine: Machine | None = None, **options) -> Trace:
    """One scenario on the paper's drive."""
    return trace(simulate(DRIVE, register_set, scene, machine, **options), scene)


def window(start: float, end: float) -> slice:
    """A part of a run, in seconds."""
    return slice(round(start / T_S), round(end / T_S))


def mean_error(view: Trace, part: slice) -> float:
    """Mean error over a part of the run, the worse axis, in percent of lambda_n."""
    return 100 * max(abs(view.error(axis)[part].mean()) for axis in "dq")


LOADED = scenario(DRIVE, 1.0, rpm={0.0: 239}, load={0.4: TORQUE_N}, start_rpm=239)


def held_at(rpm: float, i_d: float, i_q: float, seconds: float = 0.6, drive=DRIVE) -> Scenario:
    """Torque mode at a speed that the load machine imposes: paper 001, section 5.4."""
    scene = scenario(
        drive,
        seconds,
        rpm={0.0: 0.0},
        i_d={0.05: i_d},
        i_q={0.05: i_q},
        torque_mode=((0.0, seconds),),
        start_rpm=rpm,
    )
    scene.load[:] = rpm * RPM
    return scene
