# SPDX-License-Identifier: BSD-3-Clause
"""Quasi-steady q-axis identification from a log without d axis: i_q, u_q and shaft speed, far slower than the control.

    u_q = R i_q + k_e (omega + tau_v d omega/dt) + v sgn(i_q) + L_q di_q/dt + u_0        electrical
    i_q = (J d omega/dt + B omega + T_c sgn(omega)) / k_t + i_0                           mechanical

omega is the shaft speed, tau_v the delay of the logged speed.  With i_d = 0 the magnet's k_e = p psi_m, and for peak
values and an amplitude-invariant transformation k_t = 1.5 k_e.  Both lines are linear; their uncertainty is that of a
block bootstrap (Kuensch, Annals of Statistics 17, 1989): neighbouring rows of a log are not independent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

DRAWS = 400
SLOPE_ROWS = 41  # of the local cubic for slopes
KNEE_A, KNEE_RAD_S = 0.02, 2.0  # width of the smoothed sign functions
HELD_OUT = 0.4  # share at the end of a log that is not fitted


@dataclass(frozen=True)
class QAxisLog:
    """Equally spaced rows (n,): time [s], shaft's angle [rad] and speed [rad/s], i_q [A], u_q [V]."""

    t: np.ndarray
    angle: np.ndarray
    omega: np.ndarray
    i_q: np.ndarray
    u_q: np.ndarray

    @property
    def step_s(self):
        return float(self.t[1] - self.t[0])

    def slope(self, values):
        """d/dt of a signal."""
        return savgol_filter(values, SLOPE_ROWS, 3, deriv=1, delta=self.step_s)

    def smooth(self, values):
        """A signal smoothed by the same filter."""
        return savgol_filter(values, SLOPE_ROWS, 3)


@dataclass
class Line:
    """A fitted linear model: {name: (value, standard deviation)}, rms misfit fitted and held out, collinearity."""

    parameters: dict[str, tuple[float, float]]
    train: float
    holdout: float
    collinearity: float  # 1 / smallest singular value of the scaled columns; above 20 two of them are collinear

    def __getitem__(self, name):
        return self.parameters[name][0]

    def sigma(self, name):
        return self.parameters[name][1]


def evenly(columns, step_s=1e-3) -> QAxisLog:
    """The log on equal steps; columns: {"Time", "Position", "Velocity", "Iq", "Uq"} arrays (n,)."""
    t = np.arange(columns["Time"][0], columns["Time"][-1], step_s)
    at = lambda name: np.interp(t, columns["Time"], columns[name])  # noqa: E731
    return QAxisLog(t, at("Position"), at("Velocity"), at("Iq"), at("Uq"))


def electrical(log: QAxisLog, resistance=None, more=()) -> Line:
    """The voltage line [V]; ``resistance`` [ohm]: known value, since it is collinear with the delay of the speed.

    more: further terms, of "inductance", "even_emf" (follows |omega|).
    """
    columns = {
        "k_e": log.omega,
        "k_e_tau": log.slope(log.omega),
        "v_loss": np.tanh(log.i_q / KNEE_A),
        "u_0": np.ones_like(log.omega),
    }
    optional = {"inductance": log.slope(log.i_q), "even_emf": np.abs(log.omega)}
    columns |= {name: optional[name] for name in more}
    if resistance is None:
        return fit(log.u_q, columns | {"resistance": log.i_q}, log.step_s)
    return fit(log.u_q - resistance * log.i_q, columns, log.step_s)


def mechanical(log: QAxisLog) -> Line:
    """The torque line in amperes: inertia, viscous and Coulomb friction over the torque constant, and an offset."""
    omega = log.smooth(log.omega)
    columns = {
        "inertia": log.slope(log.omega),
        "viscous": omega,
        "coulomb": np.tanh(omega / KNEE_RAD_S),
        "i_0": np.ones_like(omega),
    }
    return fit(log.i_q, columns, log.step_s)


def fit(y, columns: dict, step_s=None, block_s=0.5, groups=None) -> Line:
    """Least squares on the first part of the rows, verified on the last one; sigma by block bootstrap.

    groups: (n,) number of the block of each row; default: pieces of block_s.
    """
    a = np.stack(list(columns.values()), axis=1)
    if groups is None:
        groups = (np.arange(len(y)) * step_s // block_s).astype(int)
    names, blocks = np.unique(groups, return_inverse=True)
    train = blocks < (1.0 - HELD_OUT) * len(names)
    count = int(blocks[train].max()) + 1
    gram, right = np.zeros((count, a.shape[1], a.shape[1])), np.zeros((count, a.shape[1]))
    for k in range(count):
        rows = train & (blocks == k)
        gram[k], right[k] = a[rows].T @ a[rows], a[rows].T @ y[rows]
    values = np.linalg.solve(gram.sum(axis=0), right.sum(axis=0))
    drawn = np.random.default_rng(0).integers(0, count, (DRAWS, count))
    draws = np.array([np.linalg.solve(gram[d].sum(axis=0), right[d].sum(axis=0)) for d in drawn])
    scaled = a[train] / np.linalg.norm(a[train], axis=0)
    left = y - a @ values
    rms = lambda x: float(np.sqrt(np.mean(x**2)))  # noqa: E731
    parameters = {n: (float(v), float(s)) for n, v, s in zip(columns, values, draws.std(axis=0), strict=True)}
    return Line(
        parameters,
        rms(left[train]),
        rms(left[~train]),
        float(1.0 / np.linalg.svd(scaled, compute_uv=False)[-1]),
    )


def speed_delay(log: QAxisLog) -> Line:
    """Delay of the recorded speed relative to the recorded angle, whose slope is omega + tau d omega/dt."""
    chord = log.slope(log.angle) - log.smooth(log.omega)
    return fit(chord, {"tau": log.slope(log.omega), "offset": np.ones_like(chord)}, log.step_s)


def orders(angle, values, rising, most=150, block_rows=400) -> tuple[Line, np.ndarray]:
    """(constant and half the difference between both directions, amplitudes (most,) of orders 1 .. most per turn).

    angle: (n,) rad at which the shaft was held; rising: (n,) bool, approached from below.
    """
    n = np.arange(1, most + 1)
    waves = np.concatenate([np.cos(np.outer(angle, n)), np.sin(np.outer(angle, n))], axis=1)
    side = np.where(rising, 1.0, -1.0)
    full = np.column_stack([waves, np.ones(len(values)), side])
    c = np.linalg.lstsq(full, values, rcond=None)[0]
    left = values - waves @ c[: 2 * most]
    line = fit(
        left,
        {"offset": np.ones(len(values)), "direction": side},
        groups=mixed_blocks(len(values), block_rows),
    )
    return line, np.hypot(c[:most], c[most : 2 * most])


def mixed_blocks(n, rows):
    """Numbers of blocks of consecutive rows, such that fitted and held-out ones alternate over the log."""
    block = np.arange(n) // rows
    order = np.argsort(np.random.default_rng(1).permutation(block.max() + 1))
    return order[block]
