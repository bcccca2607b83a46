# SPDX-License-Identifier: BSD-3-Clause
"""Whether the drive may be built as described, in one line; and what the simulation does and does not contain."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fluxproof.simulate.figures import rpm, tail
from fluxproof.simulate.margins import Margins
from fluxproof.simulate.run import Run
from fluxproof.simulate.scene import Stage
from golden_model import supply
from golden_model.drive import Drive
from golden_model.protection_limits import regen_end_v
from golden_model.registers import registers
from golden_model.scaling import leg_loss_v

MOST_KEYS = 8  # of [plant.*], in a line
LEARNT = 0.8  # of the loss of dead time and devices
OF_SPEED, OF_CURRENT = 0.03, 0.1  # largest error of a settled stage: of the rated speed, rms of the current limit


def judge(
    drive: Drive, loops: dict[str, Margins], runs: list[Run], overvoltage: str = "", back: str = ""
) -> tuple[str, str]:
    """(status, reason): "ok", "unstable", "tripped", "not_settled" or "overvoltage"; the first that applies.

    overvoltage: what a trip at top speed does to the bus, if it is beyond a rating; back: what braking feeds back.
    """
    for name, margins in loops.items():
        if not margins.stable:
            size = f"a pole of the closed loop has the magnitude {margins.pole:.4f}"
            return "unstable", f"the {name} is unstable: {size}"
    trips = [_tripped(drive, run, back) for run in runs if run.tripped_at is not None]
    if trips:
        return "tripped", "; ".join(trips)
    for run in runs:
        reason = unsettled(drive, run)
        if reason:
            return "not_settled", reason
    if overvoltage:
        return "overvoltage", overvoltage
    slow = min(loops, key=lambda name: _or(loops[name].phase_margin_deg))
    margin = loops[slow].phase_margin_deg
    least = "" if margin is None else f"; least phase margin {margin:.0f} degrees, {slow}"
    return "ok", f"stable in every stage, no trip{least}"


def _tripped(drive: Drive, run: Run, back: str) -> str:
    """Which faults end a run, when, in which stage of its scene, and what to do about them."""
    at = run.tripped_at or 0
    stage = next(s for s in run.scene.stages if s.first <= at < s.end)
    told = f"tripped by {', '.join(run.faults)} at {run.t[at] * 1e3:.1f} ms, in the stage {stage.name!r}"
    if back and "u_dc_high" in run.faults:
        return f"{told}: {back}"
    return told + _overspeed(drive, run)


def _overspeed(drive: Drive, run: Run) -> str:
    """What sets the limit that the speed has passed, and what keeps below it."""
    if "overspeed" not in run.faults:
        return ""
    limit = next(row.represented for row in registers(drive).rows if row.name == "omega_trip")
    size = limit / drive.machine.pole_pairs * 30.0 / math.pi
    keys = "[control] speed_bandwidth_hz for a smaller excursion, or [protection] overspeed_rad_s"
    return f": the limit is {size:.4g} rpm; {keys}"


def unsettled(drive: Drive, run: Run) -> str:
    """Why a stage's end counts as not settled; empty if all have settled."""
    error = run["i_q"] - run["i_q_ref"]
    for stage in run.scene.stages:
        end = tail(stage)
        rest = math.sqrt(float(np.mean(error[end] ** 2)))
        most = OF_CURRENT * drive.current_limit_a
        if rest > most:
            said = f"i_q is {rest:.3g} A rms from its reference at the end of {stage.name!r}: at most {most:.3g} A"
            return said + _unlearnt(drive, run, end)
        if run.scene.imposed:
            continue
        away = float(np.abs(rpm(run)[end].mean() - stage.reference))
        most = OF_SPEED * drive.machine.rated_speed_rad_s * 30.0 / math.pi
        spread = float(np.std(rpm(run)[end]))
        if away > most or spread > most:
            said = f"the speed is {away:.4g} rpm from {stage.reference:.4g} rpm, swinging by {spread:.3g} rpm rms,"
            return f"{said} at the end of {stage.name!r}: at most {most:.3g} rpm{_coasting(drive, run, stage)}"
    return ""


def _coasting(drive: Drive, run: Run, stage: Stage) -> str:
    """That the bus voltage has limited the braking current in the stage, so that the shaft coasts."""
    limited = run["regen_limited"][stage.first : stage.end].sum() * drive.sample_time_s
    if not limited:
        return ""
    p = drive.protection
    most = f"from regen_start_v = {p.regen_start_v:g} V to {regen_end_v(drive):g} V"
    ends = "what the capacitor does not take is left to friction: a brake resistor (brake_on_v) takes it"
    return f"; the bus voltage limits the braking current {most}, here for {limited:.3g} s, and {ends}"


