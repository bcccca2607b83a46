"""The demo's figures: Fig. 9 of paper 001 from the simulation, what lies behind it, and the recording.

Every function takes numbers in SI units and returns a matplotlib figure; ``svg`` and ``png`` turn one into bytes.
Lines carry their names at their ends, so that no legend has to be looked up.
"""

from __future__ import annotations

import io
import os
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

REFERENCE, SPEED, Q_AXIS, D_AXIS, LIMIT = "#8a8f98", "#1f5fa8", "#c2461c", "#1c7f5f", "#b9bec6"
PHASES = {"a": "#1f5fa8", "b": "#c2461c", "c": "#1c7f5f"}
WIDTH, HEIGHT = 5.6, 3.1  # inches; narrow, so that the text stays readable on a phone
STYLE = {
    "font.size": 10.0,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#9aa0a8",
    "axes.labelcolor": "#3b4048",
    "xtick.color": "#3b4048",
    "ytick.color": "#3b4048",
    "axes.grid": True,
    "grid.color": "#e8eaed",
    "lines.linewidth": 1.4,
    "path.simplify_threshold": 0.4,
    "svg.hashsalt": "fluxproof",
}


def styled(draw):
    """Run a drawing function under the one style, whatever the user's matplotlib is set to."""

    def wrapped(*args, **kwargs) -> Figure:
        with mpl.rc_context({**mpl.rcParamsDefault, **STYLE, "backend": mpl.rcParams["backend"]}):
            figure = draw(*args, **kwargs)
            figure.fluxproof_name = draw.__name__
            return figure

    return wrapped


def svg(figure: Figure) -> bytes:
    """The figure as SVG with its letters as outlines: no font is needed to show it."""
    return _saved(figure, "svg", metadata={"Date": None})


def write_png(figure: Figure, path: Path) -> None:
    """Write the figure to ``path`` in one step."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_bytes(_saved(figure, "png", dpi=160))
    os.replace(temporary, path)


def _saved(figure: Figure, kind: str, **options) -> bytes:
    with mpl.rc_context(STYLE), io.BytesIO() as stream:
        figure.savefig(stream, format=kind, **options)
        return stream.getvalue()


def _axes(rows: int = 1, columns: int = 1, size=(WIDTH, HEIGHT), **kwargs):
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, **kwargs)


def _name(axis, x, y, text, color, dx=4, dy=0, **kwargs) -> None:
    """A line's name beside its last point."""
    at = dict(xytext=(dx, dy), textcoords="offset points", va="center", color=color, annotation_clip=False)
    axis.annotate(text, (x, y), **(at | kwargs))


def _events(axis, run, names: bool = False) -> None:
    """Thin upright lines where the speed and the load step."""
    for k, text in ((run.speed_step, "speed step"), (run.load_step, "load step")):
        axis.axvline(run.ms[k], color=LIMIT, linewidth=0.9, zorder=0)
        if names:
            axis.annotate(text, (run.ms[k], 1.0), xycoords=("data", "axes fraction"), xytext=(3, -3),
                          textcoords="offset points", va="top", color="#6b7079", fontsize=9)  # fmt: skip


def _speed_panel(axis, run) -> None:
    axis.step(run.ms, run.rpm_ref, where="post", color=REFERENCE, linewidth=1.1, linestyle=(0, (4, 2)))
    axis.plot(run.ms, run.rpm, color=SPEED)
    _name(axis, run.ms[-1], run.rpm_ref[-1], "reference", REFERENCE, dy=6)
    _name(axis, run.ms[-1], run.rpm[-1], "speed", SPEED, dy=-6)
    _events(axis, run, names=True)
    axis.set(title="Mechanical speed", ylabel="rpm", xlim=(0, run.ms[-1]), ylim=(0, 860))


def _current_panel(axis, run, part=slice(None), names=True) -> None:
    axis.axhline(run.i_max, color=LIMIT, linewidth=0.9, linestyle=(0, (1, 2)))
    ms = run.ms[part]
    axis.step(ms, run.i_q_ref[part], where="post", color=REFERENCE, linewidth=1.0)
    axis.plot(ms, run.i_q[part], color=Q_AXIS)
    axis.plot(ms, run.i_d[part], color=D_AXIS)
    if names:
        _name(axis, ms[-1], run.i_q[part][-1], "$i_q$", Q_AXIS, dy=-4)
        _name(axis, ms[-1], run.i_q_ref[part][-1], "$i_q$ ref.", REFERENCE, dy=8)
        _name(axis, ms[-1], run.i_d[part][-1], "$i_d$", D_AXIS)
        _name(axis, ms[-1], run.i_max, "limit", "#8a8f98", fontsize=9)
    axis.set(ylabel="A", xlim=(ms[0], ms[-1]))


@styled
def speed(run) -> Figure:
    figure, axis = _axes()
    _speed_panel(axis, run)
    axis.set_xlabel("time [ms]")
    return figure


@styled
def currents(run) -> Figure:
    figure, axis = _axes()
    _current_panel(axis, run)
    _events(axis, run, names=False)
    axis.set(title="Currents, peak", xlabel="time [ms]")
    return figure


def _zoom(run, k: int, before: int, after: int, title: str) -> Figure:
    figure, axis = _axes()
    _current_panel(axis, run, slice(max(k - before, 0), k + after))
    axis.axvline(run.ms[k], color=LIMIT, linewidth=0.9, zorder=0)
    axis.set(title=title, xlabel="time [ms]")
    return figure


