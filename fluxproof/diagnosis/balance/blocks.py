# SPDX-License-Identifier: BSD-3-Clause
"""Cuts a recording into blocks of equal length in which current and speed are steady.

Angles are moving averages over 2 HALF_WIDTH + 1 samples, in the misfit too: the rotor moves smoothly, unlike the codes
of an encoder.  Currents are parabolas over a block.  Short dwells are cut into shorter blocks; of very long recordings,
evenly spread blocks are kept.
"""

from __future__ import annotations

import numpy as np

from fluxproof.diagnosis.balance.curves import parabola
from fluxproof.diagnosis.balance.quantised_angle import angle_step
from fluxproof.diagnosis.balance.settling import settled
from fluxproof.diagnosis.balance.shaft import airgap, is_airgap, shaft_kind
from fluxproof.diagnosis.balance.used import count_rows
from fluxproof.diagnosis.balance.view import HALF_WIDTH, SLOPE_REACH, View, lacking
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.nominal import flux_level
from fluxproof.diagnosis.ground.recording import Recording, RecordingError
from fluxproof.plant.transforms import space_vector

BLOCK_ROWS = 200
SHORTER = (100, 50)  # for short dwells
LEAST_BLOCKS = 12
MOST_BLOCKS = 320  # more blocks increase the run time but hardly the accuracy
RAMP_TORQUE = 0.02  # of rated torque: a larger change of inertial torque within a block means a ramp
CURRENT_STEP = 0.08  # of rated current, or of what is recorded: a larger change within a block means a transient
RIPPLE = 0.05  # the same, rms around the block's parabola
RECORDED = 2.0  # times the largest recorded current, if that is less than the rated one: a step of it is a transient
LEAST_RATED = 0.1  # of rated current: noise of a sensor is a share of its range, whatever flows
SPEED_STEP = 0.06  # of the largest speed
LATE_SPEED_STEP = 0.003  # the same where the angle is integrated from the speed: a recorded speed is filtered and late
SLOW_SHARE = 0.01  # of the speed at which the EMF reaches the bus voltage: tolerance at standstill
RESTLESS = 3.0  # factor on the tolerances if no block is steady
EXACT = 1e-6  # of rated current: rounding of numbers in a computer
MOST_DECIMALS = 6  # with which a file writes currents


def smooth(values, joined_run, half=HALF_WIDTH):
    """Moving average over 2 half + 1 samples, within runs of joined samples; nan at their ends."""
    width = 2 * half + 1
    sums = np.cumsum(np.concatenate([[0], np.nan_to_num(values)]))  # a run ends at NaN
    out = np.full(len(values), np.nan, values.dtype)
    if len(values) >= width:
        out[half : len(values) - half] = (sums[width:] - sums[:-width]) / width
        same = joined_run[: len(values) - 2 * half] == joined_run[2 * half :]
        out[half : len(values) - half][~same] = np.nan
    return out


def stator_current(recording: Recording, theta) -> tuple[Complex, np.ndarray | None]:
    """Complex stator-frame current (n,) and phase currents (n, 3) or None."""
    r = recording
    if r.has("i_a", "i_b"):
        third = r["i_c"] if r.has("i_c") else -r["i_a"] - r["i_b"]
        abc = np.stack([r["i_a"], r["i_b"], third], axis=1)
        return space_vector(abc), abc if r.has("i_c") else None
    return (r["i_d"] + 1j * r["i_q"]) * np.exp(1j * theta), None  # a dq log was already rotated by the drive


def _third_is_computed(i_abc, rated) -> bool:
    """Whether phase currents (n, 3) sum to zero but for the decimals to which the three were rounded in a file."""
    return bool(np.nanmax(np.abs(i_abc.sum(axis=1)), initial=0.0) <= 1.5 * _decimal_step(i_abc) + EXACT * rated)


def _decimal_step(values) -> float:
    """The power of ten, 1 at most, of which all values are multiples; 0 if they have more than MOST_DECIMALS."""
    known = values[np.isfinite(values)]
    for decimals in range(MOST_DECIMALS + 1):
        scaled = known * 10.0**decimals
        if np.all(np.abs(scaled - np.round(scaled)) < 1e-3):
            return 10.0**-decimals
    return 0.0


