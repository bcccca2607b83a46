# SPDX-License-Identifier: BSD-3-Clause
"""What the demo measured: numbers from the simulation's integers, and one HTML page that shows them."""

from __future__ import annotations

import base64
import dataclasses
from pathlib import Path
from types import SimpleNamespace

import jinja2
import numpy as np

from fluxproof.cosim.driven_plant import Scenario
from fluxproof.cosim.scenarios import RPM
from fluxproof.files import write_text
from golden_model.drive import Drive
from golden_model.drive_keys import key_of
from golden_model.fluxproof import Observed
from golden_model.units import to_si
from studies.demo import plots

TEMPLATES = Path(__file__).resolve().parents[1] / "templates"
SHOWN = (*("u_max", "u_alpha", "u_beta"), *("i_a", "i_b", "i_c"), *("duty_a", "duty_b", "duty_c"))
LOGGED = "{differences:,} differences, currents within {current_error_a:.2f} A of the log"
LOGGED += ", formats allow {current_bound_a:.2f} A"
LEG_A = 0b001001  # its two gates in a gate word
SETTLED = 100  # samples before the next event (10 ms) that count as settled


def run_view(arrays, drive: Drive, scenario: Scenario, register_set) -> SimpleNamespace:
    """A closed-loop run in SI units, one element per sample; i_d, i_q and speed are the plant's own."""

    def observed(name: str) -> np.ndarray:
        return to_si(name, arrays[f"observed_{name}"], drive)

    omega_ref = to_si("omega_ref", scenario.omega_ref, drive)
    return SimpleNamespace(
        ms=np.arange(len(scenario)) * drive.sample_time_s * 1e3,
        rpm_ref=omega_ref / (RPM * drive.machine.pole_pairs),
        rpm=arrays["plant_omega_m"] / RPM,
        i_d=arrays["plant_i_d"],
        i_q=arrays["plant_i_q"],
        i_d_ref=to_si("i_d_ref", scenario.i_d_ref, drive),
        i_q_ref=observed("i_q_ref"),
        i_max=drive.current_limit_a,
        limited=arrays["observed_speed_limited"] != 0,
        **{name: observed(name) for name in SHOWN},
        speed_step=int(np.flatnonzero(np.diff(scenario.omega_ref))[-1]) + 1,
        load_step=int(np.flatnonzero(np.diff(scenario.load))[0]) + 1,
        edges=arrays["gate_edges"],
        carrier_half=register_set.config.carrier_half,
        period_us=drive.sample_time_s * 1e6,
    )


def metrics(run: SimpleNamespace) -> dict:
    """The numbers of summary.json that describe the control; keys carry the units."""
    error = run.rpm_ref - run.rpm
    ends = {"before_speed_step": run.speed_step, "before_load_step": run.load_step, "at_end": len(error)}
    settled = {name: _worst(error[end - SETTLED : end]) for name, end in ends.items()}
    after = run.rpm[run.load_step :]
    both_on, dead_clocks = dead_times(run.edges, run.carrier_half)
    return {
        "speed_error_rpm": {"worst": max(settled.values()), **settled},
        "speed_overshoot_rpm": _rounded(np.max(-error[run.speed_step : run.load_step])),
        "speed_dip_rpm": _rounded(run.rpm_ref[-1] - after.min()),
        "speed_dip_after_ms": _rounded(run.ms[int(after.argmin())]),
        "i_d_tracking_a": _tracking(run.i_d_ref - run.i_d, ends),
        "i_q_tracking_a": _tracking(run.i_q_ref - run.i_q, ends),
        "peak_current_a": _rounded(np.hypot(run.i_d, run.i_q).max()),
        "current_limited_ms": _rounded(run.limited.sum() * run.period_us * 1e-3),
        "voltage_of_circle_percent": _rounded(100 * (np.hypot(run.u_alpha, run.u_beta) / run.u_max).max()),
        "i_q_rise_ms": rise_time(run),
        "carrier_half_clocks": run.carrier_half,
        "both_gates_on": both_on,
        "shortest_dead_time_us": _rounded(dead_clocks * run.period_us / (2 * run.carrier_half)),
    }


