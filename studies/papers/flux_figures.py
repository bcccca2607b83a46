# SPDX-License-Identifier: BSD-3-Clause
"""The figures of paper 001, one function each: runs the scenarios and returns what was found, with its traces."""

from __future__ import annotations

import numpy as np

from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.scenarios import RPM, scenario
from fluxproof.plant import IMPOSED_SPEED
from studies.papers.flux_bench import (
    DRIVE,
    EARLIER,
    LAMBDA_N,
    LOADED,
    NOMINAL,
    T_S,
    TORQUE_N,
    Experiment,
    Finding,
    Trace,
    held_at,
    limit_current,
    mean_error,
    run,
    scaled,
    window,
    wrong_by,
)

SETTLED = 0.005  # of lambda_n: within this the estimate counts as settled


def figs_3_4() -> Experiment:
    """239 rpm, nominal torque step, all three magnetic parameters at 1.3 times their value."""
    earlier, proposed = run(LOADED, wrong_by(1.3, flux_mode=EARLIER)), run(LOADED, wrong_by(1.3))
    end, step = window(0.9, 1.0), window(0.4, 1.0)
    found = []
    for axis in "dq":
        left = 100 * earlier.error(axis)[end].mean()
        found.append(
            Finding(
                f"Fig. 3: steady error of eq. (16), {axis} axis",
                "remains",
                left,
                "% of lambda_n",
                abs(left) > 1,
            )
        )
    for axis in "dq":
        left = 100 * proposed.error(axis)[end].mean()
        found.append(
            Finding(f"Fig. 4: steady error of eq. (17), {axis} axis", 0.0, left, "% of lambda_n", abs(left) < 0.2)
        )
    worst = proposed.worst(end)
    found.append(
        Finding("Fig. 4: worst sample of the last 100 ms, both axes", None, worst, "% of lambda_n", worst < 0.2)
    )
    found.append(
        Finding("Fig. 4: worst sample from the torque step on", None, proposed.worst(step), "% of lambda_n", True)
    )
    return Experiment(
        "Figs. 3, 4: 239 rpm, nominal torque step, magnetic parameters x 1.3",
        found,
        {"earlier": earlier, "proposed": proposed},
    )


def figs_9_10() -> Experiment:
    """183 to 732 rpm, then the nominal load, the speed regulator at its limit in both steps."""
    scene = scenario(DRIVE, 1.2, rpm={0.0: 183, 0.3: 732}, load={0.7: TORQUE_N}, start_rpm=183)
    views = {
        "right parameters": run(scene, scaled(NOMINAL, {}, **limit_current(3.9))),
        "x 1.3": run(scene, wrong_by(1.3, **limit_current(3.9))),
    }
    both = window(0.3, 1.2)
    limited = views["right parameters"].speed_limited
    at = {
        name: limited[window(t, 1.2 if t > 0.5 else 0.7)].sum() * T_S * 1e3
        for name, t in (("speed", 0.3), ("load", 0.7))
    }
    found = [
        Finding(f"Fig. 9: speed regulator at its limit after the {name} step", "saturated", ms, "ms", ms > 1)
        for name, ms in at.items()
    ]
    for name, view in views.items():
        found.append(
            Finding(
                f"Fig. 10: rms error over both steps, {name}",
                "good tracking",
                view.rms(both),
                "% of lambda_n",
                view.rms(both) < 1.5,
            )
        )
        found.append(
            Finding(
                f"Fig. 10: worst sample, {name}",
                None,
                view.worst(both),
                "% of lambda_n",
                view.worst(both) < 10,
            )
        )
    end = mean_error(views["x 1.3"], window(1.1, 1.2))
    found.append(Finding("Fig. 10: steady error under load, x 1.3", 0.0, end, "% of lambda_n", end < 0.2))
    return Experiment("Figs. 9, 10: 183 to 732 rpm, nominal load step", found, views)


