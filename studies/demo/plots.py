# SPDX-License-Identifier: BSD-3-Clause
"""The demo's figures: Fig. 9 of paper 001 from the simulation, what lies behind it, and the recording.

The drawing functions take the views of studies/demo/report.py, in SI units; lines carry names at their ends.
"""

from __future__ import annotations

import io
import os
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

REFERENCE, SPEED, Q_AXIS, D_AXIS, QUIET = "#8a8f98", "#1f5fa8", "#c2461c", "#1c7f5f", "#b9bec6"
PHASES = {"a": SPEED, "b": Q_AXIS, "c": D_AXIS}
WIDTH, HEIGHT = 5.6, 3.1  # inches; narrow, so that the text stays readable on a phone
STYLE = {k: v for k, v in mpl.rcParamsDefault.items() if not k.startswith("backend")} | {
    "font.size": 10.0,
    "axes.grid": True,
    **{"axes.titlesize": 10.5, "axes.titleweight": "bold", "axes.titlelocation": "left"},
    "axes.edgecolor": "#9aa0a8",
    **dict.fromkeys(("axes.spines.top", "axes.spines.right"), False),
    **dict.fromkeys(("axes.labelcolor", "xtick.color", "ytick.color"), "#3b4048"),
    "grid.color": "#e8eaed",
    "path.simplify_threshold": 0.4,  # points; makes the page smaller by a third
    "svg.hashsalt": "fluxproof",  # the same figure, the same bytes
}


def draw(run, gates, rec=None) -> dict[str, Figure]:
    """Every figure by name, under the one style, whatever the user's matplotlib is set to."""
    speed, load = run.speed_step, run.load_step
    with mpl.rc_context(STYLE):
        figures = {
            "overview": overview(run),
            "speed": speeds(run),
            "currents": currents(run, "Currents, peak"),
            "at_speed_step": currents(run, "Currents at the speed step", speed - 15, speed + 65),
            "at_load_step": currents(run, "Currents at the load step", load - 50, load + 350),
            "voltages": voltages(run),
            "phase_currents": phases(run, "i", 1.0, "Phase currents as the core sees them, loaded", "A"),
            "duties": phases(run, "duty", 100.0, "Duties of the three legs, loaded", "%"),
            "gates": gate_signals(gates),
        }
        return figures if rec is None else {**figures, "recording": recording(rec)}


def styled(function, *arguments) -> Figure:
    """A figure of a drawing function under the one style."""
    with mpl.rc_context(STYLE):
        return function(*arguments)


def image(figure: Figure, kind: str, **options) -> bytes:
    """The figure as "png" or "svg"; SVG holds its letters as outlines, no font is needed to show it."""
    with mpl.rc_context(STYLE), io.BytesIO() as stream:
        figure.savefig(stream, format=kind, **options)
        return stream.getvalue()


def write_png(figure: Figure, path: Path) -> None:
    """Write the figure to ``path`` in one step."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_bytes(image(figure, "png", dpi=160))
    os.replace(temporary, path)


def _axes(*shape: int, size=(WIDTH, HEIGHT), **kwargs):
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(*shape, **kwargs)


def label(axis, x, y, text: str, color: str, dy: int = 0) -> None:
    """A line's name beside its last point, moved up by ``dy`` points."""
    at = dict(textcoords="offset points", va="center", annotation_clip=False)
    axis.annotate(text, (x, y), (4, dy), color=color, **at)


def _events(axis, run, names: bool = False) -> None:
    """Thin upright lines where the speed and the load step."""
    for k, text in ((run.speed_step, "speed step"), (run.load_step, "load step")):
        axis.axvline(run.ms[k], color=QUIET, linewidth=0.9, zorder=0)
        if names:
            up = axis.get_xaxis_transform()  # milliseconds across, a part of the height up
            axis.text(run.ms[k] + 2, 0.99, text, va="top", transform=up, color="#6b7079", fontsize=9)


def _speed_panel(axis, run) -> None:
    axis.step(run.ms, run.rpm_ref, where="post", color=REFERENCE, linewidth=1.1, linestyle=(0, (4, 2)))
    axis.plot(run.ms, run.rpm, color=SPEED)
    label(axis, run.ms[-1], run.rpm_ref[-1], "reference", REFERENCE, dy=6)
    label(axis, run.ms[-1], run.rpm[-1], "speed", SPEED, dy=-6)
    _events(axis, run, names=True)
    axis.set(title="Mechanical speed", ylabel="rpm", xlim=(0, run.ms[-1]), ylim=(0, 860))


def _current_panel(axis, run, part=slice(None)) -> None:
    ms, i_d, i_q, i_q_ref = (v[part] for v in (run.ms, run.i_d, run.i_q, run.i_q_ref))
    axis.axhline(run.i_max, color=QUIET, linewidth=0.9, linestyle=(0, (1, 2)))
    axis.step(ms, i_q_ref, where="post", color=REFERENCE, linewidth=1.0)
    axis.plot(ms, i_q, color=Q_AXIS)
    axis.plot(ms, i_d, color=D_AXIS)
    at_limit = i_q_ref[-1] > run.i_max - 0.3
    label(axis, ms[-1], run.i_max, "$i_q$ ref. = limit" if at_limit else "limit", REFERENCE, dy=3)
    if not at_limit:
        label(axis, ms[-1], i_q_ref[-1], "$i_q$ ref.", REFERENCE, dy=8)
    label(axis, ms[-1], i_q[-1], "$i_q$", Q_AXIS, dy=-4)
    label(axis, ms[-1], i_d[-1], "$i_d$", D_AXIS)
    _events(axis, run)
    axis.set(ylabel="A", xlim=(ms[0], ms[-1]))