def rise_time(run: SimpleNamespace) -> float:
    """From the speed step until i_q has made 90 % of its reference's jump [ms]."""
    start, target = run.i_q[run.speed_step], run.i_q_ref[run.speed_step]
    made = (run.i_q[run.speed_step :] - start) / (target - start)
    return _rounded(run.ms[int(np.argmax(made >= 0.9))])


def _rounded(value) -> float:
    return round(float(value), 4)


def _worst(error: np.ndarray) -> float:
    return _rounded(np.abs(error).max())


def _tracking(error: np.ndarray, ends: dict[str, int]) -> dict[str, float]:
    """Reference minus current [A]: over the whole run, and where it should have settled."""
    calm = np.concatenate([error[end - SETTLED : end] for end in ends.values()])
    rms, rms_calm = (_rounded(np.sqrt(np.mean(e**2))) for e in (error, calm))
    return {"rms": rms, "worst": _worst(error), "settled_rms": rms_calm, "settled_worst": _worst(calm)}


def dead_times(edges: np.ndarray, carrier_half: int) -> tuple[int, int]:
    """(how often both gates of a leg were on, shortest time [clocks] with both off)."""
    clock = edges[:, 0] * 2 * carrier_half + edges[:, 1]
    both_on, shortest = 0, np.iinfo(np.int64).max
    for leg in range(3):
        state = (edges[:, 2] >> leg & 1) + 2 * (edges[:, 2] >> (leg + 3) & 1)
        starts = np.flatnonzero(np.diff(state, prepend=-1))
        both_on += int((state[starts] == 3).sum())
        off = np.diff(clock[starts])[state[starts][:-1] == 0]
        shortest = int(np.min(off, initial=shortest))
    return both_on, shortest


def gate_view(run: SimpleNamespace, period: int) -> SimpleNamespace:
    """The gates of one PWM period, times in us from its start; ``dead_us``: leg a's first dead time."""
    inside = np.flatnonzero(run.edges[:, 0] == period)
    us = np.append(0.0, run.edges[inside, 1] * run.period_us / (2 * run.carrier_half))
    words = run.edges[np.append(inside[0] - 1, inside), 2]  # the word in force before the first edge leads
    off = int(np.flatnonzero(words & LEG_A == 0)[0])
    on = off + int(np.flatnonzero(words[off:] & LEG_A)[0])
    return SimpleNamespace(us=us, words=words, period_us=run.period_us, dead_us=(us[off], us[on]))


def recording_view(recording, bound, observed, drive: Drive) -> SimpleNamespace:
    """Logged beside what the core made of the codes; u_q of the core is its decoupling voltage plus R i_q.

    ``bound`` [A]: how far the formats let the core's current vector lie from the logged one.
    """
    names = ("omega_me", "i_d", "i_q", "u_dec_q")
    core = {name: to_si(name, observed[f"observed_{name}"], drive) for name in names}
    return SimpleNamespace(
        row=np.arange(len(recording.t)),
        current_error=np.hypot(core["i_d"] - recording.i_d, core["i_q"] - recording.i_q),
        current_bound=bound,
        top_speed=np.abs(recording.rpm).max() * RPM * drive.machine.pole_pairs,
        top_current=np.hypot(recording.i_d, recording.i_q).max(),
        omega=recording.omega_me(drive.machine.pole_pairs),
        omega_core=core["omega_me"],
        i_q=recording.i_q,
        i_q_core=core["i_q"],
        u_q=recording.u_q,
        u_q_core=core["u_dec_q"] + drive.machine.resistance_ohm * core["i_q"],
    )


def recording_metrics(view: SimpleNamespace, result: dict) -> dict:
    """The replay's counts, and the core's current vector against the log [A], worst row, with its bound."""
    errors = {f"current_{k}_a": _rounded(getattr(view, f"current_{k}").max()) for k in ("error", "bound")}
    return {"samples_compared": result["periods_compared"], **result, **errors}


