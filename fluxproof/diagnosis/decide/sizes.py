# SPDX-License-Identifier: BSD-3-Clause
"""Sizes of the misfit before and after an explanation, per channel and order, on fitted and on held-out blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.ground.result import Fit, Remainder

UNITS = {"u": ("u_dq", "V"), "sum": ("current_sum", "A"), "torque": ("torque", "Nm")}


@dataclass(frozen=True)
class Size:
    """rms over blocks of one channel and order, or of all orders: misfit before and after, and the noise floor.

    usual: the misfit that any recording of this kind may have; above the floor where the log's own error is not known.
    """

    before: float
    after: float
    floor: float
    usual: float = 0.0

    @property
    def excess(self) -> float:
        return max(self.before**2 - self.floor**2, 0.0)

    @property
    def left(self) -> float:
        return max(self.after**2 - self.floor**2, 0.0)

    def floor_times(self, power) -> float:
        """The rms whose power exceeds that of the floor by ``power`` times."""
        return self.floor * (1.0 + power) ** 0.5

    def above(self, power) -> float:
        """The rms whose power exceeds that of a usual misfit by ``power`` times."""
        return max(self.floor, self.usual) * (1.0 + power) ** 0.5


class Sizes:
    """Sizes of a setup's misfit ``before`` and ``after`` (r,) in the blocks (b,) bool."""

    def __init__(self, setup, before, after, blocks, measured_torque):
        cells = setup.cells
        ok = cells.ok & blocks[cells.block]
        loads = (cells.channel == "torque") & (cells.order == 0) & (setup.load > 0.0)
        # Where the acceleration is that of the angle's codes, their resolution is not the shaft's.
        bends = (cells.channel == "torque") & (cells.order != 0) & setup.view.turns_freely[cells.block]
        ok &= ~loads & ~(bends & measured_torque)
        self.channels, self.orders = {}, {}
        count = max(int(blocks.sum()), 1)
        # A sum of the currents that ordinary sensors have is nothing that anybody would act on.
        least = np.where(cells.channel == "sum", k.RELEVANT_SUM * setup.view.machine.rated_current_a, 0.0)
        noise2 = setup.floor**2, np.maximum(setup.usual**2, least**2)
        for channel in np.unique(cells.channel):
            mine = ok & (cells.channel == channel)
            if mine.any() and (channel != "torque" or measured_torque):
                self.channels[str(channel)] = self._size(mine, before, after, noise2, count)
            for order in np.unique(np.abs(cells.order[mine])):
                self.orders[str(channel), float(order)] = self._size(
                    mine & (np.abs(cells.order) == order), before, after, noise2, count
                )

    @staticmethod
    def _size(rows, before, after, noise2, count):
        rms = lambda x2: float(np.sqrt(x2[rows].sum() / count))  # noqa: E731
        return Size(rms(before**2), rms(after**2), *map(rms, noise2))

    def primary(self) -> str:
        """The channel whose misfit is largest over its floor."""
        return max(
            self.channels, key=lambda c: self.channels[c].before / max(self.channels[c].floor, 1e-300), default="u"
        )

    def compared(self) -> str:
        """The channel in whose unit a fit is told: the voltage, or the torque where no voltage was recorded."""
        return "torque" if "torque" in self.channels and "u" not in self.channels else "u"

    def share(self, channel, orders=None) -> float | None:
        """Share of a channel's power above the floor that was explained, in some or all of its orders."""
        mine = [s for (c, h), s in self.orders.items() if c == channel and (orders is None or h in orders)]
        mine = [s for s in mine if max(s.before, s.after) > s.floor_times(k.VISIBLE)]
        excess, left = sum(s.excess for s in mine), sum(s.left for s in mine)
        return float(1.0 - left / excess) if excess > 0.0 else None

    def remainder(self) -> list[Remainder]:
        """What is left above the floor, per channel and order, the largest share first."""
        out = []
        for (channel, order), size in self.orders.items():
            if channel not in self.channels:
                continue
            whole = sum(s.excess for (c, _), s in self.orders.items() if c == channel)
            share = size.left / whole if whole > 0.0 else 0.0
            if size.after > size.above(k.VISIBLE) and share >= k.LISTED:
                signal, unit = UNITS[channel]
                out.append(Remainder(signal, round(order, 4), float(np.sqrt(size.left)), unit, float(share)))
        return sorted(out, key=lambda r: -r.share)


def measured_torque(setup) -> bool:
    """Whether a transducer measures it; otherwise it follows from the angle, whose resolution is not the shaft's."""
    return setup.load == 0.0


def left_by(fit, effects) -> np.ndarray:
    """(r,) the misfit without what some effects of a fit explain; without any, as it was recorded."""
    return fit.left(effects) if effects else fit.problem.setup.cells.y


def fit_of(train: Sizes, held: Sizes) -> Fit:
    """The misfit of the voltage, or of the torque where none was recorded, on fitted and on held-out blocks."""
    channel = train.compared()
    a, b = (sizes.channels.get(channel, Size(0, 0, 0)) for sizes in (train, held))
    return Fit(*UNITS[channel], a.before, a.after, b.before, b.after, a.floor)


def with_stray(remainder, stray, train) -> list[Remainder]:
    """The remainder with a misfit outside the orders of the balance, in place of a smaller one of its own order."""
    channel, signal = ("torque", "torque") if stray.kind == "torque" else ("u", "u_dq")
    whole = train.channels[channel].before if channel in train.channels else stray.size
    share = float(min((stray.size / max(whole, 1e-12)) ** 2, 1.0))
    found = Remainder(signal, stray.order, stray.size, stray.size_unit, share)
    same = lambda r: r.signal == signal and abs(r.order) == abs(found.order) and stray.kind == "order"  # noqa: E731
    rest = [r for r in remainder if not same(r)]
    return sorted([found, *rest], key=lambda r: -r.share)
