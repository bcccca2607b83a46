# SPDX-License-Identifier: BSD-3-Clause
"""A View of a slow log: every steady stretch becomes one block, which represents an operating point.

The rows of such a block are synthetic: constant current, voltage and speed over a few sampling periods, so that cells,
fit and search work as with a fast recording.  The frame rotates with the rotor and the angle within it is constant, so
that only harmonic order zero exists, as in a slow log.  Three things differ from a View of real rows:

    flux     the mean EMF is exactly j omega psi, not a difference of flux linkages
    to_dq    voltages are kept in a stator frame that rotates from row to row, so that a delay is defined
    phases   phase currents cover one whole electrical turn, since the inverter loss is a mean over it; of a rotor at
             rest they are those at its angle

Stretches at the same operating point share a dwell at any distance in time; their differences are noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.balance.point_rows import block_points, point_rows
from fluxproof.diagnosis.balance.slow_stretches import Stretches, stretches
from fluxproof.diagnosis.balance.used import count_rows
from fluxproof.diagnosis.balance.view import STACKED, View, lacking
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.recording import Recording
from fluxproof.plant.transforms import phase_values, space_vector

ROWS = 36  # one turn in steps of ten degrees: the mean inverter loss is accurate to 0.1 %
BIN_CURRENT, BIN_SPEED = 0.05, 0.05  # of rated current and of the largest speed: the same operating point
BIN_TEMP_K = 10.0  # of the winding
NO_CURRENT = 0.02  # of rated current: an axis that never had more contains only noise
MOST_ALIKE = 6  # largest number of stretches per operating point
MOST_OF_ONE = 120  # the same of a recording with one operating point

# What no operating point shows.
LACKS = frozenset({"harmonics"})


@dataclass
class SlowView(View):
    """Operating points as blocks; see the module's header.  ``theta`` contains only the rotation of corrections.

    unsteady: (b,) change of the voltage around each stretch [V].
    rest: (b,) angle of a rotor at rest [rad], nan if it turns.
    d_known: (b,) bool, whether the d voltage was recorded.
    aged: (b, 2) error that the ages of two columns leave in common (moving_stretches.py) [V].
    """

    unsteady: np.ndarray | float = 0.0
    rest: np.ndarray | float = np.nan
    d_known: np.ndarray | bool = True
    aged: Complex | float = 0.0

    stacked = (*STACKED, "unsteady", "rest", "d_known", "aged")

    @property
    def least_error(self):
        return k.SLOW_LEAST

    def balance_error(self):
        level = np.abs(self.u).mean(axis=1)
        own = k.SLOW_DC * self.nominal.inverter.dc_bus_v + k.SLOW_U * level
        return np.hypot(own, k.SLOW_CHANGE * self.unsteady)

    def common_errors(self):
        ages = np.asarray(self.aged).T[..., None] * np.ones(self.u_dc.shape[1]) if np.any(self.aged) else ()
        return (*super().common_errors(), *ages)

    def _advance(self, count, first=0.5):
        """Angle of the rotor at intervals counted from the first sample, (b, count) [rad]."""
        return self.omega[:, :1] * self.sample_time_s * (np.arange(count) + first)

    @property
    def interval_angle(self):
        return super().interval_angle + self._advance(self.u.shape[1], -0.5)

    def at_speed(self, factor):
        """The view with the speed times ``factor`` and the same voltages in dq."""
        u = self.u * np.exp(1j * (factor - 1.0) * self._advance(self.u.shape[1], -0.5))
        return self.replace(omega=factor * self.omega, u=u)

    def to_dq(self, stator):
        return stator * np.exp(-1j * (self.theta_mid + self._advance(stator.shape[1])))

    def flux(self, psi):
        return 0.5j * self.omega_mid * (psi[:, 1:] + psi[:, :-1])

    def _turn(self, count):
        """One electrical turn in ``count`` or, of samples, count - 1 steps; the angle at rest, (b, count) [rad]."""
        steps = self.theta.shape[1] - 1
        turn = 2 * np.pi * (np.arange(count) + (0.5 if count == steps else 0.0)) / steps
        rest = np.broadcast_to(self.rest, (len(self),))[:, None]
        return np.where(np.isfinite(rest), rest, turn[None, :])

    def phases(self, i_dq):
        return phase_values(i_dq * np.exp(1j * self._turn(i_dq.shape[1])))

    def from_phases(self, abc):
        stator = space_vector(abc)
        return stator * np.exp(-1j * self._turn(abc.shape[1]))


def slow_view(recording: Recording, nominal, catalogue: dict | None = None) -> SlowView:
    """The operating points of a recording as blocks, similar ones next to each other.

    Raises RecordingError if signals are missing or no stretch is steady.
    """
    if not recording.slow:
        found = block_points(recording, nominal, catalogue)
    else:
        found = point_rows(recording, nominal) if recording.points else stretches(recording, nominal)
    return view_of_points(found, recording, nominal, catalogue)


def view_of_points(found: Stretches, recording, nominal, catalogue: dict | None = None) -> SlowView:
    """The same for given stretches."""
    if alone(found, nominal):  # all that it can show is its drift
        found = found.averaged(MOST_OF_ONE)
    torque = np.full(len(found), np.nan) if found.torque is None else found.torque
    steady, (order, dwell) = found.end - found.first, alike(found, nominal)
    count_rows(recording, steady.sum(), steady[order].sum())
    b, period = len(order), nominal.sample_time_s
    span = 0.0 if "time" in recording.lacks else float(recording["t"][-1] - recording["t"][0])
    recording.meta.setdefault("notes", []).extend(found.notes)
    shown = frozenset() if np.isfinite(torque).any() else frozenset({"torque"})
    lacks, course = LACKS | recording.lacks | shown, found.t[order] / max(span, 1e-9)
    if "time" in lacks and np.ptp(found.temp[order]) > BIN_TEMP_K:  # rows of a table from the coldest to the hottest
        lacks, course = lacks - {"time"}, (found.temp[order] - found.temp.min()) / np.ptp(found.temp)
    held = lambda x, n: np.repeat(np.asarray(x)[order, None], n, axis=1)  # noqa: E731
    i: Complex = held(found.i, ROWS + 1)
    omega = held(found.omega, ROWS + 1)
    least = NO_CURRENT * nominal.machine.rated_current_a
    known = np.where(np.abs(found.i.real).max() > least, i.real, 0.0)
    known = known + 1j * np.where(np.abs(found.i.imag).max() > least, i.imag, 0.0)
    turning = omega[:, :1] * period * (np.arange(-1, ROWS + 1) + 0.5)
    return SlowView(
        nominal=nominal,
        catalogue=catalogue or {},
        sample_time_s=period,
        theta=np.zeros((b, ROWS + 1)),
        omega=omega,
        i=known,
        i_raw=i,
        i_abc=None,
        u=held(found.u, ROWS + 2) * np.exp(1j * turning),
        u_dc=held(found.u_dc, ROWS),
        t=found.t[order],
        course=course,
        temp=found.temp[order],
        torque=held(torque, ROWS),
        slope_m=np.zeros((b, ROWS)),
        shaft=np.where(np.isfinite(torque[order]), "torque", ""),
        run=dwell,
        rows=found.first[order],
        span_s=span,
        unsteady=found.unsteady[order],
        rest=found.rest[order],
        d_known=np.full(b, found.both_axes),
        aged=np.zeros((b, 2), complex) if found.aged is None else found.aged[order],
        lacks=lacking(lacks, b),
    )


def alike(found: Stretches, nominal) -> tuple[np.ndarray, np.ndarray]:
    """(indices of the stretches to use, number of the operating point of each), sorted by operating point.

    A long operating point is reduced to MOST_ALIKE stretches spread over time, unless it is the only one.
    """
    steps = _steps(found, nominal)
    if alone(found, nominal):  # fixed bins would split some points
        return np.arange(len(found)), np.zeros(len(found), int)
    # A table may hold the same points at several temperatures, which differ by more than noise.
    warm = np.where(np.isfinite(found.temp), found.temp, 0.0) / BIN_TEMP_K
    steps = np.column_stack([steps, warm])
    _, point = np.unique(np.round(steps).astype(int), axis=0, return_inverse=True)
    order, dwell = [], []
    for number in np.unique(point):
        mine = np.flatnonzero(point.ravel() == number)
        if len(mine) > MOST_ALIKE:
            mine = mine[np.linspace(0, len(mine) - 1, MOST_ALIKE).round().astype(int)]
        order += mine.tolist()
        dwell += [int(number)] * len(mine)
    return np.array(order), np.array(dwell)


def alone(found: Stretches, nominal) -> bool:
    """Whether all stretches are at the same operating point."""
    steps = _steps(found, nominal)
    return bool((np.abs(steps - np.median(steps, axis=0)) < 1.0).all())


def _steps(found, nominal) -> np.ndarray:
    """(b, 3) operating points in units of the distance below which two are the same."""
    rated, top = nominal.machine.rated_current_a, max(float(np.abs(found.omega).max()), 1e-9)
    steps = (
        found.i.real / rated / BIN_CURRENT,
        found.i.imag / rated / BIN_CURRENT,
        found.omega / top / BIN_SPEED,
    )
    return np.stack(steps, axis=1)
