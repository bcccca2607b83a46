# SPDX-License-Identifier: BSD-3-Clause
"""How well the nominal machine fits the recording, with or without a change to its columns (not itself a check).

For consecutive rows, with space vectors in the stator frame,

    r = u - R (i + i+) / 2 - [psi(i+, theta+) - psi(i, theta)] / T,    psi = (L_d i_d + j L_q i_q + psi_m) e^(j theta)

is small compared with u if the columns are interpreted correctly, whatever effect the drive has, and as large as u
for swapped phases, an angle in degrees or a speed of the wrong sign.  Only fast rows are used: at standstill every
interpretation fits.  Slow logs, operating points and logs with dq values only use the steady dq balance instead.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from fluxproof.diagnosis.conventions.exchanges import EXACT
from fluxproof.diagnosis.ground.arrays import Complex, Real
from fluxproof.diagnosis.ground.machine import flux_linkage, mean_emf, steady_voltage
from fluxproof.diagnosis.ground.nominal import Machine
from fluxproof.plant.transforms import space_vector

MOST_ROWS = 5000
FIT = 0.25  # misfit over voltage: any real effect is smaller at speed
FITS, FEW = 0.1, 0.01  # misfit over voltage of a row that fits; share of the rows that may speak against a change
BETTER = 0.3  # a change is accepted if the misfit falls below this share
LEAST_ROWS, LEAST_OF_TABLE = 20, 6  # fewer fit by chance with some change
LEAST_POINTS, SAME = 3, 0.1  # of dq values: operating points that are so far apart, of rated current and top speed


AnyRows = TypeVar("AnyRows", bound="_Intervals")


@dataclass(frozen=True)
class _Intervals:
    """Samples at both ends of m intervals of length ``period`` [s]: theta, omega (2, m)."""

    machine: Machine
    period: float
    theta: np.ndarray
    omega: np.ndarray

    def change(self: AnyRows, **columns) -> AnyRows:
        return replace(self, **columns)


@dataclass(frozen=True)
class FastRows(_Intervals):
    """i, d: (2, m, 3) phase currents [A] and (m, 3) duties in force; u_dc: (m,) [V].

    third: whether i_c was measured, and not computed from the other two.
    """

    i: Real
    d: Real
    u_dc: np.ndarray
    third: bool = True
    steady = False

    def with_currents(self, i: Real) -> FastRows:
        """The rows with other phase currents; one that was not measured follows from the other two."""
        if not self.third:
            i = np.stack([i[..., 0], i[..., 1], -i[..., 0] - i[..., 1]], axis=-1)
        return self.change(i=i)


@dataclass(frozen=True)
class SteadyRows(_Intervals):
    """dq: (2, m) complex dq current [A]; u_dq: (m,) complex voltage reference [V], d nan where not recorded."""

    dq: Complex
    u_dq: Complex
    steady = True


Rows = FastRows | SteadyRows


def rows_of(recording, nominal) -> Rows | None:
    """The intervals for the balance; None if columns or enough consecutive rows are missing."""
    columns, machine = recording.columns, nominal.machine
    delay = 0 if recording.slow else nominal.control.duty_applied_after_samples
    phases, duties = recording.has("i_a", "i_b"), recording.has("d_a", "d_b", "d_c", "u_dc")
    dq_only = recording.slow or not (phases and duties)
    needed = ("omega_e", "i_d", "i_q", "u_q_ref") if dq_only else ("omega_e", "theta_e")
    if not recording.has(*needed):
        return None
    k = np.flatnonzero(recording.usable) if recording.points else _intervals(recording, delay)
    if len(k) < (LEAST_OF_TABLE if recording.points else LEAST_ROWS):
        return None
    if dq_only and _points(columns["i_d"][k], columns["i_q"][k], columns["omega_e"][k], machine) < LEAST_POINTS:
        return None
    ends = np.stack([k, k if recording.points else k + 1])
    # The steady balance does not use the angle.
    theta = columns["theta_e"][ends] if "theta_e" in columns else np.zeros(ends.shape)
    common = machine, nominal.sample_time_s, theta, columns["omega_e"][ends]
    if dq_only:
        u_d = columns["u_d_ref"][k - delay] if "u_d_ref" in columns else np.nan
        dq = columns["i_d"][ends] + 1j * columns["i_q"][ends]
        return SteadyRows(*common, dq, u_d + 1j * columns["u_q_ref"][k - delay])
    i_c = columns.get("i_c", -columns["i_a"] - columns["i_b"])
    i = np.stack([columns["i_a"][ends], columns["i_b"][ends], i_c[ends]], axis=-1)
    d = np.stack([columns[name][k - delay] for name in ("d_a", "d_b", "d_c")], axis=-1)
    measured = bool(np.max(np.abs(i.sum(axis=-1))) > EXACT * np.max(np.abs(i)))
    return FastRows(*common, i, d, columns["u_dc"][k], measured)


def _points(i_d, i_q, omega, machine) -> int:
    """Number of operating points (n,) that differ."""
    scales = (machine.rated_current_a, machine.rated_current_a, max(float(np.abs(omega).max()), 1e-9))
    steps = [np.round(x / scale / SAME) for x, scale in zip((i_d, i_q, omega), scales, strict=True)]
    return len(np.unique(np.stack(steps), axis=1).T)


def misfit(rows: Rows, at_current: bool = False, at_d_current: bool = False) -> float:
    """Median misfit over median voltage of the rows with a large voltage; 0 is a perfect fit.

    at_current: use the rows with a large current instead, to check the current columns; at_d_current: of steady rows,
    those with a large d current.
    """
    left, u, i, at = _left(rows)
    by = np.abs(at) if at_current else np.abs(i.real if at_d_current else u)
    large = by >= np.percentile(by, 75 if at_current or at_d_current else 50)
    if not large.any():  # a column without a value
        return np.inf
    size = float(np.median(np.abs(u[large])))
    return float(np.median(np.abs(left[large]))) / size if size > 0 else np.inf


def contradicts(rows: Rows, changed: Rows) -> bool:
    """Whether some rows fit as recorded and do not fit with a change, which a median over all rows hides."""
    (left, u, *_), (left_changed, *_) = _left(rows), _left(changed)
    size = float(np.median(np.abs(u)))
    return bool(np.mean((np.abs(left) < FITS * size) & (np.abs(left_changed) > FIT * size)) > FEW)


def _left(rows: Rows):
    """(misfit, voltage) (m,) [V], real where only u_q is known, and currents (m,) in dq and as recorded [A]."""
    m = rows.machine
    if isinstance(rows, SteadyRows):
        i, omega = rows.dq.mean(axis=0), rows.omega.mean(axis=0)
        left: Complex = rows.u_dq - steady_voltage(m, i, omega)
        q_only = bool(np.isnan(rows.u_dq.real).any())
        return (left.imag, rows.u_dq.imag, i, i) if q_only else (left, rows.u_dq, i, i)
    i_s = space_vector(rows.i)
    turn = np.exp(1j * rows.theta)
    i = i_s * np.conj(turn)
    u = rows.u_dc * space_vector(rows.d)
    return u - m.resistance_ohm * i_s.mean(axis=0) - mean_emf(flux_linkage(m, i), turn, rows.period), u, i, i_s[0]


def discriminates(rows: Rows) -> bool:
    """Whether the balance can discriminate interpretations: the EMF is well above the resistive drop."""
    if isinstance(rows, SteadyRows):
        u = np.abs(np.where(np.isfinite(rows.u_dq), rows.u_dq, rows.u_dq.imag))
    else:
        u = np.abs(rows.u_dc * space_vector(rows.d))
    drop = rows.machine.resistance_ohm * rows.machine.rated_current_a
    return float(np.percentile(u, 75)) > max(1.5 * drop, 1.0)


def _intervals(recording, delay) -> np.ndarray:
    """First rows of at most MOST_ROWS usable intervals, spread over the recording."""
    good = recording.usable[:-1] & recording.usable[1:] & recording.joined[:-1]
    for back in range(1, delay + 1):
        good[back:] &= recording.joined[: len(good) - back]
    good[:delay] = False
    k = np.flatnonzero(good)
    return k[:: max(1, -(-len(k) // MOST_ROWS))]