def figs_11_12() -> Experiment:
    """119 % load at low speed; the rotor blocked by a brake of 127 %, then released; 4.7 A as in the paper."""
    slow = scenario(DRIVE, 1.2, rpm={0.0: 60}, load={0.3: 1.19 * TORQUE_N}, start_rpm=60)
    blocked = scenario(
        DRIVE, 1.6, rpm={0.0: 183}, load={0.0: 0.5}, brake={0.3: 1.27 * TORQUE_N, 0.9: 0.0}, start_rpm=183
    )
    found, views = [], {}
    for name, factor in (("right parameters", 1.0), ("x 1.3", 1.3)):
        at_limit = wrong_by(factor, **limit_current(4.7))
        view = views[f"119 % load, {name}"] = run(slow, at_limit)
        end = mean_error(view, window(1.1, 1.2))
        worst = view.worst(window(0.2, 1.2))
        found.append(
            Finding(
                f"Fig. 11: steady error under 119 % load at 60 rpm, {name}",
                "follows",
                end,
                "% of lambda_n",
                end < 0.2,
            )
        )
        found.append(Finding(f"Fig. 11: worst sample, {name}", None, worst, "% of lambda_n", worst < 20))
        view = views[f"blocked, {name}"] = run(blocked, at_limit)
        held = window(0.5, 0.9)
        inside = np.abs(view.rpm[held] * RPM).max()
        worst, during, end = (
            view.worst(window(0.2, 1.6)),
            view.worst(held),
            mean_error(view, window(1.5, 1.6)),
        )
        found.append(Finding(f"Fig. 12: fastest while blocked, {name}", "0", inside, "rad/s", inside < 2.0))
        found.append(
            Finding(
                f"Fig. 12: current while blocked, {name}",
                4.7,
                view.i_q[held].mean(),
                "A",
                abs(view.i_q[held].mean() - 4.7) < 0.1,
            )
        )
        found.append(
            Finding(
                f"Fig. 12: worst sample while blocked, {name}",
                "follows",
                during,
                "% of lambda_n",
                during < (5 if factor == 1 else 15),
            )
        )
        found.append(
            Finding(f"Fig. 12: worst sample of the whole run, {name}", None, worst, "% of lambda_n", worst < 25)
        )
        found.append(
            Finding(f"Fig. 12: steady error after release, {name}", "follows", end, "% of lambda_n", end < 0.2)
        )
    return Experiment("Figs. 11, 12: 119 % load at low speed; blocked rotor at 127 %, release", found, views)


STEPS = {0.4: 1.3, 0.9: 0.7, 1.4: 1.0}


def stepped(name: str, factors: dict[float, float], rpm: float) -> Scenario:
    """82 % load while one register steps through factors of its nominal value."""
    nominal = getattr(NOMINAL.values, name)
    changes = {time: {name: round(nominal * factor)} for time, factor in factors.items()}
    return scenario(DRIVE, 1.9, rpm={0.0: rpm}, load={0.0: 3.05}, changes=changes, start_rpm=rpm)


def settling_ms(view: Trace, start: float, end: float) -> float:
    """From a step until both errors stay within SETTLED of lambda_n."""
    part = window(start, end)
    outside = np.flatnonzero(np.maximum(np.abs(view.error("d")[part]), np.abs(view.error("q")[part])) > SETTLED)
    return 0.0 if not len(outside) else (outside[-1] + 1) * T_S * 1e3


def figs_13_14_15() -> Experiment:
    """L_q, L_d, lambda_mg of the estimator at 1, 1.3, 0.7 and 1 times the motor's, at 183 rpm under 82 % load."""
    found, views = [], {}
    for figure, name in ((13, "l_q"), (14, "l_d"), (15, "lambda_mg")):
        view = views[name] = run(stepped(name, STEPS, 183))
        ends = [*list(STEPS)[1:], 1.9]
        for (start, factor), end in zip(STEPS.items(), ends, strict=True):
            left, took = mean_error(view, window(end - 0.1, end)), settling_ms(view, start, end)
            label = f"Fig. {figure}: {name} x {factor:g}"
            found.append(Finding(f"{label}, error after settling", 0.0, left, "% of lambda_n", left < 0.2))
            found.append(Finding(f"{label}, settling to 0.5 %", "a short transient", took, "ms", took < 300))
        worst = view.worst(window(0.4, 1.9))
        found.append(Finding(f"Fig. {figure}: worst sample", None, worst, "% of lambda_n", True))
    return Experiment("Figs. 13, 14, 15: L_q, L_d, lambda_mg at 1, 1.3, 0.7, 1", found, views)


