# SPDX-License-Identifier: BSD-3-Clause
"""The numbers of a simulation: what the runs show, and what follows from the drive's data alone.

Every figure is {"value", "unit", "from"}: ``from`` says whether it was measured in the run or calculated.  None where
a figure has no meaning: after a trip the gates are off, and a stage that was not run to its end has no figures.
"""

from __future__ import annotations

import math

import numpy as np

from fluxproof.cosim.scenarios import RPM
from fluxproof.cosim.step_response import rise_and_overshoot
from fluxproof.simulate import scene as scenes
from fluxproof.simulate.regeneration import Regeneration
from fluxproof.simulate.run import Run
from fluxproof.simulate.scene import TAIL, Stage
from golden_model import supply
from golden_model.drive import Drive

BAND = 0.02  # of the top speed: back within it after the load step


def figure(value, unit: str, source: str = "simulated") -> dict:
    """One figure, rounded to six digits."""
    return {"value": None if value is None else float(f"{float(value):.6g}"), "unit": unit, "from": source}


def of_stage(run: Run, stage: Stage, value, unit: str) -> dict:
    """One figure that a stage of the run shows; None where the gates did not stay on to its end."""
    return figure(None if off_before(run, stage.end) else value, unit)


def off_before(run: Run, end: int) -> bool:
    """Whether a trip has turned the gates off before a sample."""
    return run.tripped_at is not None and run.tripped_at < end


def tail(stage: Stage) -> slice:
    """The samples at the end of a stage."""
    return slice(stage.end - max(int(TAIL * (stage.end - stage.first)), 1), stage.end)


def rpm(run: Run) -> np.ndarray:
    """The true mechanical speed [rpm]."""
    return run["true_omega_m"] / RPM


def of_speed(run: Run) -> dict:
    """Steps of speed and load of the scene of a speed loop."""
    speed, found = rpm(run), {}
    step, load = run.scene.stage("speed step"), run.scene.stage("load step")
    before = run.scene.stages[run.scene.stages.index(step) - 1].reference
    reached, over = rise_and_overshoot(speed[step.first : step.end], before, step.reference)
    found["speed_overshoot"] = of_stage(run, step, 100.0 * over, "%")
    period = run.t[1] - run.t[0]
    found["speed_rise_to_90_percent"] = of_stage(run, step, None if reached is None else reached * period * 1e3, "ms")
    under = speed[load.first : load.end]
    found["load_torque"] = figure(load.load, "Nm", "calculated")
    found["load_dip"] = of_stage(run, load, load.reference - under.min(), "rpm")
    outside = np.flatnonzero(np.abs(under - load.reference) > BAND * abs(load.reference))
    found["load_recovery"] = of_stage(run, load, (outside[-1] + 1) * period * 1e3 if len(outside) else 0.0, "ms")
    for stage in run.scene.stages:
        error = speed[tail(stage)] - stage.reference
        found[f"speed_error_{_key(stage)}"] = of_stage(run, stage, np.mean(error), "rpm")
        found[f"speed_noise_{_key(stage)}"] = of_stage(run, stage, np.std(error), "rpm rms")
    return found


def of_currents(run: Run) -> dict:
    """Tracking, peak and the losses at the end of each stage."""
    error = run["i_q"] - run["i_q_ref"]
    found = {"peak_current": figure(np.hypot(run["true_i_d"], run["true_i_q"]).max(), "A")}
    for stage in run.scene.stages:
        found[f"i_q_tracking_{_key(stage)}"] = of_stage(run, stage, _rms(error[tail(stage)]), "A rms")
    return found


def of_current_step(run: Run, where: str = "") -> dict:
    """Overshoot and rise of the step of i_q on the driven shaft; ``where``: the end of the figures' names."""
    stage = run.scene.stage("current step")
    i_q, size = run["i_q"][stage.first : stage.end], stage.reference
    before = run["i_q"][stage.first - 50 : stage.first].mean()
    reached, over = rise_and_overshoot(i_q, before, size)
    period = run.t[1] - run.t[0]
    return {
        f"current_step{where}": figure(size, "A", "calculated"),
        f"current_overshoot{where}": of_stage(run, stage, 100.0 * over, "%"),
        f"current_rise_to_90_percent{where}": of_stage(
            run, stage, None if reached is None else reached * period * 1e6, "µs"
        ),
        f"current_settled_noise{where}": of_stage(run, stage, np.std(i_q[-100:]), "A rms"),
    }


