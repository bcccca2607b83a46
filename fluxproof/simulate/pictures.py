# SPDX-License-Identifier: BSD-3-Clause
"""The pictures of a simulation's report, in the style of the diagnosis' report."""

from __future__ import annotations

import warnings

import matplotlib as mpl
import numpy as np

from fluxproof.cosim.scenarios import RPM
from fluxproof.diagnosis.report import theme
from fluxproof.simulate import scene as scenes
from fluxproof.simulate.figures import off_before, rpm
from fluxproof.simulate.margins import Loop
from fluxproof.simulate.run import Run
from fluxproof.simulate.speed_range import SpeedRange
from golden_model.drive import Drive
from golden_model.motion import count_turns
from golden_model.units import to_si

COLUMNS = 700  # along the time axis: more than a screen's pixels in a picture of this width


def draw(
    drive: Drive,
    run: Run,
    step: Run,
    loops: dict[str, Loop],
    rippled: dict,
    reached: SpeedRange,
    moved: Run | None = None,
) -> dict[str, theme.Picture]:
    """All pictures by name; ``run`` is the scene, ``step`` the step of the current, ``moved`` the move."""
    drawn = {}
    with mpl.rc_context(theme.STYLE), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a font may lack a glyph
        drawn["speed"] = speed(drive, run)
        drawn["currents"] = currents(drive, run)
        drawn["voltage"] = voltage(drive, run)
        drawn["current_step"] = current_step(drive, step)
        if not off_before(run, run.scene.stages[2].end):
            drawn["ripple"] = ripple(rippled)
        drawn["loops"] = bode(loops)
        drawn["speed_range"] = speed_range(drive, reached)
        drawn["circles"] = circles(drive, reached)
        if moved is not None:
            drawn["position"] = position(drive, moved)
    return drawn


