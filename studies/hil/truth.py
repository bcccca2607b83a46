# SPDX-License-Identifier: BSD-3-Clause
"""Known truth for the explanation: telemetry of core and motor as models, an effect switched on by registers.

The drive file stays as it is; it describes the loss by dead time and the age of the motor's outputs.  Asked of
`fluxproof diagnose`: the digital part equal, the effect and no other named, the true size within two standard
deviations of each of its parameters; without an effect no mismatch.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fluxproof.checkout import BUILD
from fluxproof.diagnosis import session
from fluxproof.diagnosis.example import motor as example
from fluxproof.diagnosis.ground.result import Diagnosis
from fluxproof.diagnosis.replay.telemetry import write_dump
from fluxproof.files import write_json, write_text
from fluxproof.hil.registers import PORTS, Scale, code, machine_of, motor_registers, motor_scale, motor_tables
from fluxproof.plant import Inverter, Machine
from fluxproof.plant.pmsm import Harmonic
from golden_model.drive import Drive, load
from golden_model.formats import MOTOR_ANGLE
from golden_model.io import telemetry_words
from golden_model.motor import motor_sensors
from golden_model.motor.motor_sensors import SENSOR_GAIN
from golden_model.registers import registers
from golden_model.units import from_si
from studies.hil.figure import least, most
from studies.hil.golden import Hil, record

CLOCK_HZ = 34e6  # 200 steps of the motor a period of 100 us
DEAD_S = 5 / CLOCK_HZ * (1 - 1e-9)  # 147 ns
OLD_S = 51 / CLOCK_HZ  # at the trigger the currents of the motor are 52 clocks old, its angle one
DESCRIBED = f"\n[plant.inverter]\ndead_time_s = {DEAD_S:.9g}\n\n[plant.timing]\nsampling_skew_s = {-OLD_S:.4g}\n"
LEAST_A = 1.5  # in place of no current, where the ripple decides what a leg loses
NOISE_I, NOISE_U = 36, 45  # about 4 mA and 0.2 V
UNIT = 1 << SENSOR_GAIN.frac_bits
WITHIN = 2.0  # standard deviations
ASKED = 18  # effects of the catalogue

Values = Mapping[str, float]


class Case(NamedTuple):
    """An effect, what it changes, and the true values of the parameters that are judged, from the rounded machine."""

    effect: str
    machine: Callable[[Machine], dict] = lambda _m: {}
    truth: Callable[[Machine], Values] = lambda _m: {}
    gains: tuple[float, float, float] = (1.0, 1.0, 1.0)
    offset_a: float = 0.0
    bus: float = 1.0
    angle_rad: float = 0.0  # electrical
    drops_v: float = 0.0


CASES = (
    Case(""),
    Case(
        "resistance", lambda m: {"resistance_ohm": 1.2 * m.resistance_ohm},
        lambda m: {"resistance_ohm": m.resistance_ohm},
    ),
    Case(
        "magnet_flux", lambda m: {"magnet_flux_wb": 0.92 * m.magnet_flux_wb},
        lambda m: {"magnet_flux_wb": m.magnet_flux_wb},
    ),
    Case(
        "inductance_d", lambda m: {"inductance_d_h": 1.15 * m.inductance_d_h},
        lambda m: {"inductance_d_h": m.inductance_d_h},
    ),
    Case(
        "inductance_q", lambda m: {"inductance_q_h": 0.85 * m.inductance_q_h},
        lambda m: {"inductance_q_h": m.inductance_q_h},
    ),
    Case("saturation", lambda _m: {"saturation_q_per_a2": 4e-3}),
    Case(
        "cross_saturation", lambda _m: {"cross_saturation_wb_per_a2": 3e-4},
        lambda m: {"cross_saturation_wb_per_a2": m.cross_saturation_wb_per_a2},
    ),
    Case(
        "phase_resistance_asymmetry", lambda _m: {"phase_resistance_asymmetry": (0.1, -0.05, -0.05)},
        lambda m: {f"asymmetry_{x}": relative(m, k) for k, x in enumerate("abc")},
    ),
    Case("emf_harmonics", lambda _m: {"emf_harmonics": (Harmonic(6, 0.02, 0.0, 0.3),)}),
    Case("dead_time", drops_v=3.0),
    Case("current_gain", gains=(1.03, 1.0, 1.0)),
    Case("current_offset", truth=lambda _m: {"offset_a_a": 0.08}, offset_a=0.08),
    Case("current_scale", truth=lambda _m: {"scale": 0.04}, gains=(1.04, 1.04, 1.04)),
    Case("udc_gain", truth=lambda _m: {"udc_gain": 0.03}, bus=1.03),
    Case("encoder_offset", truth=lambda _m: {"offset_rad": math.radians(2.0)}, angle_rad=math.radians(2.0)),
)  # fmt: skip


def relative(m: Machine, phase: int) -> float:
    """A phase's resistance over the mean of the three, minus one."""
    shares = [1.0 + x for x in m.phase_resistance_asymmetry]
    return 3.0 * shares[phase] / sum(shares) - 1.0


