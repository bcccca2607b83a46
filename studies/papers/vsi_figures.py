# SPDX-License-Identifier: BSD-3-Clause
"""The figures and tables of paper 000, one function each: runs the scenarios and returns what was found."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from fluxproof.cosim.scenarios import scenario
from fluxproof.plant import FREE
from golden_model.drive_keys import DriveError
from golden_model.registers import registers
from golden_model.units import TURN_RAD
from studies.papers.flux_bench import Experiment, Finding, scaled
from studies.papers.vsi_bench import (
    DRIVE,
    FAST,
    I_Q,
    MACHINE,
    NOMINAL,
    T_S,
    Run,
    harmonic,
    held_at,
    last,
    leg_loss,
    run,
    without,
)

PAPER_PSI = {300: (68.3, 86.4), 150: (73.3, 110.2)}  # mWb with and without, Fig. 11
OPEN_CIRCUIT = 70.7
# Table I as printed: signs of i_a, i_b, i_c in the six sectors of theta_e, from -30 degrees on.
TABLE_I = ((1, -1, -1), (1, -1, 1), (-1, -1, 1), (-1, 1, 1), (-1, 1, -1), (1, 1, -1))
_LEARNT: dict[int, Run] = {}


def eq_5(theta, signs) -> tuple[np.ndarray, np.ndarray]:
    """D_d and D_q of eq. (5) in real numbers."""
    a, b, c = signs
    third = TURN_RAD / 3
    d_d = 2 * (a * np.cos(theta) + b * np.cos(theta - third) + c * np.cos(theta + third))
    d_q = 2 * (-a * np.sin(theta) - b * np.sin(theta - third) + c * np.sin(theta - third / 2))
    return d_d, d_q


def learnt(rpm: int) -> Run:
    """Compensated and settled at i_q = 4 A; the same run serves several figures."""
    if rpm not in _LEARNT:
        _LEARNT[rpm] = run(held_at(rpm, 0.0, I_Q, 6.0), scaled(NOMINAL, FAST))
    return _LEARNT[rpm]


def fig_1_table_i() -> Experiment:
    """D_d and D_q: eq. (5) against Table I, and what the core makes of them at i_d = 0."""
    theta_e = np.radians(np.arange(-30, 330) + 0.5)
    theta = theta_e - math.pi / 2
    third = TURN_RAD / 3
    currents = [-np.sin(theta), -np.sin(theta - third), -np.sin(theta + third)]
    by_5 = eq_5(theta, [np.where(i >= 0, 1, -1) for i in currents])
    sector = np.arange(360) // 60
    table = (4 * np.sin(theta_e - sector * math.pi / 3), 4 * np.cos(theta_e - sector * math.pi / 3))
    wrong = []
    for row, signs in enumerate(TABLE_I):
        at = slice(60 * row, 60 * row + 60)
        if any(np.abs(x - t).max() > 1e-9 for x, t in zip(eq_5(theta[at], signs), (y[at] for y in table), strict=True)):
            wrong.append(row)
            swapped = (signs[0], signs[2], signs[1])
            fits = zip(eq_5(theta[at], swapped), (y[at] for y in table), strict=True)
            assert all(np.abs(x - t).max() < 1e-9 for x, t in fits), "b and c exchanged do not mend the row"
    far = max(np.abs(x - t).max() for x, t in zip(by_5, table, strict=True))
    view = learnt(300)
    z = last(1.0)
    found = [
        Finding(
            "Table I: its D_d, D_q against eq. (5) with the currents of i_d = 0",
            None,
            far,
            "largest difference",
            far < 1e-9,
        ),
        Finding(
            "Table I: rows whose signs of i_b and i_c are exchanged against eq. (5)",
            None,
            len(wrong),
            "of 6",
            wrong == [1, 2, 4, 5],
        ),
        Finding("Fig. 1: mean of D_d", 0.0, float(view.d_d[z].mean()), "1", abs(view.d_d[z].mean()) < 0.02),
        Finding(
            "Fig. 1: amplitude of D_d",
            2.0,
            float(np.abs(view.d_d[z]).max()),
            "1",
            abs(np.abs(view.d_d[z]).max() - 2) < 0.15,
        ),
        Finding(
            "Fig. 1: mean of D_q",
            "12/pi = 3.82",
            float(view.d_q[z].mean()),
            "1",
            abs(view.d_q[z].mean() - 12 / math.pi) < 0.05,
        ),
    ]
    for name, signal in (("D_d", view.d_d[z]), ("D_q", view.d_q[z])):
        spectrum = {k: harmonic(signal, view.theta[z], k) for k in range(1, 13)}
        top = max(spectrum, key=spectrum.get)
        found.append(Finding(f"Fig. 1: largest harmonic of {name}", 6, top, "order", top == 6))
    return Experiment("Fig. 1, Table I: the direction functions", found, {"view": view, "table": (theta_e, *table)})


def fig_5() -> Experiment:
    """The paper's own gains: V_dead converges for 15 s, then compensation drives it to zero."""
    start = 15.0
    scene = held_at(300, 0.0, I_Q, 50.0, changes={start: {"compensate": 1}})
    view = run(scene, scaled(NOMINAL, compensate=0))
    before, end = slice(round(14 / T_S), round(start / T_S)), last(2.0)
    settled = view.v_dead[before].mean()
    reached = np.flatnonzero(np.abs(view.v_dead - settled) < 0.05 * settled)
    left = abs(view.v_dead[end].mean())
    total = (view.v_dead + view.v_comp)[end].mean()
    found = [
        Finding(
            "Fig. 5(a): V_dead settles at (a third of the leg voltage)",
            0.25,
            settled / 3,
            "V",
            0.1 < settled / 3 < 0.8,
        ),
        Finding(
            "Fig. 5(a): within 5 % after",
            None,
            float(view.ms[reached[0]] / 1e3),
            "s",
            view.ms[reached[0]] < 14e3,
        ),
        Finding(
            "Fig. 5(b): V_dead left, 35 s after compensation begins",
            0.0,
            left / 3,
            "V",
            left < 0.03 * settled,
        ),
        Finding(
            "Fig. 5(b): leg voltage found against the plant's",
            None,
            100 * (total / leg_loss() - 1),
            "%",
            abs(total / leg_loss() - 1) < 0.05,
        ),
    ]
    return Experiment("Fig. 5: V_dead is found, then driven to zero", found, {"view": view})


