"""Cuts a recording into blocks of equal length in which current and speed hardly change.

Angles are moving averages over 2 HALF_WIDTH + 1 samples, in the misfit too: an inertia turns smoothly, an
encoder's code does not.  Currents are parabolas over a block.  Where dwells are short the blocks are shorter;
where rows abound, evenly spread blocks are kept.
"""

from __future__ import annotations

import numpy as np

from diagnosis.recording import Recording, RecordingError
from diagnosis.shaft import airgap, shaft_kind
from diagnosis.view import View

BLOCK_ROWS = 200
SHORTER = (100, 50)  # where dwells are short
LEAST_BLOCKS = 12
HALF_WIDTH = 8
MOST_BLOCKS = 320  # more rows than these blocks hold add time, not knowledge
RAMP_TORQUE = 0.02  # of rated torque: a change of inertial torque within a block beyond it is a ramp
SLOPE_REACH = 60  # samples over which the shaft's acceleration is taken beside a transducer
CURRENT_STEP = 0.08  # of rated current: a block with a larger change is a transient
SPEED_STEP = 0.06  # of the largest speed


def smooth(values, joined_run, half=HALF_WIDTH):
    """Moving average over 2 half + 1 samples, within runs of joined samples; nan where it does not fit in."""
    width = 2 * half + 1
    sums = np.cumsum(
        np.concatenate([[0], np.nan_to_num(values)])
    )  # a run ends at every row that is not a number
    out = np.full(len(values), np.nan, values.dtype)
    if len(values) >= width:
        out[half : len(values) - half] = (sums[width:] - sums[:-width]) / width
        same = joined_run[: len(values) - 2 * half] == joined_run[2 * half :]
        out[half : len(values) - half][~same] = np.nan
    return out


def parabola(values):
    """Every row of (b, k) values as the parabola that fits it best."""
    x = np.linspace(-1.0, 1.0, values.shape[1])
    basis, _ = np.linalg.qr(np.stack([np.ones_like(x), x, x**2], axis=1))
    return (values @ basis) @ basis.T


def stator_current(recording: Recording, theta):
    """Complex stator-frame current (n,) and phase currents (n, 3) or None."""
    r = recording
    if r.has("i_a", "i_b"):
        third = r["i_c"] if r.has("i_c") else -r["i_a"] - r["i_b"]
        abc = np.stack([r["i_a"], r["i_b"], third], axis=1)
        return (2 / 3) * (abc @ np.exp(2j * np.pi / 3 * np.arange(3))), abc if r.has("i_c") else None
    return (r["i_d"] + 1j * r["i_q"]) * np.exp(1j * theta), None  # a dq log was turned by the drive already


def _unwrapped(recording, run, sample_time_s):
    """Angle without jumps (n,) [rad]; gaps are bridged with the recorded speed, so that the mechanical turn is kept."""
    theta = np.unwrap(recording["theta_e"])
    breaks = np.flatnonzero(np.diff(run)) + 1
    if len(breaks) and recording.has("omega_e"):
        t, omega = recording["t"], recording["omega_e"]
        for k in breaks:
            expected = theta[k - 1] + 0.5 * (omega[k] + omega[k - 1]) * (t[k] - t[k - 1])
            theta[k:] += 2 * np.pi * np.round((expected - theta[k]) / (2 * np.pi))
    return theta


