# SPDX-License-Identifier: BSD-3-Clause
"""From rows to cells: the misfit and every effect's column as harmonics of a block.

The same linear functional, mean(x exp(-j h theta)), is applied to the misfit and to every column, so that the
balance holds exactly between them, with or without whole turns.  White noise of the current enters the balance as a
difference and nearly vanishes in the mean, so that the weight of a cell is estimated from the differences between
neighbouring blocks of a dwell.  A second variance, proportional to the voltage squared, covers the error of the
balance itself: ripple, sampling of the bus, the trapezoidal mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.balance.misfit import misfit
from fluxproof.diagnosis.balance.quantised_angle import beat_variance
from fluxproof.diagnosis.balance.shaft import bend_gain
from fluxproof.diagnosis.balance.torque_order import torque_orders
from fluxproof.diagnosis.effects.free_curve import free_columns

ORDERS_SUM = (0.0, 1.0, 2.0)
LEAST_TURNS = 0.8  # periods of a harmonic within a block; with fewer it is not independent of order 0
TAPERED_TURNS = 3.0  # the same with a taper, which has more leakage from neighbouring orders
RESOLVED = 2.5  # rad per sampling period: a torque of a higher frequency appears at other orders


def orders_u(pole_pairs: int) -> tuple[float, ...]:
    """Harmonic orders in dq at which a misfit is evaluated, per electrical turn."""
    mechanical = [n / pole_pairs for n in (1, 2, 3)]
    both = sorted({round(h, 9) for h in [*mechanical, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 12.0, 18.0]})
    return (0.0, *both, *(-h for h in both))


@dataclass
class Cells:
    """Rows of a weighted least-squares problem; every row is the real or imaginary part of one functional.

    y: (r,) misfit; columns: {effect: {coefficient: (r,)}}; block, order, part: (r,) origin of a row, part 0 and 1
    for d and q; channel: (r,) "u", "sum" or "torque"; ok: (r,) bool, rows that are used.
    electrical: effects whose formula acts on the voltage; free: (effect, coefficient) of the free columns.
    """

    y: np.ndarray
    columns: dict[str, dict[str, np.ndarray]]
    block: np.ndarray
    order: np.ndarray
    part: np.ndarray
    channel: np.ndarray
    ok: np.ndarray
    electrical: frozenset[str] = frozenset()
    free: frozenset[tuple] = frozenset()


class Projector:
    """The functionals of one view, computed once and used for the misfit and for every column.

    Views of the same blocks with corrected angles or currents share them: any functional is valid if it is the same
    on both sides of the balance.
    """

    def __init__(self, view, loads=False):
        """loads: whether the mean torque of a shaft with an unknown load is a row."""
        self.orders = np.array(orders_u(view.machine.pole_pairs))
        self.turns = np.exp(-1j * self.orders[None, None, :] * view.theta_mid[:, :, None])
        b, h = len(view), len(self.orders)
        channels = ["u"] * (b * h * 2)
        block = [np.repeat(np.arange(b), h * 2)]
        order = [np.tile(np.repeat(self.orders, 2), b)]
        part = [np.tile([0, 1], b * h)]
        span = np.abs(view.theta[:, -1] - view.theta[:, 0])
        seen = np.abs(self.orders)[None, :] * span[:, None] >= 2 * np.pi * LEAST_TURNS
        seen &= view.locked[:, None]
        seen[:, 0] = True
        # Two orders closer than a turn within the block are one functional and must not count twice.
        kept = self._apart(span)
        both = np.repeat((seen & kept)[:, :, None], 2, axis=2)
        both[:, :, 0] &= np.broadcast_to(getattr(view, "d_known", True), (b,))[:, None]
        both &= view.has_voltage[:, None, None]
        ok = [both.ravel()]
        self.torque_seen = np.isfinite(view.torque).all(axis=1)
        self.real = {}
        if view.has_sum:
            self.real["sum"] = ORDERS_SUM
        if self.torque_seen.any():
            self.real["torque"] = (0.0, *torque_orders(view))
        for channel, orders in self.real.items():
            n = len(orders)
            channels += [channel] * (b * n * 2)
            block.append(np.repeat(np.arange(b), n * 2))
            order.append(np.tile(np.repeat(orders, 2), b))
            part.append(np.tile([0, 1], b * n))
            least = TAPERED_TURNS if channel == "torque" else LEAST_TURNS
            enough = np.array(orders)[None, :] * span[:, None] >= 2 * np.pi * least
            both = np.stack([enough, enough], axis=2)
            both[:, 0] = [True, False]  # a mean is real
            if channel == "torque":
                both &= self.torque_seen[:, None, None]
                per_row = span / view.theta_mid.shape[1]
                both &= (np.array(orders)[None, :] * per_row[:, None] < RESOLVED)[:, :, None]
                both[:, 0] &= (view.shaft != "free")[:, None] | loads  # a load of unknown size
            ok.append(both.ravel())
        self.block, self.order, self.part = (np.concatenate(x) for x in (block, order, part))
        self.channel, self.ok = np.array(channels), np.concatenate(ok)
        self.waves = {
            channel: np.exp(-1j * np.array(orders)[None, None, :] * view.theta_mid[:, :, None])
            for channel, orders in self.real.items()
        }
        if "torque" in self.waves:  # a taper, since the ends of a second difference are mostly noise
            m = view.theta_mid.shape[1]
            self.waves["torque"] *= (1.0 - np.cos(2 * np.pi * (np.arange(m) + 0.5) / m))[None, :, None]
            # An unknown mean load leaks into other orders, also by aliasing: these see what is left of a line.
            line = np.stack([np.ones(m), np.linspace(-1.0, 1.0, m)], axis=1)
            line, _ = np.linalg.qr(line)
            waves = self.waves["torque"][:, :, 1:]
            self.waves["torque"][:, :, 1:] = waves - np.matmul(line, np.matmul(line.T, waves))

    def _apart(self, span):
        """(b, h) orders that differ from every kept smaller one by LEAST_TURNS within the block."""
        kept = np.zeros((len(span), len(self.orders)), bool)
        for k, turns in enumerate(span / (2 * np.pi)):
            chosen = []
            for n in np.argsort(np.abs(self.orders), kind="stable"):
                if all(abs(self.orders[n] - c) * turns >= LEAST_TURNS for c in chosen):
                    chosen.append(self.orders[n])
                    kept[k, n] = True
        return kept

    def rows(self, column) -> np.ndarray:
        """A misfit or column, {channel: array}, as rows (r,); a missing channel is zero."""
        return self.all_rows([column])[0]

    def all_rows(self, columns) -> np.ndarray:
        """(k, r) rows of k columns; together, as the functionals of a block are then read from memory once."""
        b, out = self.turns.shape[0], [np.zeros((len(columns), 0))]
        for channel, waves in {"u": self.turns, **self.waves}.items():
            mine = [n for n, column in enumerate(columns) if column.get(channel) is not None]
            rows = np.zeros((len(columns), b, waves.shape[2], 2))
            if mine:
                x = np.stack([columns[n][channel] for n in mine], axis=1)
                # Of a real column, real and imaginary part of a wave are functionals of their own.
                f = np.matmul(x, waves if np.iscomplexobj(x) else waves.view(float)) / x.shape[2]
                rows[mine] = f.view(float).reshape(*f.shape[:2], -1, 2).swapaxes(0, 1)
            out.append(rows.reshape(len(columns), 2 * b * waves.shape[2]))
        return np.nan_to_num(np.concatenate(out, axis=1))


def cells_of(view, effects, projector=None) -> Cells:
    """Cells of a view with the columns of the effects.

    projector: that of a view of the same blocks, or None.
    """
    p = projector or Projector(view)
    columns, electrical, free = columns_of(view, effects, p)
    return Cells(p.rows(misfit(view)), columns, p.block, p.order, p.part, p.channel, p.ok, electrical, free)


def columns_of(view, effects, projector) -> tuple[dict[str, dict], frozenset[str], frozenset[tuple]]:
    """(columns {effect: {coefficient: (r,)}}, electrical, free) as in Cells."""
    raw, shown, electrical, free = {}, {}, set(), set()
    for effect in effects:
        shown[effect.name] = view.shows(effect)[projector.block]
        core = effect.core(view)
        if any("u" in column for column in core.values()):
            electrical.add(effect.name)
        raw |= {(effect.name, key): column for key, column in core.items()}
        further = {(effect.name, key): column for key, column in free_columns(effect, view).items()}
        free |= further.keys()
        raw |= further
    columns = {name: {} for name in shown}
    for (name, key), column in zip(raw, projector.all_rows(list(raw.values())), strict=True):
        columns[name][key] = column * shown[name]
    return columns, frozenset(electrical), frozenset(free)


def voltage_level(view):
    """Magnitude of the mean voltage vector of each block, (b,) [V]."""
    return np.abs(view.to_dq(view.u[:, 1:-1]).mean(axis=1))


def voltage_rms(view) -> float:
    """rms of ``voltage_level`` over all blocks [V]."""
    return float(np.sqrt(np.mean(voltage_level(view) ** 2)))


LEAST_PAIRS = 8  # neighbours in a dwell; the differences of fewer do not tell the noise


def repeats(view, ok, block) -> bool:
    """Whether operating points repeat often enough to see their noise; ok, block: (r,) of the rows."""
    known = np.zeros(len(view), bool)
    known[block[ok]] = True
    return int(np.sum((np.diff(view.run) == 0) & known[1:] & known[:-1])) >= LEAST_PAIRS


def noise(view, cells, residual) -> np.ndarray:
    """Standard deviation of every row (r,), from the differences of ``residual`` between neighbours in a dwell.

    Neighbours share the operating point, so that their difference is noise whatever the physics.  The variance of
    each order and part is fitted as a + b omega^2, since current noise enters with L / T and with omega L; with an
    acceleration from the codes, it is fitted as a + b g^2, g being the gain of their second difference.  Encoder codes
    add noise at some speeds only (quantised_angle.py).
    """
    omega = np.abs(view.omega.mean(axis=1))
    top = max(float(omega.max()), 1e-9)
    share = omega / top
    pair = np.flatnonzero(np.diff(view.run) == 0)
    out = np.full(len(cells.y), np.nan)
    for channel in np.unique(cells.channel):
        mine = cells.channel == channel
        bends = channel == "torque" and view.turns_freely.any()
        for order in np.unique(cells.order[mine]):
            grows = bend_gain(view, order) ** 2 if bends and order else share ** (4 if channel == "torque" else 2)
            shape = np.stack([np.ones(len(view)), grows], axis=1)
            for part in (0, 1):
                rows = np.flatnonzero(mine & (cells.order == order) & (cells.part == part))
                if len(rows):
                    variance = _steep_variance if bends and order else _variance
                    out[rows] = np.sqrt(variance(residual[rows], cells.ok[rows], pair, shape))
    for channel in {"u", "torque"} & set(cells.channel):
        mine = cells.channel == channel
        orders, which = np.unique(cells.order[mine], return_inverse=True)
        out[mine] = np.sqrt(out[mine] ** 2 + beat_variance(view, channel, orders)[cells.block[mine], which])
    return out


OUTLIER = 12.0  # times the median of the squares at a speed: a larger one is no noise


def _variance(e, ok, pair, shape):
    """Variance a + b omega^2 of the blocks from differences of neighbours, or from all values if there are few."""
    both = pair[ok[pair] & ok[pair + 1]]
    if len(both) >= LEAST_PAIRS:
        squares, where = 0.5 * (e[both + 1] - e[both]) ** 2, 0.5 * (shape[both] + shape[both + 1])
    else:
        squares, where = e[ok] ** 2, shape[ok]
    if not len(squares):
        return np.full(len(e), 1e-30)
    low = where[:, 1] <= np.median(where[:, 1])
    grows = len(squares) >= 24 and where[~low, 1].mean() > where[low, 1].mean() + 0.1 if (~low).any() else False
    if not grows:
        return np.full(len(e), max(np.minimum(squares, OUTLIER * np.median(squares)).mean(), 1e-30))
    halves = [where[half, 1].mean() for half in (low, ~low)]
    medians = [np.median(squares[half]) for half in (low, ~low)]
    usual = medians[0] + np.diff(medians) / np.diff(halves) * (where[:, 1] - halves[0])
    squares = np.minimum(squares, OUTLIER * np.maximum(usual, min(medians)))
    v0, v1 = (squares[half].mean() for half in (low, ~low))
    b = max((v1 - v0) / (halves[1] - halves[0]), 0.0)
    a = v0 - b * halves[0]
    if a < 0.05 * squares.mean():
        a, b = 0.05 * squares.mean(), 0.95 * squares.mean() / where[:, 1].mean()
    return np.maximum(a + b * shape[:, 1], 1e-30)


STEPS = 30  # of the iteration; it changes by less than 1 % before


def _steep_variance(e, ok, pair, shape):
    """Variance a + b shape of the blocks where b may be nearly all of it, as of a second difference at low speed.

    The differences' squares have about an exponential distribution, of which a and b are the most likely ones.
    """
    both = pair[ok[pair] & ok[pair + 1]]
    if len(both) < LEAST_PAIRS:
        return _variance(e, ok, pair, shape)
    squares, where = 0.5 * (e[both + 1] - e[both]) ** 2, 0.5 * (shape[both] + shape[both + 1])
    share = np.maximum(squares.mean() / where.mean(axis=0), 1e-30) * 0.5
    for _ in range(STEPS):  # each part takes its share of the squares (expectation-maximisation)
        parts = where * share
        v = parts.sum(axis=1)
        usual = np.minimum(squares / v, OUTLIER * np.median(squares / v))
        share = share * (where * (usual / v)[:, None]).sum(axis=0) / (where / v[:, None]).sum(axis=0)
    return np.maximum(shape @ share, 1e-30)
