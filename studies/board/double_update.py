# SPDX-License-Identifier: BSD-3-Clause
"""Frequency response of the closed current loop at 10 kHz PWM, with one and with two updates a period.

The golden core runs on the switching plant with the drive file's dead time, at a third of the rated speed and half
the rated current.  A multi-sine is added to the reference of i_q; what a run with the sines added and one with them
subtracted have in common (rotation, dead time at zero crossings, quantisation) cancels in their difference.

    T = I_q / I_q_ref at the sampling instants,   L = T / (1 - T),   since the error that the regulator sees is their
    difference.

Bandwidth: where |T| falls through -3 dB.  Phase margin: 180 degrees + phase of L where |L| falls through 1.
"""

from __future__ import annotations

import dataclasses
import math
import sys
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from fluxproof.checkout import BUILD, DRIVES, ROOT
from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.golden_loop import simulate
from fluxproof.cosim.runs import ClosedLoop, InVerilator, Named
from fluxproof.cosim.scenarios import SCENARIOS
from fluxproof.files import write_json
from fluxproof.plant import IMPOSED_SPEED
from golden_model import drive as drives
from golden_model.registers import registers
from golden_model.units import from_si, to_si
from studies.demo.plots import D_AXIS, HEIGHT, Q_AXIS, QUIET, REFERENCE, SPEED, STYLE, WIDTH, write_png

DRIVE = DRIVES / "paper001.toml"
CHOSEN_HZ = {1: 800.0, 2: 1250.0}  # bandwidth asked of the regulators in the two cases shown
SWEEP_HZ = {1: (400, 600, 800, 1000, 1200), 2: (800, 1100, 1250, 1400, 1550, 1700)}
TARGET_HZ, TARGET_DEG = 3000.0, 45.0
REPEAT_S, LEAD_IN, REPEATS = 0.1, 2, 3  # one multi-sine; so many to settle, so many measured
LINES, LOWEST_HZ, HIGHEST = 60, 100.0, 0.45  # of the multi-sine; the highest as a part of the sampling frequency
AMPLITUDE_A = 0.02  # of each line
PORTION_SPEED, PORTION_CURRENT = 1 / 3, 1 / 2  # of the rated ones
STEP_A, STEP_S = 0.5, 0.01
CARRIER_HALF, SCENARIO = 128, "everything"  # of the comparison of the RTL with the golden core


@dataclass(frozen=True)
class Response:
    """Closed loop T and open loop L at the lines [Hz] of the multi-sine; what follows from them."""

    hz: np.ndarray
    closed: np.ndarray
    overshoot: float  # of a small step of the reference, at the sampling instants

    @property
    def open(self) -> np.ndarray:
        return self.closed / (1.0 - self.closed)

    @property
    def bandwidth_hz(self) -> float:
        """Where |T| falls through -3 dB; infinite if it does not."""
        return _falls_through(self.hz, np.abs(self.closed), math.sqrt(0.5))

    @property
    def crossover_hz(self) -> float:
        return _falls_through(self.hz, np.abs(self.open), 1.0)

    @property
    def margin_deg(self) -> float:
        """Phase margin; negative if the loop is unstable, not a number if |L| never falls through 1."""
        phase = np.degrees(np.unwrap(np.angle(self.open)))
        phase -= 360.0 * np.round((phase[0] + 90.0) / 360.0)  # an integrator at low frequencies
        return 180.0 + float(np.interp(math.log(self.crossover_hz), np.log(self.hz), phase))

    @property
    def peak_db(self) -> float:
        return 20.0 * math.log10(np.abs(self.closed).max())


def _falls_through(hz, magnitude, level) -> float:
    """The last frequency at which the magnitude falls through the level, on logarithmic axes."""
    falls = np.flatnonzero((magnitude[:-1] >= level) & (magnitude[1:] < level))
    if not len(falls):
        return math.inf
    k = falls[-1]
    above, below = np.log(magnitude[k : k + 2] / level)
    return float(hz[k] * (hz[k + 1] / hz[k]) ** (above / (above - below)))


def made(updates: int, bandwidth_hz: float, path=DRIVE):
    """The drive of the file with so many updates a PWM period and this bandwidth asked of the current regulators."""
    drive = drives.load(path)
    return dataclasses.replace(
        drive,
        core=dataclasses.replace(drive.core, updates_per_period=updates),
        control=dataclasses.replace(drive.control, sample_time_s=None, current_bandwidth_hz=bandwidth_hz),
    )


