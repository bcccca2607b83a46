# SPDX-License-Identifier: BSD-3-Clause
"""Known truth for the explanation: telemetry of core and motor as models, an effect switched on by registers.

The drive file stays as it is; it describes the loss by dead time and the age of the motor's outputs.  Asked of
`fluxproof diagnose`: the digital part equal, the effect and no other named, the true size within two standard
deviations of each of its parameters; without an effect no mismatch.
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np

from fluxproof.checkout import BUILD
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.diagnosis import session
from fluxproof.diagnosis.example import motor as example
from fluxproof.diagnosis.ground.result import Diagnosis
from fluxproof.diagnosis.replay.telemetry import write_dump
from fluxproof.files import write_json, write_text
from fluxproof.hil.registers import PORTS, Scale, code, machine_of, motor_registers, motor_scale, motor_tables
from fluxproof.plant import Inverter, Machine
from golden_model.drive import Drive, load
from golden_model.formats import MOTOR_ANGLE
from golden_model.io import telemetry_words
from golden_model.motor import motor_model, motor_sensors
from golden_model.motor.motor_sensors import SENSOR_GAIN
from golden_model.registers import registers
from golden_model.units import from_si, si_per_lsb
from studies.hil.cases import CASES, Case, winding_c
from studies.hil.figure import least, most
from studies.hil.golden import Hil, Moving, constant, record

CLOCK_HZ = 34e6  # 200 steps of the motor a period of 100 us
DEAD_S = 5 / CLOCK_HZ * (1 - 1e-9)  # 147 ns
OLD_S = 51 / CLOCK_HZ  # at the trigger the currents of the motor are 52 clocks old, its angle one
DESCRIBED = f"\n[plant.inverter]\ndead_time_s = {DEAD_S:.9g}\n\n[plant.timing]\nsampling_skew_s = {-OLD_S:.4g}\n"
LEAST_A = 1.5  # in place of no current, where the ripple decides what a leg loses
FREE_RAD_S = (30.0, 120.0, -60.0, 60.0, -120.0, -30.0)  # of a free shaft, at each of the currents i_d [A]
FREE_D_A = (-2.5, 2.0, -1.5)
FREE_RAMP, FREE_ROWS = 600, 1500
NOISE_I, NOISE_U = 36, 45  # about 4 mA and 0.2 V
UNIT = 1 << SENSOR_GAIN.frac_bits
WITHIN = 2.0  # standard deviations
ASKED = 18  # effects of the catalogue


def bench(case: Case, drive: Drive) -> tuple[Hil, Scale, Machine]:
    """Registers of core, motor and sensors, and the machine that the rounded registers say."""
    described = Machine.from_mapping(vars(drive.machine))
    # The inertia of a held shaft may be what fits 1/J.
    heavy = {} if case.free else {"inertia_kgm2": 10.0 * described.inertia_kgm2}
    machine = dataclasses.replace(described, **case.machine(described), **heavy)
    inverter = Inverter(dead_time_s=drive.inverter.dead_time_s, v_switch_v=case.drops_v, v_diode_v=case.drops_v)
    sensors, of_core = drive.sensors, registers(drive)
    scale = motor_scale(machine, drive.inverter.dc_bus_v, sensors.current_range_a, drive.core.clock_hz)
    motor = motor_registers(scale, machine, inverter, None if case.free else 0.0)
    still = dict.fromkeys(motor_sensors.Registers._fields, 0)
    still |= {f"scale_{x}": round(gain * UNIT) for x, gain in zip("abc", case.gains, strict=True)}
    still |= {"scale_u": round(case.bus * 2 * scale.voltage_v / sensors.u_dc_range_v * UNIT)}
    still |= {"zero_a": round(case.offset_a / scale.current_a * (1 << 16)), "noise_i": NOISE_I, "noise_u": NOISE_U}
    turns = case.angle_rad / drive.machine.pole_pairs / (2 * math.pi)
    still |= {"angle_offset": round(turns / MOTOR_ANGLE.lsb)}
    tables, u_dc = motor_tables(scale, machine), scale.u_dc(drive.inverter.dc_bus_v)
    hil = Hil(of_core.values, of_core.config, motor, tables, motor_sensors.Registers(**still), u_dc)
    return hil, scale, machine_of(scale, motor, machine, inverter)


def references(case: Case, drive: Drive) -> tuple[np.ndarray, np.ndarray]:
    """(Fields of Sample after the codes, without run, (n, 7); speed of a held shaft [rad/s] (n,))."""
    plan = free_plan(drive) if case.free else example.scenario(drive)
    idle = (plan.i_d_ref == 0) & (plan.i_q_ext == 0) & (plan.speed_mode == 0)
    i_q = np.where(idle, from_si("i_q_ext", LEAST_A, drive), plan.i_q_ext)
    none = np.zeros(len(plan), np.int64)
    asked = np.stack([plan.omega_ref, plan.i_d_ref, i_q, plan.speed_mode, none, none, none], axis=1)
    if not case.moves:
        return asked, plan.load
    down = np.linspace(1.0, 0.0, example.RAMP)  # back to standstill, where the plan begins
    asked = np.concatenate([asked, np.round(down[:, None] * asked[-1]).astype(np.int64), asked])
    speed = np.concatenate([plan.load, down * plan.load[-1], plan.load])
    share = np.arange(len(asked)) / len(asked)
    if case.resistance is not None:
        asked[:, 4], asked[:, 5] = np.round(winding_c(share) / si_per_lsb("temp_winding", drive)), 1
    return asked, speed


def free_plan(drive: Drive) -> Scenario:
    """Speed control of a free shaft; i_d keeps the legs in current."""
    points = np.array([(speed, i_d) for i_d in FREE_D_A for speed in FREE_RAD_S])
    before = np.concatenate([np.zeros((1, 2)), points[:-1]])
    rise = np.minimum((np.arange(FREE_ROWS) + 1) / FREE_RAMP, 1.0)[None, :, None]
    speed, i_d = np.concatenate(before[:, None, :] + rise * (points - before)[:, None, :]).T
    none, ones = np.zeros(len(speed), np.int64), np.ones(len(speed), np.int64)
    omega = speed * drive.machine.pole_pairs / si_per_lsb("omega_ref", drive)
    i_d_ref = np.round(i_d / si_per_lsb("i_d_ref", drive)).astype(np.int64)
    return Scenario(
        omega_ref=np.round(omega).astype(np.int64), load=speed, u_dc=0.0 * speed + drive.inverter.dc_bus_v,
        i_d_ref=i_d_ref, i_q_ext=none, speed_mode=ones, enable=ones,
    )  # fmt: skip


def moving(case: Case, motor: motor_model.Registers, speed: np.ndarray, scale: Scale) -> Moving:
    """What is written into the motor's registers while it runs."""
    stays, share, port = constant(motor, len(speed)), np.arange(len(speed)) / len(speed), PORTS["omega_set"].fmt
    found = {}
    if not case.free:
        found["omega_set"] = np.array(
            [code("omega_set", x * scale.step_s / (2 * math.pi), port) for x in speed], np.int64
        )
    if case.resistance is not None:
        factor = case.resistance(share)
        found |= {x: np.round(getattr(stays, x) * factor).astype(np.int64) for x in ("r_a", "r_b", "r_c")}
    if case.magnets is not None:
        found["psi_m"] = np.round(stays.psi_m * case.magnets(share)).astype(np.int64)
    return stays._replace(**found)