def view_of(recording: Recording, nominal, block_rows=BLOCK_ROWS) -> View:
    """Cut a recording into steady blocks.

    Raises RecordingError where no block is left.
    """
    r, period, machine = recording, nominal.sample_time_s, nominal.machine
    n, delay = len(r), nominal.control.duty_applied_after_samples
    linked = r.joined[:-1] & r.usable[:-1] & r.usable[1:]
    run = np.concatenate([[0], np.cumsum(~linked)])
    theta = _unwrapped(r, run, period)
    i_raw, i_abc = stator_current(r, theta)
    if i_abc is not None and np.nanmax(np.abs(i_abc.sum(axis=1))) < 1e-6 * machine.rated_current_a:
        i_abc = None  # the third current was computed from the other two
    theta_s = smooth(theta, run)
    i_s = smooth(i_raw * np.exp(-1j * theta), run)
    omega = np.full(n, np.nan)
    omega[1:-1] = (theta_s[2:] - theta_s[:-2]) / (2 * period)
    u_dc = r["u_dc"] if r.has("u_dc") else np.full(n, float(nominal.inverter.dc_bus_v))
    u_dc_mid = np.append(0.5 * (u_dc[1:] + u_dc[:-1]), u_dc[-1])
    asked = np.full(n, np.nan + 0j)
    if r.has("d_a", "d_b", "d_c"):
        duties = np.stack([r["d_a"], r["d_b"], r["d_c"]], axis=1)
        vector = (2 / 3) * (duties @ np.exp(2j * np.pi / 3 * np.arange(3)))
        asked[delay:] = vector[: n - delay]
        u = asked * u_dc_mid
    else:
        # A controller that turns its reference by the delay's angle: it acts at the middle of its own period.
        asked[delay:] = (r["u_d_ref"] + 1j * r["u_q_ref"])[: n - delay]
        middle = np.append(0.5 * (theta_s[1:] + theta_s[:-1]), np.nan)
        u = asked * np.exp(1j * middle)
    kind = shaft_kind(r, nominal, i_s, theta_s, linked)
    torque = r["torque"] if kind == "torque" else np.full(n, 0.0 if kind in ("unloaded", "free") else np.nan)
    slope_m = np.zeros(n)
    if kind == "torque":
        # The transducer saw the ripple; what an inertia takes of it is slow.
        far = SLOPE_REACH
        slope_m[far:-far] = (theta_s[2 * far :] - 2 * theta_s[far:-far] + theta_s[: -2 * far]) / (
            far * period
        ) ** 2
    else:  # a free shaft shows its ripple in the angle alone
        slope_m[1:-2] = (theta[3:] - theta[2:-1] - theta[1:-2] + theta[:-3]) / (2 * period**2)
    slope_m = np.nan_to_num(slope_m) / machine.pole_pairs
    margin = HALF_WIDTH + delay + 2
    lengths = [block_rows, *(n for n in SHORTER if n < block_rows)]
    for block_rows in lengths:
        starts = _steady_starts(run, i_s, omega, machine.rated_current_a, block_rows, margin)
        if len(starts) >= LEAST_BLOCKS:
            break
    if not len(starts):
        raise RecordingError(
            f"{r.source}: no stretch of {block_rows + 2 * margin} rows "
            f"({(block_rows + 2 * margin) * period * 1e3:.0f} ms) without gap in which current and speed are steady: record operating points that last longer"
        )
    dwell = _dwells(starts, run, i_s, omega, machine.rated_current_a, block_rows)
    if len(starts) > MOST_BLOCKS:
        keep = np.unique(np.linspace(0, len(starts) - 1, MOST_BLOCKS).round().astype(int))
        starts, dwell = starts[keep], dwell[keep]
    samples = starts[:, None] + np.arange(block_rows + 1)
    rows = starts[:, None] + np.arange(block_rows)
    around = starts[:, None] + np.arange(-1, block_rows + 1)
    torque, slope_m = torque[rows], slope_m[rows]
    if kind == "torque":  # an acceleration taken over many samples is wrong where a ramp ends
        quarters = slope_m.reshape(len(starts), 4, -1).mean(axis=2)
        swing = (machine.inertia_kgm2 or 0.0) * np.ptp(quarters, axis=1)
        torque[swing > RAMP_TORQUE * airgap(nominal, np.array(1j * machine.rated_current_a))] = np.nan
    block_mean = lambda name: r[name][rows].mean(axis=1) if r.has(name) else np.full(len(starts), np.nan)  # noqa: E731
    return View(
        nominal=nominal,
        sample_time_s=period,
        theta=theta_s[samples],
        omega=omega[samples],
        i=parabola(i_raw[samples] * np.exp(-1j * theta_s[samples])),
        i_raw=i_raw[samples],
        i_abc=None if i_abc is None else i_abc[samples],
        u=u[around],
        u_dc=u_dc_mid[rows],
        t=r["t"][rows].mean(axis=1) - r["t"][0],
        temp=block_mean("temp_winding"),
        torque=torque,
        slope_m=slope_m,
        shaft=np.full(len(starts), kind),
        run=dwell,
        rows=starts,
        span_s=float(r["t"][-1] - r["t"][0]),
    )


def _steady_starts(run, i, omega, rated, block_rows, margin):
    """First rows of the blocks that lie within a run and hold current and speed."""
    n, length = len(run), block_rows + 2 * margin
    top = max(np.nanmax(np.abs(omega)), 1e-9)
    starts, at = [], 0
    while at + length <= n:
        end = at + length - 1
        if run[at] != run[end]:
            at = int(np.searchsorted(run, run[at], side="right"))
            continue
        inner = slice(at + margin, at + margin + block_rows + 1)
        x, w = i[inner], omega[inner]
        still = (
            np.ptp(x.real) < CURRENT_STEP * rated
            and np.ptp(x.imag) < CURRENT_STEP * rated
            and np.ptp(w) < SPEED_STEP * top
        )
        if still and np.isfinite(x).all() and np.isfinite(w).all():
            starts.append(at + margin)
            at += block_rows
        else:
            at += max(1, block_rows // 8)
    return np.array(starts, int)


def _dwells(starts, run, i, omega, rated, block_rows):
    """Number of the dwell each block belongs to: neighbours in time at the same operating point."""
    top = max(np.nanmax(np.abs(omega)), 1e-9)
    number, out = 0, []
    for k, start in enumerate(starts):
        middle = start + block_rows // 2
        if k:
            before = starts[k - 1] + block_rows // 2
            same = (
                abs(i[middle] - i[before]) < CURRENT_STEP * rated
                and abs(omega[middle] - omega[before]) < SPEED_STEP * top
            )
            number += not (
                same and start - starts[k - 1] < 4 * block_rows and run[start] == run[starts[k - 1]]
            )
        out.append(number)
    return np.array(out, int)
