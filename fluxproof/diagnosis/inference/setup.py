# SPDX-License-Identifier: BSD-3-Clause
"""What all linear problems of a recording share: its rows, the error of their balance, and its operating points."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np

from fluxproof.diagnosis.balance.cells import repeats, voltage_level
from fluxproof.diagnosis.balance.operating_points import point_numbers
from fluxproof.diagnosis.effects import Drift
from fluxproof.diagnosis.ground import constants as k
from fluxproof.diagnosis.inference.linearise import Rows, at_once
from fluxproof.diagnosis.inference.model import Prior
from fluxproof.diagnosis.inference.points import Grouping, balance_level, visits

RESOLVED = 1e-6  # of the error of the balance: least noise of a row


class Setup:
    """What all problems of a recording share: its rows, the error of their balance, operating points.

    call: how the steps of the inference are run (see linearise.py).
    """

    def __init__(self, view, effects, train_blocks, call=at_once):
        """train_blocks: (b,) bool, blocks of the fit."""
        self._share(Rows(view, effects, train_blocks), call)

    @classmethod
    def of(cls, rows: Rows, call=at_once) -> Setup:
        """The setup of rows that are already known."""
        out = cls.__new__(cls)
        out._share(rows, call)
        return out

    def _share(self, rows, call):
        self.rows, self.call = rows, call
        self.view, self.effects, self.projector, self.load = rows.view, rows.effects, rows.projector, rows.load
        self.train, self.cells = rows.train, rows.cells
        self.smooth_rows = rows.smooth_rows
        self.level = balance_level(self.view, self.cells)
        # An axis without voltage and current, as at a locked rotor, leaves nothing, and would weigh without limit.
        self.noise = np.maximum(_bounded_noise(rows), RESOLVED * self.level)
        self.common = _common_error(self)
        self.points = point_numbers(self.view, k.POINT)
        self.visits = visits(self.view, self.points)
        self.grouping = Grouping(self.cells, self.points, self.visits, self.cells.ok & self.train, self.view.run)
        self.repeats = _repeats(self.cells, self.points)
        self.driven = is_driven(self)
        self.shifts = {}
        self.expected = {
            name for name, effect in self.effects.items() if isinstance(effect, Drift) and effect.expected(self.view)
        }

    @property
    def floor(self):
        """(r,) standard deviation of every row in a recording whose balance is as good as it can be."""
        return np.hypot(self.noise, self.view.least_error * self.level)

    @property
    def usual(self):
        """(r,) the same in a usual recording."""
        return np.hypot(self.noise, self.level)

    def prior(self, points) -> Prior:
        """What the constants say of every set of effects on these points."""
        always = k.ALWAYS_LOADED if points.loads >= 0 and not self.driven else 1.0
        return Prior(
            float(k.DISCREPANCY), float(k.STEEP), float(self.view.least_error), float(k.STRAIGHT), float(always)
        )

    def odds(self, name) -> float:
        """Log prior odds of an effect, zero (one to one) for one that is expected; a fleet may have shifted them."""
        usual = 0.0 if name in self.expected else np.log(k.PRESENT / (1 - k.PRESENT))
        return float(usual + self.shifts.get(name, 0.0))

    def read_like(self, other, volts, amps):
        """Reuse the operating points of the uncorrected setup ``other``, so that both are judged on the same blocks.

        volts, amps: factors of voltages and currents between the two; they scale the error of the balance too.
        """
        self.points, self.visits, self.shifts = other.points, other.visits, other.shifts
        self.grouping, self.repeats = other.grouping, other.repeats
        channel = self.cells.channel
        self.level = other.level * np.where(channel == "u", volts, np.where(channel == "sum", amps, 1.0))
        return self

    def smoothly(self, other, volts, amps):
        """A copy in which the interpretation changes the smooth signals only, as a measurement correction does.

        It keeps the noise of the uncorrected setup; otherwise a scaled current would be penalised for its scaled noise.
        """
        channel = self.cells.channel
        scale = np.where(channel == "u", volts, np.where(channel == "sum", amps, 1.0))
        out = copy.copy(self)
        out.noise = other.noise * scale
        y = other.cells.y * scale + self.smooth_rows - other.smooth_rows * scale
        out.cells = dataclasses.replace(self.cells, y=y)
        return out


def is_driven(setup) -> bool:
    """Whether a torque that nobody recorded drives the shaft at an operating point, which no friction does."""
    cells = setup.cells
    rows = np.flatnonzero((cells.channel == "torque") & (cells.order == 0) & cells.ok & setup.train)
    if not (setup.load and len(rows)):
        return False
    block = cells.block[rows]
    along = cells.y[rows] * np.sign(setup.view.omega.mean(axis=1))[block]
    count = np.bincount(setup.points[block])
    of_point = [np.bincount(setup.points[block], x) / np.maximum(count, 1) for x in (along, setup.usual[rows])]
    return bool((of_point[0] > k.DISCREPANCY * of_point[1]).any())


def _common_error(setup) -> np.ndarray:
    """(r, n) errors of the balance that all operating points have in common, each of the size of its prior."""
    return np.array([setup.projector.rows({"u": p}) for p in setup.view.common_errors()]).T


def _bounded_noise(rows):
    """(r,) noise of the rows; where no operating point repeats, it is what no effect explains, and bounded."""
    if repeats(rows.view, rows.cells.ok, rows.cells.block):
        return rows.noise
    most = k.UNREPEATED * voltage_level(rows.view)[rows.cells.block]
    return np.where(rows.cells.channel == "u", np.minimum(rows.noise, np.maximum(most, 1e-15)), rows.noise)


def _repeats(cells, points):
    """(r,) number of the functional and operating point of every row."""
    keys = np.stack([cells.order * 1e6, cells.part, points[cells.block], cells.channel == "u",
                     cells.channel == "sum"], axis=1).astype(np.int64)  # fmt: skip
    return np.unique(keys, axis=0, return_inverse=True)[1].ravel()


def repeated(ripple, setup):
    """(r,) the part of ripple rows that repeats in all blocks of an operating point, shrunk by what noise may be."""
    cells, cell = setup.cells, setup.repeats
    w = np.where(cells.ok, 1.0, 0.0)
    count = np.maximum(np.bincount(cell, w), 1.0)
    mean = np.bincount(cell, w * ripple) / count
    spread = np.bincount(cell, w * (ripple - mean[cell]) ** 2) / np.maximum(count - 1.0, 1.0) / count
    kept = np.maximum(1.0 - k.RIPPLE * spread / np.maximum(mean**2, 1e-300), 0.0) * (count > 2)
    return (kept * mean)[cell]
