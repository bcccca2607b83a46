# SPDX-License-Identifier: BSD-3-Clause
"""Sample time against drive.toml: wrong unit, too few digits, gaps, a slow log, a wrong sample time.

A row is joined to the next if the step equals the sample time.  A log slower than the control is marked slow and its
rows are joined by its own step; then only steady operating points are used.  If the angle is recorded, it decides
whether an unexpected step is a wrong unit or a slow log: theta must advance by omega times the step.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.ground.quantities import counted
from fluxproof.diagnosis.ground.recording import Problem
from fluxproof.diagnosis.ingest.points import held_one_after_another, mark_points

STAGE = "time"
AFTER = ("order", "rows_held")
TOLERANCE = 0.02  # of the sample time: the clock of a logger is more accurate
JOINED = 0.25
SLOW_FROM = 1.5
UNITS = {"ms": 1e3, "us": 1e6, "ns": 1e9}


def check(recording, nominal) -> None:
    if recording.fatal or recording.points or len(recording) < 2:
        return
    if differ := of_another_drive(recording.meta.get("telemetry"), nominal):
        message = (
            f"the telemetry is that of another drive than the drive file's: {differ}; give the drive file of the dump"
        )
        recording.problems.append(Problem("sample_time", message, "t", 0, len(recording), fatal=True))
        return
    period = nominal.sample_time_s
    step = np.diff(recording["t"])
    if _rebuild_coarse(recording, step, period):
        step = np.diff(recording["t"])
    usual = float(np.median(step[step > 0]))
    unit = _unit(recording, usual, period)
    if unit:
        factor = 1.0 / UNITS[unit]
        recording.columns["t"] = recording["t"] * factor
        step, usual = step * factor, usual * factor
        recording.problems.append(
            Problem(
                "unit",
                f"time advances by {usual / factor:g} per row",
                "t",
                0,
                len(recording),
                f"interpreted as {unit}",
            )
        )
    ratio = usual / period
    if abs(ratio - 1.0) <= TOLERANCE:
        usual = period
    elif held_one_after_another(recording, usual, nominal):
        mark_points(recording, usual, period)
    elif ratio >= SLOW_FROM:
        recording.slow = True
        message = f"a row every {usual:g} s, the control samples every {period:g} s: too slow for a row-to-row balance"
        recording.problems.append(
            Problem("slow_sampling", message, "t", 0, len(recording), "only steady operating points are used")
        )
    elif not _time_is_wrong(recording, ratio, period):
        message = f"a row every {usual:g} s, but [control] sample_time_s or 1 / pwm_frequency_hz is {period:g} s"
        if ratio < 1.0 / SLOW_FROM:
            message += ": of several rows a period, keep those at which the current was sampled for the control"
        recording.problems.append(Problem("sample_time", message, "t", 0, len(recording), fatal=True))
        return
    else:
        step, usual = np.diff(recording["t"]), period
    if not recording.slow and "u_q_ref" in recording.columns and not _has_voltage(recording):
        recording.slow = True
        message = "u_d_ref is not recorded: no balance from row to row"
        recording.problems.append(
            Problem("one_axis", message, "u_d_ref", -1, 0, "only the q axis of steady operating points is used")
        )
    _join(recording, step, usual)


def of_another_drive(header, nominal) -> str:
    """What the header of a dump contradicts in the drive file; "" if its sample time agrees, or all else does."""
    if header is None or abs(header["sample_time_s"] / nominal.sample_time_s - 1.0) <= TOLERANCE:
        return ""
    s, machine, chosen, bases = nominal.sensors, nominal.machine, nominal.bases, header["bases"]
    volts = chosen.voltage_v or (s.u_dc_range_v or 0.0) / 2.0
    pairs = {
        "current at full code": (bases["current_a"], chosen.current_a or s.current_range_a, "A"),
        "bus voltage at full code": (2.0 * bases["voltage_v"], 2.0 * volts, "V"),
        "electrical speed at 1.0": (
            bases["omega_me_rad_s"], chosen.omega_me_rad_s or machine.pole_pairs * machine.rated_speed_rad_s, "rad/s"
        ),
        "adc_bits": (header["config"]["adc_bits"], s.adc_bits, ""),
        "position_bits": (header["config"]["position_bits"], s.position_bits, ""),
    }  # fmt: skip
    differ = [
        f"{name} {ran:g} {unit}".rstrip() + f", not {stated:g}"
        for name, (ran, stated, unit) in pairs.items()
        if stated and abs(ran / stated - 1.0) > TOLERANCE
    ]
    time = f"sample time {header['sample_time_s'] * 1e6:g} us, not {nominal.sample_time_s * 1e6:g}"
    return "; ".join([time, *differ]) if differ else ""


def _has_voltage(recording) -> bool:
    return recording.has("d_a", "d_b", "d_c") or recording.has("u_d_ref", "u_q_ref")


def _join(recording, step, usual) -> None:
    """Set ``joined`` and report gaps; the start of a new run is no gap."""
    width = JOINED if not recording.slow else 0.5
    recording.joined[:-1] &= np.abs(step - usual) < width * usual
    recording.joined[-1] = False
    new_run = np.zeros(len(step), bool)
    if "run" in recording.meta:
        new_run = np.diff(recording.meta["run"]) != 0
        recording.joined[:-1] &= ~new_run
        recording.meta["notes"].append(f"{counted(int(new_run.sum()) + 1, 'run')}, treated separately")
    gaps = np.flatnonzero((step > 1.5 * usual) & ~new_run)
    together = np.flatnonzero((step < 0.5 * usual) & ~new_run)
    irregular = recording.slow and len(gaps) + len(together) > 0.2 * len(step)
    if irregular:
        recording.meta["notes"].append("the time steps are irregular, which is accepted in a slow log")
        return
    if len(gaps):
        lost = int(np.sum(np.round(step[gaps] / usual) - 1))
        message = f"{counted(len(gaps), 'gap')}, about {counted(lost, 'row')} missing"
        recording.problems.append(
            Problem("gap", message, "t", int(gaps[0]) + 1, len(gaps),
                    "no balance is made across them")
        )  # fmt: skip
    if len(together):
        recording.problems.append(
            Problem("duplicate", f"{counted(len(together), 'row')} almost simultaneous with the previous one", "t",
                    int(together[0]) + 1, len(together), "no balance is made across them")
        )  # fmt: skip


def _unit(recording, usual, period) -> str:
    """The unit of a time that is not in seconds; "" if it may be seconds."""
    if "t" in recording.meta.get("stated_units", ()):
        return ""
    for unit, factor in UNITS.items():
        if abs(usual / (period * factor) - 1.0) > TOLERANCE:
            continue
        ratio = angle_speed_ratio(recording, period)
        if ratio is not None:
            return unit if abs(ratio - 1.0) < 0.1 else ""
        if usual > 10.0:  # a drive is not logged every 10 s
            return unit
    return ""


def _rebuild_coarse(recording, step, period) -> bool:
    """Rebuild a time with too few digits, which repeats and jumps, from its mean step; False if not needed."""
    still = np.count_nonzero(step == 0)
    if still < 0.01 * len(step):
        return False
    t = recording["t"]
    mean = (t[-1] - t[0]) / len(step)
    for factor, unit in ((1.0, "s"), *((1.0 / f, u) for u, f in UNITS.items())):
        if abs(mean * factor / period - 1.0) <= TOLERANCE:
            even = t[0] + np.arange(len(t)) * mean
            if np.max(np.abs(t - even)) > np.max(step) + 2 * mean:
                break
            recording.columns["t"] = t[0] * factor + np.arange(len(t)) * period
            message = f"the time has too few digits: {still} rows share one with the row before"
            row = int(np.argmax(step == 0)) + 1
            action = "rebuilt from the sample time" + ("" if unit == "s" else f", taken as {unit}")
            recording.problems.append(Problem("coarse_time", message, "t", row, int(still), action))
            return True
    return False


def _time_is_wrong(recording, ratio, period) -> bool:
    """Whether the angle shows that rows are one sample time apart; the time is then rebuilt."""
    found = angle_speed_ratio(recording, period)
    if found is None or abs(found - 1.0) > 0.01 or abs(ratio - 1.0) < 0.05:
        return False
    t = recording["t"]
    recording.columns["t"] = t[0] + (t - t[0]) / ratio
    message = f"time advances {ratio:.3g} times too fast for angle and speed"
    recording.problems.append(Problem("sample_time", message, "t", 0, len(t), "rebuilt from the sample time"))
    return True