def _unwrapped(recording, run):
    """Unwrapped angle (n,) [rad]; gaps are bridged with the recorded speed, to preserve the mechanical turn."""
    theta = np.unwrap(recording["theta_e"])
    breaks = np.flatnonzero(np.diff(run)) + 1
    if len(breaks) and recording.has("omega_e"):
        t, omega = recording["t"], recording["omega_e"]
        expected = theta[breaks - 1] + 0.5 * (omega[breaks] + omega[breaks - 1]) * (t[breaks] - t[breaks - 1])
        turns = np.zeros(len(theta))
        turns[breaks] = np.round((expected - theta[breaks]) / (2 * np.pi))
        theta += 2 * np.pi * np.cumsum(turns)  # a gap moves all rows behind it
    return theta


def view_of(recording: Recording, nominal, catalogue: dict | None = None, block_rows=BLOCK_ROWS) -> View:
    """Cut a recording into steady blocks; catalogue: {name: Effect} that the drive file can describe.

    Raises RecordingError if there is no steady block.
    """
    r, period, machine = recording, nominal.sample_time_s, nominal.machine
    n = len(r)
    linked = r.joined[:-1] & r.usable[:-1] & r.usable[1:]
    run = np.concatenate([[0], np.cumsum(~linked)])
    theta = _unwrapped(r, run)
    i_raw, i_abc = stator_current(r, theta)
    if i_abc is not None and _third_is_computed(i_abc[r.usable], machine.rated_current_a):
        i_abc = None
    theta_s = smooth(theta, run)
    i_s = smooth(i_raw * np.exp(-1j * theta), run)
    omega = np.full(n, np.nan)
    omega[1:-1] = (theta_s[2:] - theta_s[:-2]) / (2 * period)
    u, u_dc_mid = _voltage(r, nominal, theta_s)
    mean_duty = _mean_duty(r, nominal)
    kind, torque, slope_m = _mechanics(r, nominal, i_s, theta, theta_s, linked)
    starts, dwell, block_rows = _cut(r, nominal, run, i_s, omega, block_rows)
    samples = starts[:, None] + np.arange(block_rows + 1)
    rows = starts[:, None] + np.arange(block_rows)
    around = starts[:, None] + np.arange(-1, block_rows + 1)
    torque, slope_m = torque[rows], slope_m[rows]
    if kind == "torque":  # an acceleration over many samples is wrong at the end of a ramp
        ends = np.array_split(slope_m, 4, axis=1)
        swing = (machine.inertia_kgm2 or 0.0) * np.ptp([e.mean(axis=1) for e in ends], axis=0)
        torque[swing > RAMP_TORQUE * airgap(nominal, np.array(1j * machine.rated_current_a))] = np.nan
    missing = np.full(len(starts), np.nan)
    passed = r["t"][rows].mean(axis=1) - r["t"][0]
    view = View(
        nominal=nominal,
        catalogue=catalogue or {},
        sample_time_s=period,
        theta=theta_s[samples],
        omega=omega[samples],
        i=parabola(i_raw[samples] * np.exp(-1j * theta_s[samples])),
        i_raw=i_raw[samples],
        i_abc=None if i_abc is None else i_abc[samples],
        u=u[around],
        u_dc=u_dc_mid[rows],
        mean_duty=mean_duty[around] if r.has("d_a", "d_b", "d_c") else None,
        t=passed,
        course=passed / max(float(r["t"][-1] - r["t"][0]), 1e-9),
        temp=r["temp_winding"][rows].mean(axis=1) if r.has("temp_winding") else missing,
        torque=torque,
        slope_m=slope_m,
        shaft=np.full(len(starts), kind),
        run=dwell,
        rows=starts,
        span_s=float(r["t"][-1] - r["t"][0]),
        lacks=lacking(r.lacks, len(starts)) if r.lacks else None,
        angle_step=angle_step(theta, linked),
        dq_voltage=not r.has("d_a", "d_b", "d_c") and "inverter" not in r.lacks,
    )
    return settled(view)


def views_of(recordings, nominal, catalogue: dict | None = None) -> list[View]:
    """Views of several recordings of a drive, all with the block length of the one that needs the shortest."""
    views = [view_of(r, nominal, catalogue) for r in recordings]
    shortest = min(v.u_dc.shape[1] for v in views)
    return [
        v if v.u_dc.shape[1] == shortest else view_of(r, nominal, catalogue, shortest)
        for r, v in zip(recordings, views, strict=True)
    ]