def _unlearnt(drive: Drive, run: Run, end: slice) -> str:
    """What is still missing of the dead time's compensation, which distorts currents and flux estimate until then."""
    loss, compensated = leg_loss_v(drive), float(np.abs(run["v_comp"][end]).mean())
    if not drive.control.dead_time_compensation or compensated > LEARNT * loss:
        return ""
    missing = f"of the {loss:.2g} V that dead time and devices take {compensated:.2g} V are compensated so far"
    return f"; {missing}: the remaining loss is not learnt yet and distorts currents and flux estimate"


def _or(value: float | None) -> float:
    return math.inf if value is None else value


def modelled(drive: Drive, runs: list[Run]) -> list[str]:
    """What the simulation contains."""
    m, i = drive.machine, drive.inverter
    lines = [
        "the core bit for bit: golden model with all registers, formats, rounding, limits, estimators",
        f"switching inverter with {i.dead_time_s * 1e6:g} µs dead time, diodes, and blanking of the current at zero",
        f"currents and bus voltage in codes of {drive.sensors.adc_bits} bits, sampled in the valley",
        f"friction {m.viscous_friction_nms:g} Nm s and {m.coulomb_friction_nm:g} Nm, inertia {m.inertia_kgm2:g} kg m2",
    ]
    drops = any((i.v_switch_v, i.v_diode_v, i.r_switch_ohm, i.r_diode_ohm))
    lines.append("device drops as given" if drops else "devices without voltage drop: [inverter] gives none")
    if drive.encoder.counts:
        lines.append(f"position in counts: {drive.encoder.counts} a turn, from the start referenced")
    else:
        pairs = drive.sensors.position_pole_pairs
        of = "" if pairs == 1 else f", of a resolver with {pairs} pole pairs"
        lines.append(f"position in codes of {drive.sensors.position_bits} bits{of}")
    lines.append(_bus(drive))
    saturates = any((m.saturation_d_per_a2, m.saturation_q_per_a2, m.cross_saturation_wb_per_a2))
    lines.append("saturation as given" if saturates else "constant inductances: [machine] gives no saturation")
    lines.append("protection: the checks of each sample; a trip turns the gates off")
    return lines


def _bus(drive: Drive) -> str:
    """The bus in words."""
    if drive.supply.source == "ideal":
        return f"bus: an ideal source of {drive.inverter.dc_bus_v:g} V, which takes back what braking feeds back"
    back = "which takes nothing back" if drive.supply.source == "diode" else "which takes back what braking feeds back"
    kind = "a source behind a diode" if drive.supply.source == "diode" else "a battery"
    brake = "no brake resistor"
    if drive.protection.brake_on_v is not None:
        brake = f"a brake resistor of {supply.brake_resistor_ohm(drive):.3g} ohm"
    return (
        f"bus: {drive.supply.capacitance_f * 1e3:.3g} mF on {kind} of {drive.inverter.dc_bus_v:g} V and "
        f"{supply.resistance_ohm(drive):.3g} ohm, {back}; {brake}"
    )


def not_modelled(drive: Drive, runs: list[Run], plant: Sequence[str] = ()) -> list[str]:
    """What the simulation does not contain, so that nobody takes it for shown; ``plant``: keys of [plant.*]."""
    lines = [
        "heating: winding and magnets keep their temperatures; losses are reported, temperatures are not computed",
        "switching losses and the temperature of the inverter",
        "losses of the inverter on the bus, and what else hangs on it",
        "noise, offset and gain errors of sensors; delays of drivers; the angle error of the encoder's mounting",
        "cogging, harmonics of the magnets, elasticity and backlash of the shaft",
        "watchdog and too early samples: every sample comes in time",
    ]
    kind = drive.encoder.kind
    if kind == "hall":
        lines.append("uneven Hall sensors and the filter of their pins")
    elif kind != "code":
        lines.append(f"the {kind} interface itself: lost edges, bad frames, and the search for the index")
    if drive.converters.kind != "codes":
        lines.append(f"the {drive.converters.kind} converters themselves: conversion errors, bad frames, their noise")
    if drive.sampling.delay_s:
        lines.append(f"[sampling] delay_s = {drive.sampling.delay_s:g} s: the plant is sampled in the valley")
    if any(run.scene.shortened for run in runs):
        lines.append("the top speed: the inertia would take too long, so the scene stays at lower speeds")
    if plant:
        more = f" and {len(plant) - MOST_KEYS} more" if len(plant) > MOST_KEYS else ""
        keys = f"{', '.join(plant[:MOST_KEYS])}{more}"
        lines.append(f"[plant.*] of the drive file: {keys} are used by `fluxproof diagnose` alone")
    if not drive.machine.iron_conductance_s:
        lines.append("iron losses: [machine] iron_conductance_s gives none")
    return lines