def figs_6_7_8() -> Experiment:
    """Harmonics of the currents at 300 rpm and 4 A, without and with compensation."""
    on, off = learnt(300), run(held_at(300, 0.0, I_Q, 2.0), without(NOMINAL))
    z, found = last(1.0), []

    def alpha(view: Run) -> np.ndarray:
        return (view.i_d * np.cos(view.theta) - view.i_q * np.sin(view.theta))[z]

    rows = [(f"6th of i_{x}", [harmonic(getattr(v, f"i_{x}")[z], v.theta[z], 6) for v in (off, on)]) for x in "dq"]
    rows += [(f"{k}th of i_alpha", [harmonic(alpha(v), v.theta[z], k) for v in (off, on)]) for k in (5, 7)]
    for name, (raw, clean) in rows:
        found.append(Finding(f"Figs. 6-8: {name} without compensation", None, 1e3 * raw, "mA", raw > 0.01))
        found.append(
            Finding(
                f"Figs. 6-8: {name}, times less with compensation",
                "negligible left",
                raw / clean,
                "times",
                raw / clean > 5,
            )
        )
    return Experiment("Figs. 6, 7, 8: current harmonics", found, {"without": off, "with": on})


def figs_16_17() -> Experiment:
    """A free shaft at 300 rpm under a constant load of 4 A: the 6th harmonic of the speed, 150 Hz."""
    load = 1.5 * 5 * 0.0683 * I_Q - DRIVE.machine.viscous_friction_nms * 31.4
    scene = scenario(DRIVE, 3.0, rpm={0.0: 300}, load={0.0: load}, start_rpm=300)
    on = run(scene, scaled(NOMINAL, FAST), mode=FREE, state=learnt(300).result.state)
    off = run(scene, without(NOMINAL), mode=FREE)
    z = last(1.0)
    raw, clean = (harmonic(v.rpm[z], v.theta[z], 6) for v in (off, on))
    found = [
        Finding("Figs. 16, 17: speed at 150 Hz without compensation", None, 1e3 * raw, "mrpm", raw > 0),
        Finding("Figs. 16, 17: times less with compensation", "gone", raw / clean, "times", raw / clean > 5),
    ]
    return Experiment("Figs. 16, 17: the speed's 6th harmonic", found, {"without": off, "with": on})


