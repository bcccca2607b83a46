# SPDX-License-Identifier: BSD-3-Clause
"""Beyond paper 001: motors that saturate, reversal through zero, what the decoupling gains, torque."""

from __future__ import annotations

import math

import numpy as np

from fluxproof.checkout import ROOT
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.recording import recording_path
from fluxproof.cosim.scenarios import RPM, scenario
from fluxproof.plant import IMPOSED_SPEED, FluxMap, Machine
from golden_model import drive as drives
from golden_model.registers import registers
from golden_model.units import from_si
from studies.papers.flux_bench import (
    ALONE,
    CURRENT_MODEL,
    DRIVE,
    LOADED,
    NOMINAL,
    T_S,
    TORQUE_N,
    Experiment,
    Finding,
    held_at,
    mean_error,
    run,
    scaled,
    trace,
    window,
    wrong_by,
)

BRUSA_DRIVE = ROOT / "docs" / "drives" / "brusa_hsm1.toml"


def saturating_machine() -> Machine:
    """The paper's motor with iron that saturates: a third of the q inductance is gone at the load of this run."""
    base = vars(DRIVE.machine) | {"saturation_d_per_a2": 0.01, "saturation_q_per_a2": 0.05}
    return Machine.from_mapping(base | {"cross_saturation_wb_per_a2": 2e-4})


def saturation_and_reversal() -> Experiment:
    """A motor that saturates, both directions, through zero under load; its linear nameplate in the estimator."""
    ramp = np.concatenate(
        [
            np.full(4000, 400.0),
            np.linspace(400, -400, 6000),
            np.full(4000, -400.0),
            np.linspace(-400, 400, 6000),
            np.full(3000, 400.0),
        ]
    )
    scene = scenario(DRIVE, len(ramp) * T_S, rpm={0.0: 0.0}, load={0.1: 3.0}, start_rpm=400)
    scene.omega_ref[:] = [from_si("omega_ref", rpm * RPM * DRIVE.machine.pole_pairs, DRIVE) for rpm in ramp]
    view, found = run(scene, machine=saturating_machine()), []
    linear = run(scene, scaled(NOMINAL, {}, flux_mode=CURRENT_MODEL), saturating_machine())
    for name, part in (
        ("forward, motoring", window(0.3, 0.4)),
        ("backward, braking", window(1.3, 1.4)),
        ("forward again", window(2.2, 2.3)),
    ):
        left, model = mean_error(view, part), mean_error(linear, part)
        found.append(Finding(f"Saturating motor: steady error, {name}", None, left, "% of lambda_n", left < 0.2))
        found.append(
            Finding(
                f"Saturating motor: the same of the linear current model, {name}",
                None,
                model,
                "% of lambda_n",
                model > 1,
            )
        )
    through = np.abs(view.rpm) < 60
    jump = 100 * max(np.abs(np.diff(view.error(axis)))[through[1:]].max() for axis in "dq")
    found.append(
        Finding(
            "Saturating motor: largest change of the error in a sample, below 60 rpm",
            "no jump",
            jump,
            "% of lambda_n",
            jump < 1,
        )
    )
    worst = 100 * max(np.abs(view.error(axis)[through]).max() for axis in "dq")
    found.append(Finding("Saturating motor: worst sample below 60 rpm", None, worst, "% of lambda_n", worst < 10))
    return Experiment(
        "A motor that saturates: both directions, through zero",
        found,
        {"estimate": view, "linear current model": linear},
    )