def of_voltage(drive: Drive, run: Run) -> dict:
    """How much of the voltage circle is used, in the run and at the rated point."""
    used = np.hypot(run["u_d"], run["u_q"]) / np.maximum(run["u_max"], 1e-9)
    limited = (run["sat_d"] != 0) | (run["sat_q"] != 0)
    m, limit = drive.machine, scenes.voltage_limit(drive)
    rated, current = m.rated_speed_rad_s, min(m.rated_current_a, drive.current_limit_a)
    whole = run.scene.stages[-1]
    found = {"voltage_limited_samples": of_stage(run, whole, 100.0 * limited.mean(), "%")}
    for stage in run.scene.stages:
        found[f"voltage_used_{_key(stage)}"] = of_stage(run, stage, 100.0 * used[tail(stage)].mean(), "%")
    need = scenes.voltage(drive, rated, current)
    found["voltage_margin_at_rated_point"] = figure(100.0 * (1.0 - need / limit), "%", "calculated")
    found["speed_at_full_voltage_rated_current"] = figure(scenes.reach(drive, current) / RPM, "rpm", "calculated")
    found["speed_at_full_voltage_no_load"] = figure(scenes.reach(drive, 0.0) / RPM, "rpm", "calculated")
    back = np.minimum(run["true_power"], 0.0)
    found["power_fed_back_peak"] = figure(-back.min(), "W")
    found["energy_fed_back"] = figure(-back.sum() * (run.t[1] - run.t[0]), "J")
    return found


def of_supply(drive: Drive, run: Run, back: Regeneration) -> dict:
    """The bus in the run, what braking gives back, and what a chopper needs."""
    volts, period = run["true_u_dc"], run.t[1] - run.t[0]
    braked = run["true_brake_power"]
    found = {
        "bus_voltage_highest": figure(volts.max(), "V"),
        "bus_voltage_lowest": figure(volts.min(), "V"),
        "energy_fed_back_at_once": figure(back.energy_j, "J"),
    }
    if drive.supply.source != "ideal":
        found["bus_voltage_on_its_capacitor_alone"] = figure(back.volts, "V", "calculated")
    if drive.supply.source == "diode":
        ohm = back.resistor_ohm if math.isfinite(back.resistor_ohm) else None
        found["brake_resistor_at_most"] = figure(ohm, "ohm", "calculated")
        found["brake_resistor_on_from"] = figure(back.on_v, "V", "calculated")
    if drive.protection.regen_start_v is not None:
        found["braking_limited_by_the_bus"] = figure(run["regen_limited"].sum() * period, "s")
    if drive.protection.brake_on_v is not None:
        found["brake_resistor"] = figure(supply.brake_resistor_ohm(drive), "ohm", "calculated")
        found["brake_resistor_energy"] = figure(braked.sum() * period, "J")
        found["brake_resistor_power_peak"] = figure(braked.max(), "W")
    return found


def of_heat(drive: Drive, run: Run) -> dict:
    """Losses in the winding; temperatures are constant in the run."""
    m = drive.machine
    hot = 1.0 + m.resistance_temp_coeff_per_k * (m.temperature_winding_c - m.temperature_ref_c)
    resistance = m.resistance_ohm * hot
    squares = run["true_i_d"] ** 2 + run["true_i_q"] ** 2
    copper = 1.5 * m.resistance_ohm * m.rated_current_a**2
    found = {
        "winding_temperature": figure(m.temperature_winding_c, "degC", "calculated"),
        "magnet_temperature": figure(m.temperature_magnet_c, "degC", "calculated"),
        "resistance_in_the_run": figure(resistance, "ohm", "calculated"),
        "copper_loss_in_the_run": of_stage(run, run.scene.stages[-1], 1.5 * resistance * squares.mean(), "W"),
        "copper_loss_at_rated_current": figure(copper, "W", "calculated"),
    }
    if m.resistance_temp_coeff_per_k:
        at = 1.0 + m.resistance_temp_coeff_per_k * (100.0 - m.temperature_ref_c)
        found["copper_loss_at_rated_current_and_100_degc"] = figure(copper * at, "W", "calculated")
    return found


def of_ripple(found: dict, run: Run, stage: Stage) -> dict:
    """The ripple of the loaded drive at the end of a stage."""
    return {
        "ripple_peak_to_peak": of_stage(run, stage, found["peak_to_peak_a"], "A"),
        "ripple_rms": of_stage(run, stage, found["rms_a"], "A rms"),
    }


def _rms(values: np.ndarray) -> float:
    return math.sqrt(float(np.mean(np.square(values))))


def _key(stage: Stage) -> str:
    return stage.name.replace(",", "").replace(" ", "_")