@styled
def zoom_speed_step(run) -> Figure:
    return _zoom(run, run.speed_step, 15, 65, "Currents at the speed step, 0.1 ms a sample")


@styled
def zoom_load_step(run) -> Figure:
    return _zoom(run, run.load_step, 50, 350, "Currents at the load step")


@styled
def voltages(run) -> Figure:
    """The voltage vector in the stator's plane, and its length over the circle's radius in time."""
    figure, (plane, length) = _axes(1, 2, (WIDTH, 2.9), width_ratios=(1, 1.25))
    turn = np.linspace(0, 2 * np.pi, 200)
    radius = run.u_max.min()
    plane.plot(radius * np.cos(turn), radius * np.sin(turn), color=REFERENCE, linewidth=1.1)
    plane.plot(run.u_alpha, run.u_beta, ".", color=SPEED, markersize=1.2)
    plane.set_aspect("equal")
    plane.set(title="Voltage vector", xlabel=r"$u_\alpha$ [V]", ylabel=r"$u_\beta$ [V]")
    length.plot(run.ms, 100 * np.hypot(run.u_alpha, run.u_beta) / run.u_max, color=SPEED)
    length.axhline(100, color=REFERENCE, linewidth=1.1)
    _events(length, run)
    length.set(title="Length / circle", xlabel="time [ms]", ylabel="%", xlim=(0, run.ms[-1]), ylim=(0, 108))
    return figure


@styled
def duties(run) -> Figure:
    """One electrical turn and a half of the three duties, loaded."""
    figure, axis = _axes()
    part = slice(len(run.ms) - 320, len(run.ms))
    for name, color in PHASES.items():
        duty = 100 * getattr(run, f"duty_{name}")[part]
        axis.plot(run.ms[part], duty, color=color)
        _name(axis, run.ms[-1], duty[-1], name, color)
    axis.set(title="Duties of the three legs, loaded", xlabel="time [ms]", ylabel="%", ylim=(0, 100))
    axis.set_xlim(run.ms[part][0], run.ms[-1])
    return figure


def _gate_lines(axis, gates, start: float, end: float) -> None:
    """Six gate signals as steps between two times [us] of one PWM period."""
    for row, (phase, color) in enumerate(PHASES.items()):
        for upper in (1, 0):
            bit = row if upper else row + 3
            level = np.append(gates.words, gates.words[-1]) >> bit & 1
            base = 2.6 * (2 - row) + (1.25 if upper else 0.0)
            us = np.append(gates.us, gates.period_us)
            axis.step(us, base + 0.9 * level, where="post", color=color, linewidth=1.3)
            axis.fill_between(us, base, base + 0.9 * level, step="post", color=color, alpha=0.13, linewidth=0)
            label = f"{phase} {'upper' if upper else 'lower'}"
            axis.annotate(label, (0, base + 0.45), xycoords=("axes fraction", "data"), xytext=(-4, 0),
                          textcoords="offset points", ha="right", va="center", color=color, fontsize=9)  # fmt: skip
    axis.set(xlim=(start, end), yticks=[], xlabel="µs")
    axis.grid(visible=False)
    axis.spines["left"].set_visible(False)


@styled
def gate_signals(gates) -> Figure:
    """The gates in one PWM period, and close up where the first leg changes over."""
    figure, (whole, close) = _axes(1, 2, (WIDTH, 3.3), width_ratios=(1.7, 1))
    _gate_lines(whole, gates, 0, gates.period_us)
    off, on = gates.dead_us
    _gate_lines(close, gates, off - 2.5, on + 2.5)
    for axis in (whole, close):
        axis.axvspan(off, on, color="#f0c419", alpha=0.35, linewidth=0)
    whole.set_title("Gates in one PWM period")
    close.set_title(f"Dead time {on - off:.1f} µs")
    return figure


@styled
def recording(rec) -> Figure:
    """Speed, currents and decoupling voltages over the whole recording, one row a sample."""
    figure, axes = _axes(3, 1, (WIDTH, 5.2), sharex=True)
    panels = (
        (axes[0], "Electrical speed", "rad/s", (("logged", rec.omega, REFERENCE), ("core", rec.omega_core, SPEED))),
        (axes[1], "Current $i_q$", "A", (("logged", rec.i_q, REFERENCE), ("core", rec.i_q_core, Q_AXIS))),
        (axes[2], "Voltage $u_q$", "V", (("logged", rec.u_q, REFERENCE), ("core: R i + decoupling", rec.u_q_core, D_AXIS))),
    )
    for axis, title, unit, lines in panels:
        for width, (label, values, color) in zip((2.4, 0.8), lines, strict=True):
            axis.plot(rec.row, values, color=color, linewidth=width, label=label)
        axis.set(title=title, ylabel=unit)
        axis.legend(loc="lower right", ncols=2, frameon=False, fontsize=9, handlelength=1.2, borderaxespad=0.1)
    axes[-1].set(xlabel="row of the log", xlim=(0, rec.row[-1]))
    return figure


@styled
def overview(run) -> Figure:
    """The picture of the README: speed above, currents below."""
    figure, (above, below) = _axes(2, 1, (7.6, 4.6), sharex=True)
    _speed_panel(above, run)
    _current_panel(below, run)
    _events(below, run)
    below.set(title="Currents, peak", xlabel="time [ms]")
    return figure


OF_A_RUN = (speed, currents, zoom_speed_step, zoom_load_step, voltages, duties, overview)
