"""Blocks of rows at steady operating points: what every effect computes its terms from.

A recording is cut into blocks of equal length in which current and speed hardly change.  Row k of a block is
the interval from sample k to k+1.  Where a current enters a regressor it is a parabola over the block: the
noise of a raw current is also in the misfit, and noise regressed on noise names an inductance on a healthy
drive.  The angle is a moving average over 2 HALF_WIDTH + 1 samples, in the misfit too: an inertia turns
smoothly, an encoder's code does not.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from diagnosis.recording import Recording, RecordingError
from diagnosis.shaft import airgap, shaft_kind

BLOCK_ROWS = 200
SHORTER = (100, 50)  # where dwells are short
LEAST_BLOCKS = 12
HALF_WIDTH = 8
MOST_BLOCKS = 320  # more rows than these blocks hold add time, not knowledge
RAMP_TORQUE = 0.02  # of rated torque: a change of inertial torque within a block beyond it is a ramp
SLOPE_REACH = 60  # samples over which the shaft's acceleration is taken beside a transducer
CURRENT_STEP = 0.08  # of rated current: a block with a larger change is a transient
SPEED_STEP = 0.06  # of the largest speed


STACKED = ("theta", "omega", "i", "i_raw", "u", "u_dc", "temp", "torque", "slope_m", "shaft", "rows")


@dataclass
class View:
    """Arrays over blocks (b) and samples (m + 1) or intervals (m) of one or several recordings of a drive.

    theta, omega, i: (b, m+1) smoothed angle [rad], speed [rad/s], current in dq, complex [A]
    i_raw: (b, m+1) measured current in the stator frame, complex [A]
    i_abc: (b, m+1, 3) measured phase currents, or None where the recording has dq only [A]
    u: (b, m+2) stator-frame voltage of the intervals -1 .. m, complex [V]; u_dc: (b, m) [V]
    t, temp, run: (b,) time since the first row [s], winding temperature [degC] or nan, number of the dwell
    torque: (b, m) torque at the shaft [Nm], nan where nothing is known of it; slope_m: (b, m) d omega_m / dt
    shaft: (b,) what is known of the shaft (see shaft.py)
    psi_extra: (b, m+1) flux beyond the nominal one that is known by now, for terms that depend on the flux [Wb]
    delta_l: what is known by now of L_d and L_q beyond the nominal [H]
    """

    nominal: object
    sample_time_s: float
    theta: np.ndarray
    omega: np.ndarray
    i: np.ndarray
    i_raw: np.ndarray
    i_abc: np.ndarray | None
    u: np.ndarray
    u_dc: np.ndarray
    t: np.ndarray
    temp: np.ndarray
    torque: np.ndarray
    slope_m: np.ndarray
    shaft: np.ndarray
    run: np.ndarray
    rows: np.ndarray  # (b,) first row in its recording
    span_s: float  # length of the whole recording
    psi_extra: np.ndarray | float = 0.0
    delta_l: tuple[float, float] = (0.0, 0.0)
    noise_gain: float = 1.0  # what a correction of the currents did to their noise
    memo: dict = dataclasses.field(default_factory=dict)  # of effects, the same for all views of a recording

    def __len__(self):
        return len(self.t)

    @property
    def machine(self):
        return self.nominal.machine

    @property
    def i_mid(self):
        """Smoothed dq current of an interval, (b, m) complex [A]."""
        return 0.5 * (self.i[:, 1:] + self.i[:, :-1])

    @property
    def omega_mid(self):
        """Speed of an interval, (b, m) [rad/s]."""
        return 0.5 * (self.omega[:, 1:] + self.omega[:, :-1])

    @property
    def theta_mid(self):
        """Angle in the middle of an interval, (b, m) [rad]."""
        return 0.5 * (self.theta[:, 1:] + self.theta[:, :-1])

    @property
    def nominal_psi(self):
        """Nominal flux linkage of the current, (b, m+1) complex dq [Wb]."""
        m = self.machine
        return m.inductance_d_h * self.i.real + 1j * m.inductance_q_h * self.i.imag + m.magnet_flux_wb

    @property
    def psi(self):
        """Flux linkage of the current as far as it is known, (b, m+1) complex dq [Wb]."""
        return self.nominal_psi + self.psi_extra

    def inductances(self, i):
        """L_d i_d + j L_q i_q of a dq current, inductances as far as they are known [Wb]."""
        l_d, l_q = self.machine.inductance_d_h + self.delta_l[0], self.machine.inductance_q_h + self.delta_l[1]
        return l_d * i.real + 1j * l_q * i.imag

    @property
    def has_sum(self):
        """Whether three phase currents were measured independently."""
        return self.i_abc is not None

    def stator(self, dq):
        """A dq quantity of the samples in the stator frame."""
        return dq * np.exp(1j * self.theta)

    def turned(self, delta):
        """The view with the measured angle less ``delta`` [rad], a number or (b, m+1)."""
        return self.replace(theta=self.theta - delta, i=self.i * np.exp(1j * delta) * np.ones_like(self.theta))

    def without_current(self, error, raw_gain=None, turn=0.0):
        """The view with phase errors (b, m+1, 3) [A] taken off the smoothed current, and off the measured one.

        raw_gain, turn: the measured currents are divided by the gains (3,) and turned back instead.
        """
        i = self.i - self.from_phases(error)
        if raw_gain is None:
            i_raw = self.i_raw - self.stator(self.from_phases(error))
            i_abc = None if self.i_abc is None else self.i_abc - error
            return self.replace(i=i, i_raw=i_raw, i_abc=i_abc)
        turns = np.exp(2j * np.pi / 3 * np.arange(3))
        measured = self.i_abc if self.i_abc is not None else (self.i_raw[..., None] * np.conj(turns)).real
        mended = measured / raw_gain
        i_raw = (2 / 3) * (mended @ turns) * (1.0 - 1j * turn)
        return self.replace(i=i, i_raw=i_raw, i_abc=None if self.i_abc is None else mended)

    def with_raw_current(self):
        """The view with the measured current in place of the smoothed one."""
        return self.replace(i=self.i_raw * np.exp(-1j * self.theta))

    def to_dq(self, stator):
        """(b, m) stator-frame quantity of the intervals, turned to dq at the middle angle."""
        return stator * np.exp(-1j * self.theta_mid)

    def flux(self, psi):
        """Mean EMF of a dq flux linkage given at the samples: (b, m+1) [Wb] to (b, m) complex dq [V]."""
        half = np.exp(0.5j * np.diff(self.theta, axis=1))
        return (half * psi[:, 1:] - np.conj(half) * psi[:, :-1]) / self.sample_time_s

    def phases(self, i_dq):
        """Phase values (b, k, 3) of a dq quantity at the samples (k = m+1) or the intervals (k = m)."""
        theta = self.theta if i_dq.shape[1] == self.theta.shape[1] else self.theta_mid
        stator = i_dq * np.exp(1j * theta)
        turns = np.exp(-2j * np.pi / 3 * np.arange(3))
        return (stator[..., None] * turns).real

    def from_phases(self, abc):
        """dq value of phase values (b, k, 3), amplitude-invariant Clarke."""
        theta = self.theta if abc.shape[1] == self.theta.shape[1] else self.theta_mid
        stator = (2 / 3) * (abc @ np.exp(2j * np.pi / 3 * np.arange(3)))
        return stator * np.exp(-1j * theta)

    def replace(self, **changes):
        """A copy with other arrays."""
        return dataclasses.replace(self, **changes)

    def take(self, index):
        """The blocks of ``index`` only."""
        per_block = (*STACKED, "i_abc", "t", "run")
        return self.replace(
            **{name: None if getattr(self, name) is None else getattr(self, name)[index] for name in per_block}
        )


def smooth(values, joined_run, half=HALF_WIDTH):
    """Moving average over 2 half + 1 samples, within runs of joined samples; nan where it does not fit in."""
    width = 2 * half + 1
    sums = np.cumsum(np.concatenate([[0], np.nan_to_num(values)]))  # a run ends at every row that is not a number
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
        slope_m[far:-far] = (theta_s[2 * far :] - 2 * theta_s[far:-far] + theta_s[: -2 * far]) / (far * period) ** 2
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
            f"{r.source}: no stretch of {block_rows + 2 * margin} rows ({(block_rows + 2 * margin) * period * 1e3:.0f} ms) "
            "without gap in which current and speed are steady: record operating points that last longer"
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
            np.ptp(x.real) < CURRENT_STEP * rated and np.ptp(x.imag) < CURRENT_STEP * rated and np.ptp(w) < SPEED_STEP * top
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
            same = abs(i[middle] - i[before]) < CURRENT_STEP * rated and abs(omega[middle] - omega[before]) < SPEED_STEP * top
            number += not (same and start - starts[k - 1] < 4 * block_rows and run[start] == run[starts[k - 1]])
        out.append(number)
    return np.array(out, int)


def joined_views(views: list[View]) -> View:
    """Several recordings of one drive as one view; time runs on, dwells stay apart."""
    first = views[0]
    if len(views) == 1:
        return first
    offsets_t = np.cumsum([0.0, *(v.span_s for v in views)])
    offsets_run = np.cumsum([0, *(v.run.max() + 1 for v in views)])
    stack = {
        name: np.concatenate([getattr(v, name) for v in views])
        for name in STACKED
    }
    phases = [v.i_abc for v in views]
    return first.replace(
        **stack,
        i_abc=None if any(p is None for p in phases) else np.concatenate(phases),
        t=np.concatenate([v.t + o for v, o in zip(views, offsets_t[:-1], strict=True)]),
        run=np.concatenate([v.run + o for v, o in zip(views, offsets_run[:-1], strict=True)]),
        span_s=float(offsets_t[-1]),
    )