def brusa_map() -> Experiment:
    """The measured flux map of the Brusa HSM1 as the plant, a linear nameplate in the core."""
    title = "A machine with real saturation: the measured Brusa map"
    file = recording_path()[0].parents[1] / "brusa_flux_map" / "brusa_meas.csv"
    if not file.exists():
        skipped = Finding(
            "Brusa map",
            None,
            f"skipped: {file.name} is not there; FLUXPROOF_RECORDINGS names its folder",
            "",
            True,
        )
        return Experiment(title, [skipped])
    table = np.genfromtxt(file, delimiter=",", names=True)
    flux_map = FluxMap.from_points(table["id_A"], table["iq_A"], table["psid_Vs"], table["psiq_Vs"]).mended()
    drive = drives.load(BRUSA_DRIVE)
    machine = Machine.from_mapping({**vars(drive.machine), "flux_map": flux_map})
    alone = scaled(registers(drive), {}, **ALONE)
    rows = []
    for i_d in (-110.0, -80.0, -50.0, -20.0, 0.0):
        for i_q in (-100.0, -60.0, -20.0, 20.0, 60.0, 100.0):
            scene = held_at(1000, i_d, i_q, 1.2, drive)
            view = trace(simulate(drive, alone, scene, machine, mode=IMPOSED_SPEED), scene, drive)
            end = slice(-1000, None)
            actual = np.array([view.actual[x][end].mean() for x in "dq"])
            off = np.array([view.estimate[x][end].mean() for x in "dq"]) - actual
            model = np.array(
                [
                    drive.machine.magnet_flux_wb + drive.machine.inductance_d_h * i_d,
                    drive.machine.inductance_q_h * i_q,
                ]
            )
            length = np.hypot(*actual)
            rows.append((i_d, i_q, 100 * np.hypot(*off) / length, 100 * np.hypot(*(model - actual)) / length))
    grid = np.array(rows)
    worst, linear = grid[:, 2].max(), grid[:, 3].max()
    found = [
        Finding("Brusa map: worst steady error over the grid", None, worst, "% of the map's flux", worst < 1),
        Finding(
            "Brusa map: rms over the grid",
            None,
            math.sqrt(np.mean(grid[:, 2] ** 2)),
            "% of the map's flux",
            True,
        ),
        Finding(
            "Brusa map: worst error of the linear nameplate alone",
            None,
            linear,
            "% of the map's flux",
            linear > 10,
        ),
    ]
    return Experiment(title, found, {"grid": grid})


def decoupling() -> Experiment:
    """A speed step with the decoupling fed by the estimate, by the wrong nameplate, by the right one."""
    scene = scenario(DRIVE, 0.5, rpm={0.0: 400, 0.2: 2400}, load={0.0: 1.0}, start_rpm=400)
    cases = {
        "wrong nameplate x 1.3": wrong_by(1.3, flux_mode=CURRENT_MODEL),
        "estimate, same wrong nameplate": wrong_by(1.3),
        "right nameplate": scaled(NOMINAL, {}, flux_mode=CURRENT_MODEL),
        "estimate, right nameplate": NOMINAL,
    }
    views = {name: run(scene, register_set) for name, register_set in cases.items()}
    part, found = window(0.2, 0.5), []
    d = {name: np.abs(view.i_d[part]).max() for name, view in views.items()}
    over = {name: view.i_q[part].max() - DRIVE.current_limit_a for name, view in views.items()}
    wrong, ours = "wrong nameplate x 1.3", "estimate, same wrong nameplate"
    for name in cases:
        found.append(
            Finding(
                f"Speed step 400 to 2400 rpm: largest |i_d|, {name}",
                None,
                d[name],
                "A",
                name != ours or d[ours] < d[wrong],
            )
        )
        found.append(
            Finding(
                f"Speed step 400 to 2400 rpm: i_q above its limit, {name}",
                None,
                over[name],
                "A",
                name != ours or over[ours] < over[wrong],
            )
        )
    return Experiment("Decoupling by the estimate against decoupling by the nameplate", found, views)


def torque() -> Experiment:
    """Estimated torque against the plant's, in the loaded run with everything wrong and in the reversal."""
    found, views = [], {}
    for name, view in (
        ("239 rpm, x 1.3", run(LOADED, wrong_by(1.3))),
        ("saturating motor", saturation_and_reversal().traces["estimate"]),
    ):
        error = 100 * (view.torque_estimate - view.torque) / TORQUE_N
        end = abs(error[-1000:].mean())
        found.append(Finding(f"Torque: steady error, {name}", None, end, "% of nominal", end < 0.5))
        found.append(
            Finding(
                f"Torque: rms error of the whole run, {name}",
                None,
                float(np.sqrt(np.mean(error**2))),
                "% of nominal",
                True,
            )
        )
        views[name] = view
    return Experiment("Estimated torque", found, views)


def current_step() -> Experiment:
    """A step of the current reference at imposed speeds: the integrals of two samples before know of no error."""
    found, views = [], {}
    for rpm in (239, 732):
        scene = scenario(DRIVE, 0.5, rpm={0.0: 0.0}, i_q={0.3: 3.7}, torque_mode=((0.0, 0.5),), start_rpm=rpm)
        scene.load[:] = rpm * RPM
        view = views[f"{rpm} rpm"] = run(scene, mode=IMPOSED_SPEED)
        worst = view.worst(window(0.29, 0.5))
        found.append(
            Finding(f"Current step 0 to 3.7 A, {rpm} rpm: worst sample", None, worst, "% of lambda_n", worst < 3)
        )
    return Experiment("A step of the current reference", found, views)


EXPERIMENTS = (saturation_and_reversal, brusa_map, decoupling, torque, current_step)