def _run(drive, i_q) -> dict[str, np.ndarray]:
    """i_q and its reference [A] as the core sees them, and whether the voltage was at its limit."""
    n = len(i_q)
    speed = PORTION_SPEED * drive.machine.rated_speed_rad_s
    zeros = np.zeros(n, np.int64)
    scene = Scenario(
        omega_ref=zeros,
        load=np.full(n, speed),
        u_dc=np.full(n, drive.inverter.dc_bus_v),
        i_d_ref=zeros,
        i_q_ext=np.array([from_si("i_q_ext", i, drive) for i in i_q], np.int64),
        speed_mode=zeros,
        enable=np.ones(n, np.int64),
        omega_m=speed,
    )
    seen = simulate(drive, registers(drive), scene, dead_time_s=drive.inverter.dead_time_s, mode=IMPOSED_SPEED).observed
    limited = seen["sat_d"][n // 4 :].any() or seen["sat_q"][n // 4 :].any()
    return {name: to_si(name, seen[name], drive) for name in ("i_q", "i_q_ref")} | {"limited": bool(limited)}


def measure(drive) -> Response:
    """The response of the drive's q current loop; RuntimeError if the voltage was at its limit while measured."""
    rate, bias = 1.0 / drive.sample_time_s, PORTION_CURRENT * drive.machine.rated_current_a
    length = round(REPEAT_S * rate)
    lines = np.unique(np.round(np.geomspace(LOWEST_HZ, HIGHEST * rate, LINES) * REPEAT_S)).astype(int)
    # Schroeder's phases: the sines' sum stays small
    phases = -np.pi * np.arange(len(lines)) ** 2 / len(lines)
    turns = np.outer(np.arange(length), lines) / length
    sines = AMPLITUDE_A * np.cos(2 * np.pi * turns + phases).sum(axis=1)
    sines = np.tile(sines, LEAD_IN + REPEATS)
    added, taken = _run(drive, bias + sines), _run(drive, bias - sines)
    if added["limited"] or taken["limited"]:
        raise RuntimeError("the voltage was at its limit: no frequency response")

    def spectrum(name):
        half = (added[name] - taken[name])[LEAD_IN * length :].reshape(REPEATS, length).mean(axis=0) / 2.0
        return np.fft.rfft(half)[lines]

    return Response(lines / REPEAT_S, spectrum("i_q") / spectrum("i_q_ref"), _overshoot(drive, bias))


def _overshoot(drive, bias: float) -> float:
    """Part by which i_q passes a small step up, the mean with a step down taken off as above."""
    settle, after = round(0.1 / drive.sample_time_s), round(STEP_S / drive.sample_time_s)
    step = np.concatenate([np.zeros(settle), np.full(after, STEP_A)])
    up, down = (_run(drive, bias + sign * step)["i_q"] for sign in (1, -1))
    return float(((up - down)[settle:] / 2.0).max() / STEP_A - 1.0)


def predicted(drive, hz) -> np.ndarray:
    """T of the plain theory: L(z) = w_c*T_s / (z*(z - 1)), the regulator's zero on the winding's pole."""
    t_s = drive.sample_time_s
    z = np.exp(2j * np.pi * np.asarray(hz) * t_s)
    opened = 2 * np.pi * drive.control.current_bandwidth_hz * t_s / (z * (z - 1.0))
    return opened / (1.0 + opened)


def sweep() -> dict[int, dict[float, Response]]:
    """{updates a period: {bandwidth asked [Hz]: response}}."""
    result = {}
    for updates, asked in SWEEP_HZ.items():
        result[updates] = {}
        for hz in asked:
            response = result[updates][float(hz)] = measure(made(updates, float(hz)))
            print(
                f"{updates} a period, {hz:5.0f} Hz asked: -3 dB at {response.bandwidth_hz:6.0f} Hz, "
                f"{response.margin_deg:5.1f} degrees, peak {response.peak_db:4.1f} dB, "
                f"overshoot {100 * response.overshoot:4.1f} %",
                flush=True,
            )
    return result


def at_margin(responses: dict[float, Response], degrees: float = TARGET_DEG) -> float:
    """Bandwidth [Hz] at this phase margin, between the measured ones."""
    rows = sorted((r.margin_deg, r.bandwidth_hz) for r in responses.values())
    margins, bandwidths = zip(*rows, strict=True)
    if not margins[0] <= degrees <= margins[-1]:
        raise RuntimeError(f"no response was measured on both sides of {degrees:g} degrees: {margins}")
    return float(np.interp(degrees, margins, bandwidths))


def closed_loop(carrier_half: int, scenario: str) -> ClosedLoop:
    """A scenario with two updates a period, for a device that is compared with the golden core."""
    drive = drives.with_carrier(made(2, CHOSEN_HZ[2]), carrier_half)
    return ClosedLoop(drive, registers(drive), SCENARIOS[scenario](drive))


def compared() -> dict:
    """The board's row of the converted RTL in closed loop; RuntimeError if the run did not end."""
    job = InVerilator("double update", Named(f"{__spec__.name}:closed_loop", (CARRIER_HALF, SCENARIO)))
    job.carry_out()
    if job.problem and job.problem != job.summary().get("first_difference"):
        raise RuntimeError(job.problem)
    halves, different = (job.summary()[k] for k in ("periods_compared", "differences"))
    what = f"two updates a period: differences of the RTL in Verilator to the golden core, {halves} half periods"
    return {"figure": what, "ours": different, "target": "0", "unit": "1", "pass": different == 0 and halves > 2000}


def figures(responses: dict[int, dict[float, Response]]) -> list[dict]:
    """The board's rows: {figure, ours, target, unit, pass}; a row without target is for comparison."""
    once, twice = (responses[k][CHOSEN_HZ[k]] for k in (1, 2))
    asked = f"10 kHz PWM, regulators for {CHOSEN_HZ[2]:g} Hz"

    def row(figure, ours, unit, least=None):
        wanted = None if least is None else f">= {least:g}"
        return {"figure": figure, "ours": round(ours, 1), "target": wanted, "unit": unit,
                "pass": None if least is None else bool(ours >= least)}  # fmt: skip

    return [
        row(f"two updates a period: closed current loop at -3 dB ({asked})", twice.bandwidth_hz, "Hz", TARGET_HZ),
        row(f"two updates a period: phase margin ({asked})", twice.margin_deg, "degrees", TARGET_DEG),
        row(f"two updates a period: overshoot of a current step ({asked})", 100 * twice.overshoot, "%"),
        row("two updates a period: bandwidth at 45 degrees", at_margin(responses[2]), "Hz"),
        row("one update a period: bandwidth at 45 degrees", at_margin(responses[1]), "Hz"),
        row(f"one update a period: phase margin, regulators for {CHOSEN_HZ[1]:g} Hz", once.margin_deg, "degrees"),
    ]


def rows(responses: dict[int, dict[float, Response]] | None = None) -> list[dict]:
    """All rows for the board's table; measures what is not given."""
    return [compared(), *figures(responses or sweep())]


def draw(responses: dict[int, dict[float, Response]]) -> Figure:
    """|T|, phase of L, and bandwidth over phase margin."""
    figure = Figure(figsize=(WIDTH, 3 * HEIGHT), layout="constrained")
    closed, phase, trade = figure.subplots(3)
    for updates, colour in ((1, SPEED), (2, Q_AXIS)):
        r = responses[updates][CHOSEN_HZ[updates]]
        label = f"{updates} a period, {CHOSEN_HZ[updates]:g} Hz asked"
        closed.semilogx(r.hz, 20 * np.log10(np.abs(r.closed)), ".", color=colour, label=label)
        fine = np.geomspace(r.hz[0], r.hz[-1], 400)
        theory = predicted(made(updates, CHOSEN_HZ[updates]), fine)
        closed.semilogx(fine, 20 * np.log10(np.abs(theory)), color=colour, linewidth=0.8)
        for hz, opened, style in ((r.hz, r.open, "."), (fine, theory / (1 - theory), "-")):
            degrees = np.degrees(np.unwrap(np.angle(opened)))
            phase.semilogx(hz, degrees, style, color=colour, linewidth=0.8)
        phase.plot([r.crossover_hz], [r.margin_deg - 180.0], "o", color=colour, markerfacecolor="none")
        rows = sorted((x.margin_deg, x.bandwidth_hz) for x in responses[updates].values())
        trade.plot(*zip(*rows, strict=True), "o-", color=colour, label=f"{updates} a period")
    closed.axhline(-3.0, color=REFERENCE, linewidth=1.0, linestyle=(0, (4, 2)))
    closed.set(title="Closed current loop $|T|$ [dB]", ylim=(-20, 6))
    phase.axhline(TARGET_DEG - 180.0, color=REFERENCE, linewidth=1.0, linestyle=(0, (4, 2)))
    phase.set(
        title="Phase of the open loop $L$ [degrees]; circle: $|L| = 1$", ylim=(-270, -80), xlabel="frequency [Hz]"
    )
    trade.axhline(TARGET_HZ, color=QUIET, linewidth=1.0)
    trade.axvline(TARGET_DEG, color=QUIET, linewidth=1.0)
    trade.fill_between([TARGET_DEG, 75], TARGET_HZ, 5000, color=D_AXIS, alpha=0.08, linewidth=0)
    trade.set(title="Bandwidth at -3 dB [Hz] over phase margin", xlabel="phase margin [degrees]", ylim=(500, 5000))
    closed.legend(loc="lower left", frameon=False, fontsize=9)
    trade.legend(loc="upper right", frameon=False, fontsize=9)
    return figure


def main() -> int:
    """Measure, write build/studies/double_update.json and .png; status 1 if a target is missed."""
    import matplotlib as mpl

    responses = sweep()
    table = rows(responses)
    path = write_json(BUILD / "studies" / "double_update.json", table)
    with mpl.rc_context(STYLE):
        write_png(draw(responses), path.with_suffix(".png"))
    for r in table:
        print(f"{r['figure']}: {r['ours']:g} {r['unit']}" + (f", target {r['target']}" if r["target"] else ""))
    print(f"wrote {path.relative_to(ROOT)}, {path.with_suffix('.png').name}")
    return 0 if all(r["pass"] is not False for r in table) else 1


if __name__ == "__main__":
    sys.exit(main())