def fig_16() -> Experiment:
    """R_s of the estimator 40 % up and down at 549 rpm: eq. (21)."""
    view, found = run(stepped("r_s", {0.4: 1.4, 0.9: 0.6, 1.4: 1.0}, 549)), []
    before = {axis: view.error(axis)[window(0.3, 0.4)].mean() * LAMBDA_N for axis in "dq"}
    for sign, end in ((0.4, 0.9), (-0.4, 1.4)):
        part = window(end - 0.1, end)
        omega = view.rpm[part].mean() * RPM * DRIVE.machine.pole_pairs
        wanted = -view.i_q[part].mean() * sign * DRIVE.machine.resistance_ohm / omega
        moved = {axis: view.error(axis)[part].mean() * LAMBDA_N - before[axis] for axis in "dq"}
        off = 100 * (moved["d"] / wanted - 1)
        label = f"Fig. 16: R_s {100 * sign:+.0f} %"
        found.append(
            Finding(
                f"{label}, lambda_d moves by",
                float(f"{1e3 * wanted:.4g}"),
                1e3 * moved["d"],
                "mWb",
                abs(off) < 2,
            )
        )
        found.append(Finding(f"{label}, against -i_q*dR/omega", 0.0, off, "%", abs(off) < 2))
        still = 100 * abs(moved["q"]) / LAMBDA_N
        found.append(Finding(f"{label}, lambda_q moves by", 0.0, still, "% of lambda_n", still < 0.2))
    back = mean_error(view, window(1.8, 1.9))
    found.append(Finding("Fig. 16: error after return", 0.0, back, "% of lambda_n", back < 0.2))
    return Experiment("Fig. 16: R_s +-40 % at 549 rpm", found, {"r_s": view})


SENSITIVITY_RPM = (150, 239, 375, 549, 900, 1500, 2500)
SENSITIVITY_CURRENTS = ((0.0, 1.85), (0.0, 3.7), (-2.0, 3.7), (-4.0, 1.85))


def fig_2() -> Experiment:
    """Sensitivity to R_s over speed and load: simulated with R_s 10 % up and down against eq. (21)."""
    resistance, points, found = DRIVE.machine.resistance_ohm, [], []
    for i_d, i_q in SENSITIVITY_CURRENTS:
        for rpm in SENSITIVITY_RPM:
            scene, end = held_at(rpm, i_d, i_q), window(0.5, 0.6)
            up, down = (run(scene, scaled(NOMINAL, {"r_s": f}), mode=IMPOSED_SPEED) for f in (1.1, 0.9))
            got = {x: (up.estimate[x][end].mean() - down.estimate[x][end].mean()) / 0.2 / LAMBDA_N for x in "dq"}
            omega = rpm * RPM * DRIVE.machine.pole_pairs
            wanted = {"d": -i_q * resistance / omega / LAMBDA_N, "q": i_d * resistance / omega / LAMBDA_N}
            points.append((i_d, i_q, rpm, got["d"], got["q"], wanted["d"], wanted["q"]))
    table = np.array(points)
    for n, axis in enumerate("dq"):
        got, wanted = table[:, 3 + n], table[:, 5 + n]
        some = np.abs(wanted) > 1e-9
        off = 100 * np.abs(got[some] / wanted[some] - 1).max()
        found.append(
            Finding(
                f"Fig. 2: sensitivity of lambda_{axis}, largest distance from eq. (21)",
                0.0,
                off,
                "% of the curve",
                off < 2,
            )
        )
        none = 100 * np.abs(got[~some]).max() if (~some).any() else 0.0
        if (~some).any():
            found.append(
                Finding(
                    f"Fig. 2: sensitivity of lambda_{axis} where eq. (21) says none",
                    0.0,
                    none,
                    "%",
                    none < 0.2,
                )
            )
    return Experiment("Fig. 2: sensitivity to R_s over speed and load", found, {"points": table})


EXPERIMENTS = (figs_3_4, fig_2, figs_9_10, figs_11_12, figs_13_14_15, fig_16)