def _voltage(recording, nominal, theta_s) -> tuple[Complex, np.ndarray]:
    """Stator-frame voltage (n,) complex [V] in force after each sample, and the bus voltage (n,) [V]."""
    r, n, delay = recording, len(recording), nominal.control.duty_applied_after_samples
    u_dc = r["u_dc"] if r.has("u_dc") else np.full(n, float(nominal.inverter.dc_bus_v))
    u_dc_mid = np.append(0.5 * (u_dc[1:] + u_dc[:-1]), u_dc[-1])
    if "inverter" in r.lacks:  # measured means of the interval after each sample (emf.py)
        return space_vector(np.stack([r["u_a"], r["u_b"], r["u_c"]], axis=1)), u_dc_mid
    asked: Complex = np.full(n, np.nan + 0j)
    if r.has("d_a", "d_b", "d_c"):
        duties = np.stack([r["d_a"], r["d_b"], r["d_c"]], axis=1)
        asked[delay:] = space_vector(duties)[: n - delay]
        return asked * u_dc_mid, u_dc_mid
    # The controller advances its reference by the delay angle, so that it is valid at the middle of its period.
    asked[delay:] = (r["u_d_ref"] + 1j * r["u_q_ref"])[: n - delay]
    middle = np.append(0.5 * (theta_s[1:] + theta_s[:-1]), np.nan)
    return asked * np.exp(1j * middle), u_dc_mid


def _mean_duty(recording, nominal):
    """Mean (n,) of the three duties in force after each sample, nan where the recording has none."""
    r, n, delay = recording, len(recording), nominal.control.duty_applied_after_samples
    mean = np.full(n, np.nan)
    if r.has("d_a", "d_b", "d_c"):
        mean[delay:] = ((r["d_a"] + r["d_b"] + r["d_c"]) / 3.0)[: n - delay]
    return mean


def _mechanics(recording, nominal, i_s, theta, theta_s, linked):
    """(kind of shaft, torque at the shaft (n,) [Nm] or nan, d omega_m / dt (n,) [rad/s^2])."""
    n, period = len(recording), nominal.sample_time_s
    kind = shaft_kind(recording, nominal, i_s, theta_s, linked)
    slope = np.zeros(n)
    if kind == "torque":
        # On an imposed speed the transducer measures the ripple; the inertial torque is slow.
        far = SLOPE_REACH
        bend = theta_s[2 * far :] - 2 * theta_s[far:-far] + theta_s[: -2 * far]
        slope[far:-far] = bend / (far * period) ** 2
    elif kind != "driving":  # the ripple of a free shaft appears in the angle only
        slope[1:-2] = (theta[3:] - theta[2:-1] - theta[1:-2] + theta[:-3]) / (2 * period**2)
    slope_m = np.nan_to_num(slope) / nominal.machine.pole_pairs
    if recording.has("torque"):
        omega_m = np.gradient(theta_s, period) / nominal.machine.pole_pairs
        drag, torque = (nominal.machine.viscous_friction_nms or 0.0) * omega_m, recording["torque"]
        if is_airgap(torque, airgap(nominal, i_s), drag):
            torque = torque - drag - (nominal.machine.inertia_kgm2 or 0.0) * slope_m
        return kind, at_middle(torque), slope_m
    return kind, np.full(n, 0.0 if kind in ("unloaded", "free") else np.nan), slope_m


def at_middle(x):
    """Samples (n,) interpolated to the middles of their intervals, to which the rest of the balance refers.

    The four-point interpolation has the gain (9 cos(wT/2) - cos(3wT/2)) / 8, within 1 % of one up to wT = 0.8.
    """
    out = np.array(x, float)
    out[:-1] = 0.5 * (x[1:] + x[:-1])
    out[1:-2] = (9.0 * (x[2:-1] + x[1:-2]) - (x[3:] + x[:-3])) / 16.0
    return out