def recorded(case: Case, folder: Path) -> tuple[Path, Path, Machine]:
    """(telemetry, drive file, true machine) of a case."""
    text = example.DRIVE_FILE.read_text().replace("clock_hz = 200e6", f"clock_hz = {CLOCK_HZ:g}")
    text = text.replace("dead_time_s = 2e-6", f"dead_time_s = {DEAD_S:.9g}") + DESCRIBED
    path = write_text(folder / "drive.toml", text)
    drive = load(path)
    hil, scale, machine = bench(case, drive)
    asked, speed = references(case, drive)
    samples, observed = record(hil, asked, moving(case, hil.motor, speed, scale))
    stopped = np.flatnonzero(samples[1:, -1] == 0)
    if len(stopped):
        raise RuntimeError(f"{case.name}: the core tripped before sample {stopped[0] + 1}")
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
        "effect": case.name,
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
        folder = BUILD / "studies" / "hil_truth" / case.name
        folder.mkdir(parents=True, exist_ok=True)
        rows.append(judged(case, folder))
        write_json(BUILD / "studies" / "hil_truth.json", rows)
        print(f"{rows[-1]['effect']}: {rows[-1]['verdict']} {rows[-1]['named']} {rows[-1]['sigmas_off']}", flush=True)
    effects = [row for row, case in zip(rows, CASES, strict=True) if case.effect]
    healthy = [row for row, case in zip(rows, CASES, strict=True) if not case.effect]
    sized = [row for row in effects if row["alone"] and row["sigmas_off"]]
    within = [row for row in sized if all(abs(x) <= WITHIN for x in row["sigmas_off"].values())]
    return [
        least(
            "known truth: effects named, alone, drive file unchanged", sum(r["alone"] for r in effects), ASKED, "of 24"
        ),
        least("known truth: sizes within two standard deviations", len(within), len(sized), "effects"),
        most("known truth: digital differences", sum(not r["equal"] for r in rows), 0, "recordings"),
        most(
            "known truth: mismatches without an effect",
            sum(row["verdict"] != "no_mismatch" for row in healthy),
            0,
            "recordings",
        ),
    ]