def verdict(summary: dict) -> str:
    """The whole result in one sentence."""
    text = f"{summary['periods_compared']:,} periods in Verilator and {summary['ghdl_periods']:,} in GHDL, "
    text += f"{_count(summary['differences'])}, duties {summary['sample_to_duty_clocks']} clocks after the sample"
    rec, ex = summary["recording"], summary["example"]
    if "skipped" in rec:
        text += "; recording skipped"
    else:
        text += f"; a real recording: {rec['samples_compared']:,} samples in Verilator and {rec['ghdl_periods']:,} in "
        text += f"GHDL, {_count(rec['differences'])}"
    named = sum(row["found"] is not None for row in ex["effects"])
    return f"{text}; on a motor that differs from its drive file {named} of {len(ex['effects'])} differences named."


def _count(differences: int) -> str:
    return f"{differences:,} difference{'' if differences == 1 else 's'}"


def text(summary: dict, drive: Drive) -> str:
    """The result for the terminal: what was compared, how it controls, the recording, the motor that differs."""
    s, rec, ns = summary, summary["recording"], summary["sample_to_duty_clocks"] / drive.core.clock_hz * 1e9
    ratio = f"{2 * s['carrier_half_clocks']:,} clocks a period"
    recording = "skipped: {skipped}" if "skipped" in rec else f"{{samples_compared:,}} samples, {LOGGED}"
    return f"""Fig. 9: {s["periods_compared"]:,} periods of {ratio} in Verilator, the first \
{s["ghdl_periods"]:,} in GHDL too: \
{_count(s["differences"])} in {s["gate_edges"]:,} gate edges and all values
control: duties {ns:.0f} ns after the sample, {s["speed_error_rpm"]["before_load_step"]:.1f} rpm off at 732 rpm, \
{s["speed_dip_rpm"]:.0f} rpm dip under load, peak current {s["peak_current_a"]:.2f} A, \
dead time {s["shortest_dead_time_us"]:g} µs
EMRAX 228 recording: {recording.format(**rec)}
{example_text(s["example"])}"""


def example_text(ex: dict) -> str:
    """The motor that differs from its drive file: the replay, the misfit, every name beside the truth."""
    fit, equal = ex["misfit"], "equal" if ex["replay_equal"] else "NOT equal"
    lines = [
        f"motor that differs from its drive file: {ex['periods_compared']:,} periods, {_count(ex['differences'])}; "
        f"{ex['replayed']:,} samples of telemetry replayed, {equal} in every bit",
        f"diagnosis: misfit at points that were not fitted {fit['holdout_before']:.3g} V before, "
        f"{fit['holdout_after']:.3g} V after",
    ]
    lines += [f"  {row['hidden']}: true {row['true_text']}, found {row['found_text']}" for row in ex["effects"]]
    return "\n".join([*lines, *(f"  {name}: asserted, but not there" for name in ex["false_names"])])


def described(drive: Drive) -> list[SimpleNamespace]:
    """The sections of drive.toml: rows of (key, value, unit), without what is left at its default."""
    sections = []
    for name in ("machine", "inverter", "control", "sensors"):
        section = getattr(drive, name)
        given = [(f, getattr(section, f.name)) for f in dataclasses.fields(section)]
        given = [(f.name, value, key_of(f).unit) for f, value in given if value not in (f.default, None)]
        rows = [(name, value, "" if unit == "1" else unit) for name, value, unit in given]
        sections.append(SimpleNamespace(name=name, rows=rows))
    return sections


def write(path: Path, figures: dict, summary: dict, **context) -> Path:
    """Render the page; every matplotlib figure becomes an image inside the page itself."""
    loader = jinja2.FileSystemLoader(TEMPLATES)
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True)
    svg = {name: plots.image(figure, "svg", metadata={"Date": None}) for name, figure in figures.items()}
    images = {name: base64.b64encode(data).decode() for name, data in svg.items()}
    context |= dict(
        values=len(Observed._fields), summary=summary, verdict=verdict(summary), sections=described(context["real"])
    )
    return write_text(path, environment.get_template("report.html").render(images=images, **context))