def _cut(recording, nominal, run, i_s, omega, block_rows):
    """(first rows, dwell numbers, rows of a block); long steady blocks if there are enough of them."""
    machine, period = nominal.machine, nominal.sample_time_s
    margin = HALF_WIDTH + nominal.control.duty_applied_after_samples + 2
    slow = SLOW_SHARE * nominal.inverter.dc_bus_v / flux_level(machine)
    top = max(float(np.nanmax(np.abs(omega), initial=0.0)), slow)
    scale = (_current_scale(i_s, machine.rated_current_a), top)
    lengths = [block_rows, *(n for n in SHORTER if n < block_rows)]
    steps = [SPEED_STEP] if recording.meta.get("angle") != "integrated" else [LATE_SPEED_STEP, SPEED_STEP]
    tries = [(n, 1.0, step) for step in steps for n in lengths]
    for length, patience, step in [*tries, (min(SHORTER), RESTLESS, SPEED_STEP)]:
        starts = _steady_starts(run, i_s, omega, scale, length, margin, patience, step)
        if len(starts) >= LEAST_BLOCKS:
            break
    if not len(starts):
        whole = length + 2 * margin
        longest = int(np.bincount(run).max())
        if longest < whole:
            raise RecordingError(
                f"{recording.source}: at most {longest} rows follow each other without a gap or a row that cannot be "
                f"used, and {whole} are needed: rows are missing; record without losing rows"
            )
        raise RecordingError(
            f"{recording.source}: no stretch of {whole} rows ({whole * period * 1e3:.0f} ms) without gap in which "
            "current and speed are steady: record longer operating points"
        )
    dwell = _dwells(starts, run, i_s, omega, scale, length)
    if "windows" in recording.meta:  # blocks of one fit are one observation (ingest/emf_probe.py)
        number = np.searchsorted(recording.meta["windows"], recording["t"][starts + length // 2], side="right")
        keep = np.unique(number, return_index=True)[1]
        starts, dwell = starts[keep], dwell[keep]
    count_rows(recording, len(starts) * length, min(len(starts), MOST_BLOCKS) * length)
    if len(starts) > MOST_BLOCKS:
        keep = np.unique(np.linspace(0, len(starts) - 1, MOST_BLOCKS).round().astype(int))
        starts, dwell = starts[keep], dwell[keep]
    return starts, dwell, length


def _current_scale(i, rated) -> float:
    """Current [A] that the tolerances are shares of: the rated one, less if the recording reaches little of it.

    With a rated current of ten times the true one, steps between operating points were steady blocks.
    """
    recorded = float(np.nanquantile(np.abs(i), 0.99)) if np.isfinite(i).any() else rated
    return rated * min(max(RECORDED * recorded / rated, LEAST_RATED), 1.0)


def _steady_starts(run, i, omega, scale, block_rows, margin, patience, speed_step):
    """First rows of the blocks within a run in which current and speed are steady, apart from ripple."""
    n, length = len(run), block_rows + 2 * margin
    rated, top = scale
    starts, at = [], 0
    while at + length <= n:
        end = at + length - 1
        if run[at] != run[end]:
            at = int(np.searchsorted(run, run[at], side="right"))
            continue
        inner = slice(at + margin, at + margin + block_rows + 1)
        x, w = i[inner], omega[inner]
        trend = parabola(x[None])[0]
        ripple = np.sqrt(np.mean(np.abs(x - trend) ** 2))
        if (
            np.ptp(trend.real) < patience * CURRENT_STEP * rated
            and np.ptp(trend.imag) < patience * CURRENT_STEP * rated
            and ripple < patience * RIPPLE * rated
            and np.ptp(w) < patience * speed_step * top
        ):
            starts.append(at + margin)
            at += block_rows
        else:
            at += max(1, block_rows // 8)
    return np.array(starts, int)


def _dwells(starts, run, i, omega, scale, block_rows):
    """Dwell number of each block; consecutive blocks at the same operating point share a dwell."""
    rated, top = scale
    number, out = 0, []
    for k, start in enumerate(starts):
        middle = start + block_rows // 2
        if k:
            before = starts[k - 1] + block_rows // 2
            near = abs(i[middle] - i[before]) < CURRENT_STEP * rated
            near &= abs(omega[middle] - omega[before]) < SPEED_STEP * top
            near &= start - starts[k - 1] < 4 * block_rows and run[start] == run[starts[k - 1]]
            number += not near
        out.append(number)
    return np.array(out, int)
