# SPDX-License-Identifier: BSD-3-Clause
"""Figures like those of paper 000: direction functions, V_dead, currents, the magnets' flux."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from studies.demo.plots import D_AXIS, Q_AXIS, QUIET, REFERENCE, SPEED, WIDTH, _axes
from studies.papers.flux_bench import Experiment
from studies.papers.vsi_bench import leg_loss


def _legend(axis) -> None:
    axis.legend(loc="lower right", bbox_to_anchor=(1, 0.98), borderpad=0, ncols=3, frameon=False, fontsize=9)


def _nothing(_e: Experiment) -> dict[str, Figure]:
    return {}


def fig_1_table_i(e: Experiment) -> dict[str, Figure]:
    view = e.traces["view"]
    part = slice(-500, None)
    figure, axis = _axes()
    axis.plot(view.ms[part], view.d_d[part], color=D_AXIS, label="$D_d$")
    axis.plot(view.ms[part], view.d_q[part], color=Q_AXIS, label="$D_q$")
    axis.set(title="Fig. 1(b): as the core computes them, 300 rpm, 4 A", xlabel="time [ms]")
    _legend(axis)
    return {"functions": figure}


def fig_5(e: Experiment) -> dict[str, Figure]:
    view = e.traces["view"]
    every = slice(None, None, 50)
    figure, axis = _axes()
    axis.plot(view.ms[every] / 1e3, view.v_dead[every], color=SPEED, label="found, not compensated")
    axis.plot(view.ms[every] / 1e3, view.v_comp[every], color=Q_AXIS, label="compensated")
    axis.axhline(leg_loss(), color=REFERENCE, linewidth=1.0, linestyle=(0, (4, 2)))
    axis.set(title="Fig. 5: voltage of a leg", ylabel="V", xlabel="time [s]")
    _legend(axis)
    return {"v_dead": figure}


def currents(e: Experiment) -> dict[str, Figure]:
    """i_d and i_q over two electrical turns without (left) and with compensation (right)."""
    figure, axes = _axes(2, 2, size=(WIDTH, 4.0), sharex="col", sharey="row")
    for column, (name, view) in enumerate(e.traces.items()):
        part = slice(-800, None)
        for row, (signal, colour) in enumerate((("i_d", D_AXIS), ("i_q", Q_AXIS))):
            axes[row][column].plot(view.ms[part], getattr(view, signal)[part], color=colour, linewidth=0.9)
        axes[0][column].set_title(f"{name} compensation")
        axes[1][column].set_xlabel("time [ms]")
    axes[0][0].set_ylabel("$i_d$ [A]")
    axes[1][0].set_ylabel("$i_q$ [A]")
    return {"currents": figure}


def figs_16_17(e: Experiment) -> dict[str, Figure]:
    figure, axis = _axes()
    for (name, view), colour in zip(e.traces.items(), (QUIET, SPEED), strict=True):
        part = slice(-2000, None)
        axis.plot(view.ms[part] - view.ms[part][0], view.rpm[part], color=colour, label=f"{name} compensation")
    axis.set(title="Fig. 16: speed of a free shaft", ylabel="rpm", xlabel="time [ms]")
    _legend(axis)
    return {"speed": figure}


def fig_11(e: Experiment) -> dict[str, Figure]:
    figure, axis = _axes()
    for (name, view), colour in zip(e.traces.items(), (SPEED, QUIET, Q_AXIS, REFERENCE), strict=True):
        every = slice(None, None, 50)
        axis.plot(view.ms[every] / 1e3, 1e3 * view.psi_m[every], color=colour, linewidth=1.0, label=name)
    axis.set(title="Fig. 11: estimated magnet flux", ylabel="mWb", xlabel="time [s]", ylim=(55, 115))
    axis.legend(frameon=False, fontsize=8, ncols=2)
    return {"psi": figure}


def figs_12_13(e: Experiment) -> dict[str, Figure]:
    table = e.traces["points"]
    figure, axis = _axes()
    step = np.arange(len(table))
    axis.plot(step, table[:, 2], color=QUIET, linewidth=3, label="plant")
    axis.plot(step, table[:, 3], "o-", color=SPEED, markersize=4, label="with thermocouple")
    axis.plot(step, table[:, 4], "o--", color=Q_AXIS, markersize=3, label="without")
    labels = [f"{row[0]:.0f} / {row[1]:.0f}" for row in table]
    axis.set_xticks(step, labels, fontsize=8)
    axis.set(title="Fig. 13: magnet flux over temperature", ylabel="mWb", xlabel="winding / magnets [°C]")
    _legend(axis)
    return {"temperature": figure}


def any_i_d(e: Experiment) -> dict[str, Figure]:
    table = e.traces["table"]
    figure, axis = _axes()
    for interior, colour, name in ((0, SPEED, "surface magnets"), (1, Q_AXIS, "interior magnets")):
        rows = table[table[:, 1] == interior]
        axis.plot(rows[:, 0], rows[:, 2], "o-", color=colour, markersize=4, label=name)
    axis.set(title="Error of the leg voltage found", ylabel="%", xlabel="$i_d$ [A]", ylim=(-10, 10))
    _legend(axis)
    return {"error": figure}


def both_papers(e: Experiment) -> dict[str, Figure]:
    table = e.traces["table"]
    figure, axis = _axes()
    axis.semilogy(table[:, 0], table[:, 1], "o-", color=QUIET, label="paper 001 alone")
    axis.semilogy(table[:, 0], table[:, 2], "o-", color=SPEED, label="with paper 000")
    axis.set(title="Flux error under rated load", ylabel="% of $\\lambda_n$", xlabel="rpm")
    _legend(axis)
    return {"error": figure}


FIGURES = {
    "fig_1_table_i": fig_1_table_i,
    "fig_5": fig_5,
    "figs_6_7_8": currents,
    "figs_16_17": figs_16_17,
    "fig_11": fig_11,
    "figs_12_13": figs_12_13,
    "eq_b3": _nothing,
    "any_i_d": any_i_d,
    "both_papers": both_papers,
    "details": _nothing,
}
