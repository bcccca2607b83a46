# SPDX-License-Identifier: BSD-3-Clause
"""Stretches of a slow log that is hardly ever steady: a throttle run, a gait, an acceleration.

The balance holds for means over any stretch, not only for steady ones:

    mean u = R mean i + (L i_end - L i_begin) / T + mean of j omega lambda

What the nominal drive has beyond the voltage at the mean current and speed (the inductive term and the products of
what changes together) is taken from the recorded voltage, so that a stretch is an operating point as a steady one.

The columns of a row are of different age, and the voltage changes while one is waited for.  The log itself shows the
ages: an age leaves a misfit proportional to the derivative of the nominal voltage by that column, times the column's
rate of change, which no constant of the machine does.  Both are fitted to all rows together; the columns are shifted.
What the fit leaves open of the ages is an error that all stretches have in common (``aged``): in a throttle run with
a load that follows the speed, an age of the speed looks like a resistance with less flux.

This needs a new value in every row: a log of messages that are held does not show what happened between them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.arrays import Complex
from fluxproof.diagnosis.ground.machine import flux_linkage, flux_of_current, steady_voltage

LEAST_ROWS = 4  # of a stretch
FIT_ROWS = 100  # rows that a fit of ages and constants needs
SWEEP = 0.25  # of rated current: largest change within a stretch
SWING = 0.15  # of the largest voltage: largest change of the nominal voltage within a stretch
ONE_WAY = 2.0  # least mean current relative to its change: inverter loss and friction have a step where it reverses
STANDS = 0.02  # of rated current: a smaller change is noise
LARGEST = 2.0  # rows: an age beyond is another fault
ROUNDS = 3  # fits, each on shifted columns
OUTLIER = 3.0  # times the rms: rows left out of the next fit
LEFT_ROWS = 0.2  # rows whose change counts as unsteady beside the ages: what the rows do not show of a smooth change
SIGMAS = 2.0  # of an age: neighbouring rows have much of their error in common
ENDS = 2.0  # weight of the change of slope: error of a mean of samples, a twelfth of it per row, over SLOW_CHANGE


@dataclass(frozen=True)
class Ages:
    """How much older current and speed are than the voltage of the same row, with their sigmas [s]."""

    current: float
    speed: float
    sigmas: tuple[float, float] = (np.inf, np.inf)


@dataclass(frozen=True)
class Moving:
    """A log whose columns are of one instant.  All (n,): time [s], dq current [A], dq voltage [V], speed [rad/s],
    nominal voltage with its inductive term [V], number of the run without gap; aged: (n, 2) change of the voltage for
    an age of current and speed of a second [V/s]; step: usual time between rows [s]."""

    t: np.ndarray
    i: Complex
    u: Complex
    omega: np.ndarray
    nominal_u: Complex
    run: np.ndarray
    aged: Complex
    step: float
    ages: Ages

    def doubt(self) -> np.ndarray:
        """(2,) what the ages of current and speed may be wrong by [s]."""
        return np.maximum(SIGMAS * np.array(self.ages.sigmas), k.SLOW_CHANGE * self.step)

    def note(self) -> str:
        """What was done, for the user."""
        ages = (("current", self.ages.current), ("speed", self.ages.speed))
        late = [f"{name} {1e3 * age:+.2g} ms" for name, age in ages]
        return (
            "The recording is seldom steady: means over moving stretches are compared, with the inductive term; age of "
            f"the columns against the voltage, from the log itself: {', '.join(late)}."
        )


def moving_log(t, i, u, omega, good, machine, both_axes) -> Moving | None:
    """The aligned log; None if its rows do not determine the ages of its columns.

    good: (n,) bool, rows that may be used; both_axes: whether u_d was recorded.
    """
    step = float(np.median(np.diff(t)))
    breaks = (np.diff(t) > 1.5 * step) | ~good[1:] | ~good[:-1]
    run = np.append(0, np.cumsum(breaks))
    ages, at = Ages(0.0, 0.0), (i, omega)
    for _ in range(ROUNDS):
        fit = _ages(t, *at, u, run, machine, both_axes)
        if fit is None:
            return None
        ages = Ages(ages.current + fit.current, ages.speed + fit.speed, fit.sigmas)
        if max(abs(ages.current), abs(ages.speed)) > LARGEST * step:
            return None
        at = _shifted(t, i, run, ages.current), _shifted(t, omega, run, ages.speed)
    nominal_u, aged, inductive = _moving_terms(machine, t, *at, run)
    return Moving(t, at[0], u, at[1], nominal_u + inductive, run, np.stack(aged, axis=1), step, ages)


def _moving_terms(machine, t, i, omega, run):
    """(steady voltage (n,) [V], its changes for an age of current and speed of a second [V/s], inductive part [V])."""
    rate_i, rate_w = _rate(t, i, run), _rate(t, omega, run)
    inductive = flux_of_current(rate_i, machine.inductance_d_h, machine.inductance_q_h)
    by_current = machine.resistance_ohm * rate_i + 1j * omega * inductive
    return steady_voltage(machine, i, omega), (by_current, 1j * flux_linkage(machine, i) * rate_w), inductive


def _rate(t, x, run):
    """Derivative (n,) of a column, nan at the ends of a run."""
    out = np.full(len(x), np.nan, x.dtype)
    inner = np.flatnonzero(run[2:] == run[:-2]) + 1
    out[inner] = (x[inner + 1] - x[inner - 1]) / (t[inner + 1] - t[inner - 1])
    return out


def _shifted(t, x, run, age) -> Any:
    """The column (n,) at the instants of the voltage, nan where a run does not reach them."""
    out = np.full(len(x), np.nan, x.dtype)
    edges = np.flatnonzero(np.diff(run)) + 1
    for rows in np.split(np.arange(len(x)), edges):
        if len(rows) > LEAST_ROWS:
            wanted = t[rows] + age
            inside = (wanted >= t[rows[0]]) & (wanted <= t[rows[-1]])
            out[rows[inside]] = np.interp(wanted[inside], t[rows], x[rows])
    return out


def _ages(t, i: Complex, omega, u, run, machine, both_axes) -> Ages | None:
    """Ages beside errors of the constants, least squares over all rows; None if there are too few."""
    nominal_u, aged, inductive = _moving_terms(machine, t, i, omega, run)
    turning = 1j * omega + 0.0 * i
    constants = (
        i, turning, turning * i.real, 1j * turning * i.imag, turning * nominal_u, turning**2 * nominal_u,
        omega * turning, i / np.fmax(np.abs(i), 1e-9), inductive,
    )  # fmt: skip
    columns = (*aged, *constants)
    rows = np.array(np.isfinite(np.stack([*columns, u, nominal_u])).all(axis=0))
    if rows.sum() < FIT_ROWS:
        return None
    y = u - nominal_u - inductive
    _, _, left = _least_squares(columns, y, rows, both_axes)
    far = np.abs(left) > OUTLIER * np.sqrt(np.mean(left**2))
    rows[np.flatnonzero(rows)[far.reshape(-1, rows.sum()).any(axis=0)]] = False
    c, sigma, _ = _least_squares(columns, y, rows, both_axes)
    return Ages(float(c[0]), float(c[1]), (float(sigma[0]), float(sigma[1])))


def _least_squares(columns, y, rows, both_axes):
    """(coefficients, sigmas, residuals of the d and q axis one after the other, or of the q axis)."""
    a, y = np.stack(columns, axis=1)[rows], y[rows]
    a, y = (np.concatenate([np.real(x), np.imag(x)]) if both_axes else np.imag(x) for x in (a, y))
    scale = np.maximum(np.sqrt((a**2).mean(axis=0)), 1e-30)
    a = a / scale
    inverse = np.linalg.pinv(a.T @ a, rcond=1e-12)
    c = inverse @ (a.T @ y)
    left = y - a @ c
    sigma = np.sqrt(np.mean(left**2) * np.maximum(np.diag(inverse), 0.0))
    return c / scale, sigma / scale, left


def moving_stretches(log: Moving, least_s, turns, rated, top_u) -> list[tuple[int, int, float]]:
    """[(first row, end, change of the voltage per row [V])] of at least ``least_s`` [s], without overlap.

    turns: electrical turns of a stretch; rated: current [A]; top_u: largest voltage [V].
    """
    count = max(LEAST_ROWS, int(np.ceil(least_s / log.step)) + 1)
    good = np.isfinite(log.nominal_u) & np.isfinite(log.u)
    bad = np.cumsum(np.append(0, ~good))
    found, at = [], 0
    while at + count <= len(log.t):
        rows = slice(at, at + count)
        whole = bad[at + count] == bad[at] and log.run[at] == log.run[at + count - 1]
        if not whole or not _fits(log, rows, turns, rated, top_u):
            at += 1
            continue
        nominal_u = log.nominal_u[rows]
        steps = np.diff(nominal_u)
        drift, bend = LEFT_ROWS * abs(nominal_u[-1] - nominal_u[0]), ENDS * abs(steps[-1] - steps[0])
        found.append((at, at + count, float((drift + bend) / count)))
        at += count
    return found


def _fits(log, rows, turns, rated, top_u) -> bool:
    i, omega, u = log.i[rows], log.omega[rows], log.nominal_u[rows]
    span = log.t[rows.stop - 1] - log.t[rows.start]
    sweep = max(np.ptp(i.real), np.ptp(i.imag))
    return bool(
        np.abs(omega).min() * span > 2 * np.pi * turns
        and sweep < SWEEP * rated
        and (sweep < STANDS * rated or np.abs(i.mean()) > ONE_WAY * sweep)
        and max(np.ptp(u.real), np.ptp(u.imag)) < SWING * top_u
    )