def envelope(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """At most 2*COLUMNS points that show the least and the largest value of each column."""
    n = len(t)
    if n <= 2 * COLUMNS:
        return t, values
    edges = np.linspace(0, n, COLUMNS + 1).astype(int)[:-1]
    low, high = np.minimum.reduceat(values, edges), np.maximum.reduceat(values, edges)
    return np.repeat(t[edges], 2), np.column_stack((low, high)).ravel()


def _lines(axis, run: Run, *rows) -> None:
    for values, color, style in rows:
        axis.plot(*envelope(run.t, np.asarray(values, float)), color=color, linestyle=style)
    for stage in run.scene.stages[1:]:
        axis.axvline(run.t[stage.first], color=theme.BAND, linewidth=0.8, zorder=0)
    if run.tripped_at is not None:
        axis.axvline(run.t[run.tripped_at], color=theme.BEFORE, linewidth=1.2)
    axis.set(xlabel="time [s]", xlim=(0.0, run.t[-1]))


def speed(drive: Drive, run: Run) -> theme.Picture:
    """Mechanical speed and its reference."""
    figure, axis = theme.axes(height=2.6)
    scenario = run.scene.scenario
    rows = [(rpm(run), theme.AFTER, "-")]
    words = [("speed", theme.AFTER)]
    if not run.scene.imposed:
        wanted = to_si("omega_ref", scenario.omega_ref, drive) / (RPM * drive.machine.pole_pairs)
        rows.insert(0, (wanted, theme.RECORDED, "--"))
        words.insert(0, ("reference", theme.RECORDED))
    _lines(axis, run, *rows)
    axis.set(title="Speed", ylabel="rpm")
    theme.key(axis, *words)
    names = ", ".join(stage.name for stage in run.scene.stages)
    return theme.picture("speed", figure, f"Stages, at the vertical lines: {names}.")


def position(drive: Drive, run: Run) -> theme.Picture:
    """Position, and how far it is from the trajectory."""
    figure, panels = theme.panels(2, 1, height=3.6, sharex=True)
    _lines(panels[0], run, (360.0 * run["shaft_position"], theme.AFTER, "-"))
    panels[0].set(title="Position", ylabel="degrees", xlabel="")
    _lines(panels[1], run, (run["position_error"] / count_turns(drive), theme.AFTER, "-"))
    panels[1].set(title="Following error", ylabel="counts")
    return theme.picture("position", figure, "A move there and back in position mode; the error in counts.")


def currents(drive: Drive, run: Run) -> theme.Picture:
    """Currents in the rotor frame with the reference and the limit."""
    figure, panels = theme.panels(2, 1, height=3.6, sharex=True)
    _lines(panels[0], run, (run["i_q"], theme.AFTER, "-"), (run["i_q_ref"], theme.BEFORE, "--"))
    for side in (-1, 1):
        panels[0].axhline(side * drive.current_limit_a, color=theme.AXIS, linewidth=0.8, linestyle=":")
    panels[0].set(title="$i_q$", ylabel="A", xlabel="")
    theme.key(panels[0], ("current", theme.AFTER), ("reference", theme.BEFORE), ("limit", theme.AXIS))
    _lines(panels[1], run, (run["i_d"], theme.AFTER, "-"))
    panels[1].set(title="$i_d$, reference 0", ylabel="A")
    return theme.picture("currents", figure, "Currents as the core sees them, one value a PWM period.")


def voltage(drive: Drive, run: Run) -> theme.Picture:
    """Magnitude of the voltage and the radius of the circle."""
    figure, axis = theme.axes(height=2.4)
    size = np.hypot(run["u_d"], run["u_q"])
    _lines(axis, run, (size, theme.AFTER, "-"), (run["u_max"], theme.BEFORE, "--"))
    axis.set(title="Voltage", ylabel="V", ylim=(0, 1.1 * max(run["u_max"].max(), size.max())))
    theme.key(axis, ("asked", theme.AFTER), ("circle", theme.BEFORE))
    at = f"{drive.machine.rated_speed_rad_s / RPM:.4g} rpm and {drive.machine.rated_current_a:.4g} A"
    need = scenes.voltage(drive, drive.machine.rated_speed_rad_s, drive.machine.rated_current_a)
    caption = f"Voltage that the regulators ask for, and the largest that the bus can give. {at} need {need:.4g} V."
    return theme.picture("voltage", figure, caption)


def speed_range(drive: Drive, reached: SpeedRange) -> theme.Picture:
    """Largest torque over speed, with the torque table and with i_d = 0."""
    has, without = ("-", "--") if drive.core.references else ("--", "-")
    figure, axis = theme.axes(height=2.6)
    axis.plot(reached.speed / RPM, reached.with_table, color=theme.AFTER, linestyle=has)
    axis.plot(reached.speed / RPM, reached.without, color=theme.BEFORE, linestyle=without)
    axis.axvline(drive.machine.rated_speed_rad_s / RPM, color=theme.BAND, linewidth=0.8, zorder=0)
    axis.set(title="Torque over speed", xlabel="rpm", ylabel="Nm", xlim=(0.0, reached.speed[-1] / RPM), ylim=(0, None))
    theme.key(axis, ("with the torque table", theme.AFTER), ("with $i_d = 0$", theme.BEFORE))
    state = "has the torque table" if drive.core.references else "has i_d = 0 ([core] references = false)"
    said = "Largest torque by the nameplate within current limit and voltage circle, up to the speed that trips."
    return theme.picture("speed_range", figure, f"{said} This drive {state}; the line is its rated speed.")


def circles(drive: Drive, reached: SpeedRange) -> theme.Picture:
    """The current circle, the voltage limit at three speeds, the points of the table."""
    figure, axis = theme.axes(height=3.4)
    limit, turn = drive.current_limit_a, np.linspace(0.0, 2.0 * np.pi, 181)
    axis.plot(limit * np.cos(turn), limit * np.sin(turn), color=theme.AXIS, linestyle=":")
    speeds = [speed for speed in (reached.base(), reached.speed[-1]) if speed > 0.0]
    for speed in speeds:
        axis.plot(*reached.ellipse(speed), color=theme.RECORDED, linewidth=0.9)
    axis.plot(*reached.mtpa.T, color=theme.BEFORE)
    axis.plot(*reached.points.T, ".-", color=theme.AFTER, markersize=3)
    axis.set_title("Both circles", pad=18.0)  # above the key: equal scales make the axes narrow
    axis.set(xlabel="$i_d$ [A]", ylabel="$i_q$ [A]", xlim=(-1.6 * limit, 1.1 * limit))
    axis.set(ylim=(-0.15 * limit, 1.15 * limit), aspect="equal")
    theme.key(axis, ("least current", theme.BEFORE), ("largest torque over speed", theme.AFTER))
    at = " and ".join(f"{speed / RPM:.4g} rpm" for speed in speeds)
    return theme.picture("circles", figure, f"Current limit (dotted), voltage limit (grey) at {at}.")


def current_step(drive: Drive, step: Run) -> theme.Picture:
    """The step of i_q, sample by sample."""
    stage = step.scene.stage("current step")
    shown = slice(stage.first - 10, min(stage.first + 120, stage.end))
    us = (np.arange(shown.start, shown.stop) - stage.first) * drive.sample_time_s * 1e3
    figure, axis = theme.axes(height=2.4)
    axis.step(us, step["i_q_ref"][shown], where="post", color=theme.BEFORE, linestyle="--")
    axis.plot(us, step["i_q"][shown], ".-", color=theme.AFTER, markersize=3)
    axis.set(title="Step of $i_q$", xlabel="time after the step [ms]", ylabel="A", xlim=(us[0], us[-1]))
    theme.key(axis, ("current", theme.AFTER), ("reference", theme.BEFORE))
    return theme.picture("current_step", figure, "A step in torque mode on a driven shaft; a dot is a sample.")


def ripple(rippled: dict) -> theme.Picture:
    """Phase currents in the period with the largest ripple."""
    figure, axis = theme.axes(height=2.4)
    us, i_abc = rippled["t"] * 1e6, rippled["i_abc"]
    for k, color in enumerate((theme.AFTER, theme.BEFORE, theme.RECORDED)):
        axis.plot(us, i_abc[:, k], color=color)
    axis.set(title="Inside a PWM period", xlabel="time [µs]", ylabel="A", xlim=(us[0], us[-1]))
    theme.key(axis, ("a", theme.AFTER), ("b", theme.BEFORE), ("c", theme.RECORDED))
    caption = f"Phase currents of the loaded drive; ripple up to {rippled['peak_to_peak_a']:.3g} A from peak to peak."
    return theme.picture("ripple", figure, caption)


def bode(loops: dict[str, Loop]) -> theme.Picture:
    """Gain and phase of the open loops."""
    figure, panels = theme.panels(2, 1, height=3.6, sharex=True)
    shown = [(name, loops[name], color) for name, color in _colors(loops)]
    for _, loop, color in shown:
        hz = loop.frequencies()
        gain = loop.response(hz)
        panels[0].semilogx(hz, 20.0 * np.log10(np.abs(gain)), color=color)
        phase = np.unwrap(np.angle(gain))
        phase -= 2.0 * np.pi * np.round((phase[0] + np.pi / 2.0) / (2.0 * np.pi))
        panels[1].semilogx(hz, np.degrees(phase), color=color)
    panels[0].axhline(0.0, color=theme.AXIS, linewidth=0.8)
    panels[1].axhline(-180.0, color=theme.AXIS, linewidth=0.8)
    panels[0].set(title="Open loops", ylabel="dB", ylim=(-60, 60))
    panels[1].set(xlabel="Hz", ylabel="degrees", ylim=(-300, -60), yticks=range(-270, -89, 45))
    panels[1].set_xlim(left=1e-4 * 0.5 / next(iter(loops.values())).t_s)
    theme.key(panels[0], *((name, color) for name, _, color in shown))
    caption = "Gain and phase with delay and sampling; the margins are where the lines cross 0 dB and -180 degrees."
    return theme.picture("loops", figure, caption)


def _colors(loops: dict[str, Loop]) -> list[tuple[str, str]]:
    """The current loop of the q axis and the speed loop."""
    colors = {"current loop, q axis": theme.AFTER, "speed loop": theme.BEFORE}
    return [(name, color) for name, color in colors.items() if name in loops]