def fig_11() -> Experiment:
    """psi_m at 300 and 150 rpm with and without what is known of the inverter."""
    found, views, extra = [], {}, {}
    z = last(1.0)
    for rpm in (300, 150):
        on, off = learnt(rpm), run(held_at(rpm, 0.0, I_Q, 4.0), without(NOMINAL))
        views[f"{rpm} rpm, with"], views[f"{rpm} rpm, without"] = on, off
        true = 1e3 * on.lambda_d[z].mean()
        with_, wanted = 1e3 * on.psi_m[z].mean(), PAPER_PSI[rpm]
        raw = 1e3 * off.psi_m[z].mean()
        extra[rpm] = raw - with_
        omega = rpm * TURN_RAD / 60 * DRIVE.machine.pole_pairs
        by_loss = true + 1e3 * 4 / math.pi * leg_loss() / omega
        found += [
            Finding(
                f"Fig. 11: psi_m at {rpm} rpm with compensation",
                wanted[0],
                with_,
                "mWb",
                abs(with_ / true - 1) < 0.01,
            ),
            Finding(
                f"Fig. 11: the plant's flux at {rpm} rpm and 4 A (70.7 less 2.4 of cross-saturation)",
                None,
                true,
                "mWb",
                True,
            ),
            Finding(f"Fig. 11: psi_m at {rpm} rpm without", wanted[1], raw, "mWb", abs(raw / by_loss - 1) < 0.03),
            Finding(f"Fig. 11: the plant's flux plus 4/pi*loss/omega at {rpm} rpm", None, by_loss, "mWb", True),
        ]
    ratio = extra[150] / extra[300]
    found.append(
        Finding(
            "Fig. 11: error without compensation at 150 rpm over that at 300 rpm",
            2.04,
            ratio,
            "times",
            1.8 < ratio < 2.2,
        )
    )
    return Experiment("Fig. 11: the magnets' flux", found, views)


def figs_12_13() -> Experiment:
    """Winding and magnets warm up and cool down: R by the thermocouple, psi_m against the plant's flux."""
    points, found = [], []
    state = learnt(300).result.state
    for winding, magnets in ((25, 25), (60, 35), (95, 60), (90, 75), (70, 80), (45, 60), (25, 30)):
        machine = dataclasses.replace(MACHINE, temperature_winding_c=winding, temperature_magnet_c=magnets)
        scene = dataclasses.replace(held_at(300, 0.0, I_Q, 2.0), temp_winding=np.full(round(2.0 / T_S), float(winding)))
        view = run(scene, scaled(NOMINAL, FAST), machine, state=state)
        lost = run(held_at(300, 0.0, I_Q, 2.0), scaled(NOMINAL, FAST), machine, state=state)
        state, z = view.result.state, last(0.5)
        points.append(
            (
                winding,
                magnets,
                1e3 * view.lambda_d[z].mean(),
                1e3 * view.psi_m[z].mean(),
                1e3 * lost.psi_m[z].mean(),
            )
        )
    table = np.array(points)
    off, blind = (100 * np.abs(table[:, k] / table[:, 2] - 1).max() for k in (3, 4))
    found.append(
        Finding(
            "Figs. 12, 13: psi_m against the plant's flux, worst of seven temperatures",
            "good",
            off,
            "%",
            off < 0.5,
        )
    )
    found.append(Finding("Figs. 12, 13: the same without the thermocouple, R = R_0", None, blind, "%", blind > off))
    return Experiment("Figs. 12, 13: resistance and magnets over temperature", found, {"points": table})


def eq_b3() -> Experiment:
    """Steps inside (B.3) converge, steps outside are refused with the reason; without the flux estimator, as there."""
    found = []
    for eta in (1e-5, 1e-3, 0.12):
        drive = dataclasses.replace(DRIVE, control=dataclasses.replace(DRIVE.control, v_dead_eta=eta))
        seconds = 20.0 if eta < 1e-4 else 3.0
        view = run(held_at(300, 0.0, I_Q, seconds), scaled(registers(drive), compensate=0, flux_mode=0))
        middle, end = view.v_dead[len(view.v_dead) // 2 :].mean(), view.v_dead[last(0.5)].mean()
        steady = abs(end / middle - 1)
        found.append(
            Finding(
                f"eq. (B.3): eta = {eta:g} settles at",
                "converges",
                end,
                "V of a leg",
                0 < end < 3 and steady < 0.1,
            )
        )
    rated = DRIVE.machine.pole_pairs * DRIVE.machine.rated_speed_rad_s
    for name, value in (("v_dead_eta", 0.125), ("psi_eta", 0.5 / rated**2)):
        try:
            dataclasses.replace(DRIVE, control=dataclasses.replace(DRIVE.control, **{name: value}))
            said = "accepted"
        except DriveError as error:
            said = str(error)
        found.append(Finding(f"eq. (B.3): {name} = {value:.4g}", "refused", said, "", "(B.3)" in said))
    return Experiment("eq. (B.3): the range of the steps", found)


EXPERIMENTS = (fig_1_table_i, fig_5, figs_6_7_8, figs_16_17, fig_11, figs_12_13, eq_b3)
