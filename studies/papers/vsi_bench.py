# SPDX-License-Identifier: BSD-3-Clause
"""The drive of paper 000 on its bench: an inverter with dead time and drops, a motor whose flux falls under load.

What the paper leaves open is chosen so that its own figures come out (docs/vsi_estimators.md): the leg voltage that
its 18.1 mWb at 300 rpm stand for, 2.2 V, is a dead time of 4 us and drops of 0.8 V; the 2.4 mWb between no load and
4 A are cross-saturation.
"""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from fluxproof.checkout import ROOT
from fluxproof.cosim.closed_loop import Result
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.scenarios import RPM, scenario
from fluxproof.plant import IMPOSED_SPEED, Inverter, Machine
from golden_model import drive as drives
from golden_model.registers import RegisterSet, registers
from golden_model.units import si_per_lsb
from studies.papers.flux_bench import ALONE, scaled

VSI_DRIVE = ROOT / "docs" / "drives" / "paper000.toml"
DRIVE = drives.load(VSI_DRIVE)
NOMINAL = registers(DRIVE)
T_S = DRIVE.sample_time_s
DEAD_TIME_S = DRIVE.inverter.dead_time_s
DROPS = Inverter(v_switch_v=DRIVE.inverter.v_switch_v, v_diode_v=DRIVE.inverter.v_diode_v)
CROSS = 2.4e-3 / 4.0**2  # Wb/A2: 70.7 mWb at no load, 68.3 mWb at 4 A
MACHINE = dataclasses.replace(Machine.from_mapping(vars(DRIVE.machine)), cross_saturation_wb_per_a2=CROSS)
I_Q = 4.0
FAST = {"eta_v": 10, "zeta": 3}  # times: settles within seconds, to the same place


class Run(NamedTuple):
    """A run in SI units; ``v_dead``, ``v_comp`` are voltages of a leg."""

    ms: np.ndarray
    i_d: np.ndarray
    i_q: np.ndarray
    rpm: np.ndarray
    lambda_d: np.ndarray
    lambda_q: np.ndarray
    estimate_d: np.ndarray
    estimate_q: np.ndarray
    v_dead: np.ndarray
    v_comp: np.ndarray
    psi_m: np.ndarray
    d_d: np.ndarray
    d_q: np.ndarray
    theta: np.ndarray
    result: Result


def without(register_set: RegisterSet) -> RegisterSet:
    """Neither compensated nor estimated: what a drive without paper 000 does."""
    return scaled(register_set, {}, **ALONE)


def trace(result: Result, drive=DRIVE) -> Run:
    """A result in SI units; the direction functions as the paper has them, three times ours."""
    seen, plant = result.observed, result.plant

    def si(name: str) -> np.ndarray:
        return seen[name] * si_per_lsb(name, drive)

    n = len(plant["i_d"])
    return Run(
        ms=np.arange(n) * drive.sample_time_s * 1e3,
        i_d=plant["i_d"],
        i_q=plant["i_q"],
        rpm=plant["omega_m"] / RPM,
        lambda_d=plant["lambda_d"],
        lambda_q=plant["lambda_q"],
        estimate_d=si("lambda_d"),
        estimate_q=si("lambda_q"),
        v_dead=si("v_dead"),
        v_comp=si("v_comp"),
        psi_m=si("psi_m"),
        d_d=3.0 * si("d_d"),
        d_q=3.0 * si("d_q"),
        theta=si("theta_me"),
        result=result,
    )


def held_at(rpm: float, i_d: float, i_q: float, seconds: float, drive=DRIVE, **more) -> Scenario:
    """Torque mode at a speed that the load machine imposes."""
    scene = scenario(
        drive, seconds, rpm={0.0: 0.0}, i_d={0.05: i_d}, i_q={0.05: i_q}, torque_mode=((0.0, seconds),),
        start_rpm=rpm, **more,
    )  # fmt: skip
    scene.load[:] = rpm * RPM
    return scene


def run(scene: Scenario, register_set: RegisterSet = NOMINAL, machine=MACHINE, **options) -> Run:
    """One scenario on the paper's drive with dead time and drops."""
    settings = {"dead_time_s": DEAD_TIME_S, "inverter": DROPS, "mode": IMPOSED_SPEED} | options
    return trace(simulate(DRIVE, register_set, scene, machine, **settings))


def last(seconds: float) -> slice:
    """The end of a run."""
    return slice(-round(seconds / T_S), None)


def harmonic(signal: np.ndarray, theta: np.ndarray, order: int) -> float:
    """Amplitude of a harmonic of the electrical angle, over whole turns of it."""
    turns = np.unwrap(theta)
    whole = int((turns[-1] - turns[0]) / (2 * math.pi) * np.sign(turns[-1] - turns[0])) or 1
    inside = np.abs(turns - turns[0]) <= 2 * math.pi * whole
    x = signal[inside] - signal[inside].mean()
    return 2 * abs(np.mean(x * np.exp(-1j * order * turns[inside])))


def leg_loss() -> float:
    """What a leg of the plant really loses at a current well above zero [V]: dead time, and drops by what conducts.

    A leg with positive current loses v_switch while its upper switch is on and v_diode below it; the mean of both legs'
    ends, over a turn, is half of each.
    """
    return (
        DEAD_TIME_S * DRIVE.inverter.pwm_frequency_hz * DRIVE.inverter.dc_bus_v
        + (DRIVE.inverter.v_switch_v + DRIVE.inverter.v_diode_v) / 2.0
    )