def bench(case: Case, drive: Drive) -> tuple[Hil, Scale, Machine]:
    """Registers of core, motor and sensors, and the machine that the rounded registers say."""
    described = Machine.from_mapping(vars(drive.machine))
    heavy = {"inertia_kgm2": 10.0 * described.inertia_kgm2}  # the shaft is held, so it may be what fits 1/J
    machine = dataclasses.replace(described, **case.machine(described), **heavy)
    inverter = Inverter(dead_time_s=drive.inverter.dead_time_s, v_switch_v=case.drops_v, v_diode_v=case.drops_v)
    sensors, of_core = drive.sensors, registers(drive)
    scale = motor_scale(machine, drive.inverter.dc_bus_v, sensors.current_range_a, drive.core.clock_hz)
    motor = motor_registers(scale, machine, inverter, 0.0)
    still = dict.fromkeys(motor_sensors.Registers._fields, 0)
    still |= {f"scale_{x}": round(gain * UNIT) for x, gain in zip("abc", case.gains, strict=True)}
    still |= {"scale_u": round(case.bus * 2 * scale.voltage_v / sensors.u_dc_range_v * UNIT)}
    still |= {"zero_a": round(case.offset_a / scale.current_a * (1 << 16)), "noise_i": NOISE_I, "noise_u": NOISE_U}
    turns = case.angle_rad / drive.machine.pole_pairs / (2 * math.pi)
    still |= {"angle_offset": round(turns / MOTOR_ANGLE.lsb)}
    tables, u_dc = motor_tables(scale, machine), scale.u_dc(drive.inverter.dc_bus_v)
    hil = Hil(of_core.values, of_core.config, motor, tables, motor_sensors.Registers(**still), u_dc)
    return hil, scale, machine_of(scale, motor, machine, inverter)


def recorded(case: Case, folder: Path) -> tuple[Path, Path, Machine]:
    """(telemetry, drive file, true machine) of a case."""
    text = example.DRIVE_FILE.read_text().replace("clock_hz = 200e6", f"clock_hz = {CLOCK_HZ:g}")
    text = text.replace("dead_time_s = 2e-6", f"dead_time_s = {DEAD_S:.9g}") + DESCRIBED
    path = write_text(folder / "drive.toml", text)
    drive = load(path)
    hil, scale, machine = bench(case, drive)
    plan, port = example.scenario(drive), PORTS["omega_set"].fmt
    turns = plan.load * scale.step_s / (2 * math.pi)
    omega_set = np.array([code("omega_set", turn, port) for turn in turns], np.int64)
    none = np.zeros(len(plan), np.int64)
    idle = (plan.i_d_ref == 0) & (plan.i_q_ext == 0)
    i_q = np.where(idle, from_si("i_q_ext", LEAST_A, drive), plan.i_q_ext)
    asked = np.stack([none, plan.i_d_ref, i_q, none, none, none, none], axis=1)
    samples, observed = record(hil, asked, omega_set)
    packet = {name: observed[name] for name in telemetry_words.PACKET}
    return write_dump(folder / "telemetry.dump", drive, registers(drive), samples, packet), path, machine


def judged(case: Case, folder: Path) -> dict:
    """What `fluxproof diagnose` answers, beside the truth."""
    dump, drive, machine = recorded(case, folder)
    answer: Diagnosis = session.diagnose([dump], drive)
    named = [effect.name for effect in answer.effects]
    wanted = [case.effect] if case.effect else []
    sizes = {n: e for effect in answer.effects for n, e in effect.parameters.items() if effect.name == case.effect}
    off = {n: (sizes[n].value - true) / sizes[n].sigma for n, true in case.truth(machine).items() if n in sizes}
    return {
        "effect": case.effect or "none",
        "verdict": answer.verdict,
        "named": named,
        "ambiguity": [list(tie) for tie in answer.ambiguity],
        "equal": answer.digital.checked and answer.digital.first_difference is None,
        "alone": named == wanted and not answer.ambiguity,
        "sigmas_off": {n: round(x, 2) for n, x in off.items()},
        "sentence": answer.sentence,
    }


def figures(_options) -> list[dict]:
    """All cases; answers in build/studies/hil_truth.json."""
    rows = []
    for case in CASES:
        folder = BUILD / "studies" / "hil_truth" / (case.effect or "none")
        folder.mkdir(parents=True, exist_ok=True)
        rows.append(judged(case, folder))
        write_json(BUILD / "studies" / "hil_truth.json", rows)
        print(f"{rows[-1]['effect']}: {rows[-1]['verdict']} {rows[-1]['named']} {rows[-1]['sigmas_off']}", flush=True)
    effects = rows[1:]
    sized = [row for row in effects if row["alone"] and row["sigmas_off"]]
    within = [row for row in sized if all(abs(x) <= WITHIN for x in row["sigmas_off"].values())]
    return [
        least(
            "known truth: effects named, alone, drive file unchanged", sum(r["alone"] for r in effects), ASKED, "of 24"
        ),
        least("known truth: sizes within two standard deviations", len(within), len(sized), "effects"),
        most("known truth: digital differences", sum(not r["equal"] for r in rows), 0, "recordings"),
        most("known truth: mismatches without an effect", int(rows[0]["verdict"] != "no_mismatch"), 0, "recordings"),
    ]
