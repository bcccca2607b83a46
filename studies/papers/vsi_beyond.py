# SPDX-License-Identifier: BSD-3-Clause
"""Beyond paper 000: i_d /= 0, a salient motor, and both papers together."""

from __future__ import annotations

import dataclasses

import numpy as np

from fluxproof.cosim.golden_loop import simulate
from fluxproof.plant import IMPOSED_SPEED, Machine
from golden_model import drive as drives
from golden_model.registers import registers
from studies.papers import flux_bench, vsi_bench
from studies.papers.flux_bench import Experiment, Finding, scaled
from studies.papers.vsi_bench import (
    DRIVE,
    FAST,
    I_Q,
    MACHINE,
    NOMINAL,
    harmonic,
    held_at,
    last,
    leg_loss,
    run,
    without,
)


def salient() -> tuple[drives.Drive, Machine]:
    """An interior-magnet sibling: twice the inductance in q, everything else alike."""
    description = dataclasses.replace(DRIVE.machine, inductance_q_h=2 * DRIVE.machine.inductance_d_h)
    return dataclasses.replace(DRIVE, machine=description), Machine.from_mapping(vars(description))


def any_i_d() -> Experiment:
    """The leg's loss for i_d from -0.5 to +0.5 of the rated current, surface and interior magnets."""
    found, rows = [], []
    interior, machine = salient()
    for name, plant, register_set in (
        ("surface", MACHINE, NOMINAL),
        ("interior", machine, registers(interior)),
    ):
        worst = 0.0
        for i_d in (-5.0, -2.5, 0.0, 2.5, 5.0):
            view = run(held_at(300, i_d, I_Q, 8.0), scaled(register_set, FAST), plant)
            z = last(1.0)
            off = 100 * ((view.v_dead + view.v_comp)[z].mean() / leg_loss() - 1)
            worst = max(worst, abs(off))
            true = view.lambda_d[z].mean() - DRIVE.machine.inductance_d_h * i_d
            rows.append((i_d, name == "interior", off, 100 * (view.psi_m[z].mean() / true - 1)))
        found.append(
            Finding(
                f"i_d from -5 to 5 A, {name} magnets: worst error of the leg voltage",
                None,
                worst,
                "%",
                worst < 10,
            )
        )
    table = np.array(rows)
    psi = np.abs(table[:, 3]).max()
    found.append(Finding("i_d from -5 to 5 A: worst error of psi_m, with the term of L_d*i_d", None, psi, "%", psi < 3))
    return Experiment("Any i_d, surface and interior magnets", found, {"table": table})


def both_papers() -> Experiment:
    """Paper 001's flux under rated load with 2 us of dead time and a hot winding, without and with paper 000."""
    machine = dataclasses.replace(flux_bench.DRIVE.machine, resistance_temp_coeff_per_k=0.0039, temperature_ref_c=20.0)
    drive = dataclasses.replace(flux_bench.DRIVE, machine=machine)
    hot = dataclasses.replace(Machine.from_mapping(vars(machine)), temperature_winding_c=80.0)
    own = registers(drive)
    faster = scaled(own, {"eta_v": 20, "zeta": 10})
    found, rows = [], []
    for rpm in (60, 100, 183, 239, 400):
        errors = {}
        for name, register_set, temperature in (("without", without(own), np.nan), ("with", faster, 80.0)):
            scene = held_at(rpm, 0.0, 3.7, 6.0, drive)
            scene = dataclasses.replace(scene, temp_winding=np.full(len(scene), temperature))
            options = {"dead_time_s": drive.inverter.dead_time_s, "mode": IMPOSED_SPEED}
            view = vsi_bench.trace(simulate(drive, register_set, scene, hot, **options), drive)
            z = last(0.5)
            pairs = ((view.estimate_d, view.lambda_d), (view.estimate_q, view.lambda_q))
            errors[name] = 100 * float(np.hypot(*(np.mean(a[z] - b[z]) for a, b in pairs))) / flux_bench.LAMBDA_N
        rows.append((rpm, errors["without"], errors["with"]))
        ratio = errors["without"] / errors["with"]
        found += [
            Finding(
                f"Both papers: flux error at {rpm} rpm, rated load, 2 us, R +23 %, without",
                None,
                errors["without"],
                "% of lambda_n",
                True,
            ),
            Finding("Both papers: the same with V_dead and R(T)", None, errors["with"], "% of lambda_n", True),
            Finding(f"Both papers: times less at {rpm} rpm", None, ratio, "times", ratio > 5),
        ]
    return Experiment("Both papers together", found, {"table": np.array(rows)})


def details() -> Experiment:
    """What foreseeing, a narrow line through zero and a learnt loss are each worth, at 300 rpm."""
    found = []

    def loss(register_set) -> tuple[float, float]:
        view, z = run(held_at(300, 0.0, I_Q, 6.0), scaled(register_set, FAST)), last(1.0)
        return 100 * ((view.v_dead + view.v_comp)[z].mean() / leg_loss() - 1), harmonic(view.i_d[z], view.theta[z], 6)

    cases = {
        "as it is": NOMINAL,
        "directions as measured, not foreseen": scaled(NOMINAL, {"k_ahead": 0.4}),  # of 2.5 samples: to the next sample
        "line through zero twice as wide": scaled(NOMINAL, {"k_sign": 0.5}),
        "line through zero fifteen times as wide": scaled(NOMINAL, {"k_sign": 1 / 15}),
    }
    for name, register_set in cases.items():
        off, sixth = loss(register_set)
        good = name != "as it is" or abs(off) < 2
        found.append(Finding(f"Details: leg voltage found, {name}", None, off, "% off", good))
        found.append(Finding(f"Details: 6th of i_d, {name}", None, 1e3 * sixth, "mA", True))
    state = run(held_at(300, 0.0, I_Q, 4.0), scaled(NOMINAL, FAST)).result.state
    ringing = {}
    for name, register_set, start in (("nothing learnt", without(NOMINAL), None), ("learnt", NOMINAL, state)):
        view = run(held_at(300, 0.0, 0.0, 1.5), register_set, state=start)
        ringing[name] = float(np.std(view.i_q[last(0.5)]))
        good = name == "nothing learnt" or ringing[name] < 0.3 * ringing["nothing learnt"]
        found.append(Finding(f"Details: rms of i_q at no load, 300 rpm, {name}", None, ringing[name], "A", good))
    return Experiment("What the details are worth", found)


EXPERIMENTS = (any_i_d, both_papers, details)
