# SPDX-License-Identifier: BSD-3-Clause
"""Figures like those of paper 001: actual and estimated flux linkages, and what goes with them."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from golden_model.units import TURN_RAD
from studies.demo.plots import D_AXIS, Q_AXIS, QUIET, REFERENCE, SPEED, STYLE, WIDTH, _axes
from studies.papers.flux_bench import DRIVE, LAMBDA_N, Experiment, Trace

SETTLED_MS = 200.0  # the start from nothing is no part of any experiment
COLOURS = (SPEED, Q_AXIS, D_AXIS, "#8e5ea2")


def _legend(axis) -> None:
    axis.legend(loc="lower right", bbox_to_anchor=(1, 0.98), borderpad=0, ncols=3, frameon=False, fontsize=9)


def fluxes(views: dict[str, Trace], title: str, start: float = SETTLED_MS, end: float | None = None) -> Figure:
    """Actual flux linkages in grey, the estimates over them: d above, q below; times in ms."""
    figure, axes = _axes(2, 1, size=(WIDTH, 4.2), sharex=True)
    for axis, x in zip(axes, "dq", strict=True):
        for colour, (name, view) in zip(COLOURS, views.items(), strict=False):
            part = (view.ms >= start) & (view.ms <= (end or view.ms[-1]))
            actual = "actual" if view is next(iter(views.values())) else None
            axis.plot(view.ms[part], 1e3 * view.actual[x][part], color=QUIET, linewidth=2.6, label=actual)
            axis.plot(view.ms[part], 1e3 * view.estimate[x][part], color=colour, linewidth=0.9, label=name)
        axis.set(ylabel=f"$\\lambda_{x}$ [mWb]")
    axes[0].set_title(title, pad=18)
    _legend(axes[0])
    axes[1].set(xlabel="time [ms]")
    return figure


def motion(view: Trace, title: str) -> Figure:
    """Speed above, currents below."""
    figure, (above, below) = _axes(2, 1, size=(WIDTH, 4.2), sharex=True)
    above.step(view.ms, view.rpm_ref, where="post", color=REFERENCE, linewidth=1.0, linestyle=(0, (4, 2)))
    above.plot(view.ms, view.rpm, color=SPEED)
    above.set(title=title, ylabel="rpm")
    below.plot(view.ms, view.i_q, color=Q_AXIS, label="$i_q$")
    below.plot(view.ms, view.i_d, color=D_AXIS, label="$i_d$")
    below.set(ylabel="A", xlabel="time [ms]", xlim=(0, view.ms[-1]))
    _legend(below)
    return figure


def errors(views: dict[str, Trace], title: str) -> Figure:
    """Error of both axes over time, in percent of the nominal flux."""
    figure, axes = _axes(2, 1, size=(WIDTH, 3.8), sharex=True)
    for axis, x in zip(axes, "dq", strict=True):
        for colour, (name, view) in zip(COLOURS, views.items(), strict=False):
            part = view.ms >= SETTLED_MS
            axis.plot(view.ms[part], 100 * view.error(x)[part], color=colour, linewidth=0.9, label=name)
        axis.set(ylabel=f"{x} error [% of $\\lambda_n$]")
    axes[0].set_title(title, pad=18)
    _legend(axes[0])
    axes[1].set(xlabel="time [ms]")
    return figure


def figs_3_4(e: Experiment) -> dict[str, Figure]:
    views = {"eq. (16), earlier": e.traces["earlier"], "eq. (17), proposed": e.traces["proposed"]}
    return {"flux": fluxes(views, "Figs. 3, 4: 239 rpm, torque step, parameters x 1.3")}


def figs_9_10(e: Experiment) -> dict[str, Figure]:
    view = e.traces["right parameters"]
    return {
        "motion": motion(view, "Fig. 9: 183 to 732 rpm, then the nominal load"),
        "flux": fluxes({"estimate": view}, "Fig. 10: right parameters"),
        "error": errors(e.traces, "Fig. 10: error"),
    }


def figs_11_12(e: Experiment) -> dict[str, Figure]:
    blocked = {name.removeprefix("blocked, "): view for name, view in e.traces.items() if "blocked" in name}
    slow = {name.removeprefix("119 % load, "): view for name, view in e.traces.items() if "119" in name}
    return {
        "slow": fluxes(slow, "Fig. 11: 119 % load at 60 rpm"),
        "motion": motion(blocked["right parameters"], "Fig. 12: blocked from 300 to 900 ms"),
        "blocked": fluxes(blocked, "Fig. 12: blocked rotor"),
    }


def figs_13_14_15(e: Experiment) -> dict[str, Figure]:
    titles = {"l_q": "Fig. 13: $L_q$", "l_d": "Fig. 14: $L_d$", "lambda_mg": "Fig. 15: $\\lambda_{mg}$"}
    return {k: fluxes({"estimate": v}, f"{titles[k]} at 1, 1.3, 0.7, 1", 300) for k, v in e.traces.items()}


def fig_16(e: Experiment) -> dict[str, Figure]:
    return {"flux": fluxes({"estimate": e.traces["r_s"]}, "Fig. 16: $R_s$ +40 %, -40 %, 549 rpm", 300)}


def fig_2(e: Experiment) -> dict[str, Figure]:
    """Curves of eq. (21), simulated points on them."""
    table = e.traces["points"]
    figure, axes = _axes(1, 2, size=(WIDTH, 3.2), sharex=True)
    rpm = np.geomspace(table[:, 2].min(), table[:, 2].max(), 100)
    omega = rpm * TURN_RAD / 60 * DRIVE.machine.pole_pairs
    resistance = DRIVE.machine.resistance_ohm
    for colour, (i_d, i_q) in zip(COLOURS, dict.fromkeys(map(tuple, table[:, :2])), strict=False):
        rows = table[(table[:, 0] == i_d) & (table[:, 1] == i_q)]
        for n, (axis, current) in enumerate(zip(axes, (-i_q, i_d), strict=True)):
            axis.plot(rpm, current * resistance / omega / LAMBDA_N, color=colour, linewidth=1.0)
            axis.plot(rows[:, 2], rows[:, 3 + n], "o", color=colour, markersize=3.5, label=f"{i_d:g}, {i_q:g} A")
    for axis, x in zip(axes, "dq", strict=True):
        axis.set(xscale="log", xlabel="rpm", title=f"Fig. 2: $\\lambda_{x}$")
        axis.set_xticks(ticks := (150, 375, 900, 2500), [str(tick) for tick in ticks])
        axis.minorticks_off()
    axes[0].set_ylabel("sensitivity to $R_s$")
    axes[1].legend(title="$i_d$, $i_q$", frameon=False, fontsize=8, title_fontsize=8)
    return {"curves": figure}


def saturation_and_reversal(e: Experiment) -> dict[str, Figure]:
    view = e.traces["estimate"]
    return {
        "motion": motion(view, "Reversal under load"),
        "flux": fluxes({"estimate": view, "linear model": e.traces["linear current model"]}, "A motor that saturates"),
        "error": errors(e.traces, "Error through zero speed"),
    }


def brusa_map(e: Experiment) -> dict[str, Figure]:
    """Errors over the grid of currents: the linear nameplate, and the estimate that starts from it."""
    if "grid" not in e.traces:
        return {}
    grid = e.traces["grid"]
    figure, axes = _axes(1, 2, size=(WIDTH, 3.0), sharey=True)
    for axis, column, title in zip(axes, (3, 2), ("Linear nameplate", "Estimate"), strict=True):
        points = axis.scatter(grid[:, 0], grid[:, 1], c=grid[:, column], s=150, marker="s", cmap="viridis", zorder=3)
        figure.colorbar(points, ax=axis, label="% of the map's flux")
        axis.set(title=title, xlabel="$i_d$ [A]")
    axes[0].set_ylabel("$i_q$ [A]")
    return {"grid": figure}


def decoupling(e: Experiment) -> dict[str, Figure]:
    figure, axes = _axes(2, 1, size=(WIDTH, 4.4), sharex=True)
    for colour, (name, view) in zip(COLOURS, e.traces.items(), strict=False):
        part = (view.ms > 195) & (view.ms < 290)
        axes[0].plot(view.ms[part], view.i_d[part], color=colour, linewidth=1.0, label=name)
        axes[1].plot(view.ms[part], view.i_q[part], color=colour, linewidth=1.0)
    axes[0].set(ylabel="$i_d$ [A]")
    axes[0].set_title("Speed step 400 to 2400 rpm", pad=34)
    axes[0].legend(loc="lower right", bbox_to_anchor=(1, 0.98), ncols=2, frameon=False, fontsize=8)
    axes[1].set(ylabel="$i_q$ [A]", xlabel="time [ms]")
    return {"currents": figure}


def torque(e: Experiment) -> dict[str, Figure]:
    figure, axes = _axes(len(e.traces), 1, size=(WIDTH, 4.2))
    for axis, (name, view) in zip(axes, e.traces.items(), strict=True):
        axis.plot(view.ms, view.torque, color=QUIET, linewidth=2.4, label="plant")
        axis.plot(view.ms, view.torque_estimate, color=SPEED, linewidth=0.8, label="estimate")
        axis.set(title=name, ylabel="Nm")
        _legend(axis)
    axes[-1].set_xlabel("time [ms]")
    return {"torque": figure}


def current_step(e: Experiment) -> dict[str, Figure]:
    return {"error": errors(e.traces, "Step of i_q from 0 to 3.7 A: error")}


def stability(e: Experiment) -> dict[str, Figure]:
    """Largest eigenvalue over speed, for every combination of wrong parameters."""
    figure, axis = _axes()
    for (inductance, resistance), curve in e.traces["curves"].items():
        label = f"L x {inductance:g}, R x {resistance:g}"
        axis.plot(e.traces["speeds"], curve, linewidth=0.9, label=label)
    axis.axhline(1.0, color=REFERENCE, linewidth=1.1)
    axis.set(title="Largest eigenvalue of drive and estimator", xlabel="electrical speed [rad/s]", ylabel="modulus")
    axis.legend(frameon=False, fontsize=7, ncols=3, loc="lower center")
    return {"eigenvalues": figure}


def rtl(name: str, e: Experiment) -> dict[str, Figure]:
    """The flux linkages of a run of the VHDL; nothing where it did not come to its end."""
    if not e.traces:
        return {}
    with mpl.rc_context(STYLE):
        return {f"rtl_{name}_flux": fluxes(e.traces, e.title, start=20)}


FIGURES = {
    f.__name__: f
    for f in (
        figs_3_4, fig_2, figs_9_10, figs_11_12, figs_13_14_15, fig_16, saturation_and_reversal, brusa_map, decoupling,
        torque, current_step, stability,
    )
}  # fmt: skip