def speeds(run) -> Figure:
    figure, axis = _axes()
    _speed_panel(axis, run)
    axis.set_xlabel("time [ms]")
    return figure


def currents(run, title: str, start: int = 0, end: int | None = None) -> Figure:
    figure, axis = _axes()
    _current_panel(axis, run, slice(start, end))
    axis.set(title=title, xlabel="time [ms]")
    return figure


def voltages(run) -> Figure:
    """The voltage vector in the stator's plane, and its length over the circle's radius in time."""
    figure, (plane, length) = _axes(1, 2, size=(WIDTH, 2.9), width_ratios=(1, 1.25))
    circle = run.u_max.min() * np.exp(1j * np.linspace(0, 2 * np.pi, 200))
    plane.plot(circle.real, circle.imag, color=REFERENCE, linewidth=1.1)
    plane.plot(run.u_alpha, run.u_beta, ".", color=SPEED, markersize=1.5)
    plane.set(title="Voltage vector", xlabel=r"$u_\alpha$ [V]", ylabel=r"$u_\beta$ [V]")
    plane.set_aspect("equal", anchor="N")
    length.plot(run.ms, 100 * np.hypot(run.u_alpha, run.u_beta) / run.u_max, color=SPEED)
    length.axhline(100, color=REFERENCE, linewidth=1.1)
    _events(length, run)
    length.set(title="Length / circle", xlabel="time [ms]", ylabel="%", xlim=(0, run.ms[-1]), ylim=(0, 108))
    return figure


def phases(run, signal: str, scale: float, title: str, unit: str) -> Figure:
    """A signal of the three phases over the last 32 ms, one and a half electrical turns."""
    figure, axis = _axes()
    part = slice(len(run.ms) - 320, None)
    for phase, color in PHASES.items():
        values = scale * getattr(run, f"{signal}_{phase}")[part]
        axis.plot(run.ms[part], values, color=color)
        label(axis, run.ms[-1], values[-1], phase, color)
    axis.set(title=title, xlabel="time [ms]", ylabel=unit, xlim=(run.ms[part][0], run.ms[-1]))
    return figure


def _gate_lines(axis, gates, start: float, end: float, title: str) -> None:
    """Six gate signals as steps between two times [us] of one PWM period; the dead time in yellow."""
    us, words = np.append(gates.us, gates.period_us), np.append(gates.words, gates.words[-1])
    for row, (phase, color) in enumerate(PHASES.items()):
        for side, bit, base in (("upper", row, 6.45 - 2.6 * row), ("lower", row + 3, 5.2 - 2.6 * row)):
            level = base + 0.9 * (words >> bit & 1)
            axis.step(us, level, where="post", color=color, linewidth=1.3)
            axis.fill_between(us, base, level, step="post", color=color, alpha=0.13, linewidth=0)
            at = dict(xycoords=("axes fraction", "data"), textcoords="offset points", ha="right", va="center")
            axis.annotate(f"{phase} {side}", (0, base + 0.45), (-4, 0), color=color, fontsize=9, **at)
    axis.axvspan(*gates.dead_us, color="#f0c419", alpha=0.35, linewidth=0)
    axis.set(title=title, xlim=(start, end), yticks=[], xlabel="µs")
    axis.grid(visible=False)
    axis.spines.left.set_visible(False)


def gate_signals(gates) -> Figure:
    """The gates in one PWM period, and close up where the first leg changes over."""
    figure, (whole, close) = _axes(1, 2, size=(WIDTH, 3.3), width_ratios=(1.7, 1))
    off, on = gates.dead_us
    _gate_lines(whole, gates, 0, gates.period_us, "Gates in one PWM period")
    _gate_lines(close, gates, off - 2.5, on + 2.5, f"Dead time {on - off:.1f} µs")
    return figure


def recording(rec) -> Figure:
    """Speed, current and voltage over the whole recording: logged, and what the core made of the codes."""
    figure, axes = _axes(3, 1, size=(WIDTH, 5.2), sharex=True)
    panels = (
        ("Electrical speed", "rad/s", rec.omega, rec.omega_core, "core", SPEED),
        ("Current $i_q$", "A", rec.i_q, rec.i_q_core, "core", Q_AXIS),
        ("Voltage $u_q$", "V", rec.u_q, rec.u_q_core, "core: R i + decoupling", D_AXIS),
    )
    for axis, (title, unit, logged, core, name, color) in zip(axes, panels, strict=True):
        axis.plot(rec.row, logged, color=REFERENCE, linewidth=2.4, label="logged")
        axis.plot(rec.row, core, color=color, linewidth=0.8, label=name)
        axis.set(title=title, ylabel=unit)
        at = dict(loc="lower right", bbox_to_anchor=(1, 0.98), borderpad=0)
        axis.legend(**at, ncols=2, frameon=False, fontsize=9)
    axes[-1].set(xlabel="row of the log", xlim=(0, rec.row[-1]))
    return figure


def overview(run) -> Figure:
    """The picture of the README: speed above, currents below."""
    figure, (above, below) = _axes(2, 1, size=(7.6, 4.6), sharex=True)
    _speed_panel(above, run)
    _current_panel(below, run)
    below.set(title="Currents, peak", xlabel="time [ms]")
    return figure
