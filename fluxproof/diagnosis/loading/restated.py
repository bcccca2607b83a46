# SPDX-License-Identifier: BSD-3-Clause
"""A drive file whose sample time is off by two, or with wrong pole pairs: the recording is read again with the right
ones.

These two decide how rows follow each other and what the angle is, so that nothing can be judged without them.  The
other keys of a drive file are judged with the balance (judge.py).

With duties the balance needs the angle alone, which the pole pairs do not change if it is electrical: they are told
only where angle and speed agree with them and disagreed before.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from fluxproof.diagnosis.checks.agreement import angle_speed_ratio
from fluxproof.diagnosis.checks.balance import FIT, discriminates, misfit, rows_of
from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.ground.result import Convention

FITS = 0.02  # of the voltage: largest misfit of a recording that is read rightly, whatever effect the drive has
AGREES = 0.02  # of the speed: how well angle and speed agree with the right pole pairs
WHOLE = 0.1  # how near to a whole number: of many pole pairs 2 % would meet some number always
VISIBLE = 3.0  # times FITS: what one sample time of delay must change, in rad, to be noticed
CODES = ("sample_time", "angle_speed", "no_fit", "slow_sampling")


@dataclasses.dataclass(frozen=True)
class Restated:
    """A drive file with another value of one key."""

    section: str
    key: str
    stated: float
    value: float
    says: str
    speed: float = 1.0  # as of a Reading: the recording was read again, with the right speed

    def of(self, nominal):
        """The drive with the other value."""
        section = dataclasses.replace(getattr(nominal, self.section), **{self.key: self.value})
        return dataclasses.replace(nominal, **{self.section: section})

    def keys(self, nominal) -> list[tuple[str, str, float]]:
        """[(section, key, value)] of the drive file that it changes."""
        return [(self.section, self.key, self.value)]

    def columns(self) -> dict:
        return {}

    def told(self) -> Convention:
        return Convention(self.key, f"{self.section}.{self.key}", self.stated / self.value, self.says)


def doubtful(recording) -> bool:
    """Whether the checks found what a wrong sample time or wrong pole pairs cause."""
    return any(p.code in CODES for p in recording.problems) and not recording.points


def alternatives(recording, nominal) -> list[Restated]:
    """The drive file with half and twice its sample time, and with the pole pairs that angle and speed suggest."""
    period, pairs = nominal.sample_time_s, nominal.machine.pole_pairs
    words = lambda s: ascii_of(quantity(s, "s"))  # noqa: E731
    out = [
        Restated(
            "control", "sample_time_s", period, period * f,
            f"the rows are {words(period * f)} apart, not {words(period)} as in the drive file",
        )
        for f in (0.5, 2.0)
    ]  # fmt: skip
    says = "the machine has {} pole pair{}, not {} as in the drive file"
    return out + [
        Restated("machine", "pole_pairs", pairs, n, says.format(n, "s" * (n != 1), pairs))
        for n in _pole_pairs(recording, pairs)
    ]


def _pole_pairs(recording, pairs) -> list[int]:
    """Numbers of pole pairs with which angle and speed could agree."""
    ratio = abs(recording.meta.get("angle_speed", 0.0))
    if not ratio:  # poles in place of pole pairs, or half of them
        wanted = (pairs / 2, pairs * 2)
    else:  # a speed of the shaft, an angle of the shaft, and one that nobody said to be of the shaft
        wanted = (pairs * ratio, pairs / ratio, 1.0 / ratio)
    whole = dict.fromkeys(round(n) for n in wanted if abs(n - round(n)) <= min(AGREES * n, WHOLE))
    return [n for n in whole if n not in (0, pairs)]


def fits(recording, nominal, restated) -> bool:
    """Whether a recording, as read with a restated drive file, is met by it and would show another reading."""
    if recording.fatal or recording.slow or recording.points:
        return False
    rows = rows_of(recording, nominal)
    if rows is not None and (rows.steady or not discriminates(rows)):
        rows = None  # it does not tell readings apart
    if restated.key == "pole_pairs":
        ratio = angle_speed_ratio(recording, nominal.sample_time_s)
        if "angle_speed" in recording.meta or ratio is None or abs(ratio - 1.0) > AGREES:
            return False
        # The angle of an EMF run is that of its voltages; else any effect may be left, as the ratio is the evidence.
        return "inverter" in recording.lacks or (rows is not None and misfit(rows) < FIT)
    if rows is None:
        return False
    turn = float(np.percentile(np.abs(rows.omega), 75)) * nominal.sample_time_s
    return turn > VISIBLE * FITS and misfit(rows) < FITS


def as_read(loaded, nominal):
    """The drive with the values that were needed to read the recordings."""
    restated = loaded[0].meta.get("restated") if loaded else None
    return restated.of(nominal) if restated else nominal
