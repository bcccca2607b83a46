# SPDX-License-Identifier: BSD-3-Clause
"""A drive file whose sample time is off by two, or with wrong pole pairs: what decides how a recording is read.

These two say how rows follow each other and what the angle is, so that nothing can be judged without them: the
recording is read again with each (loading/reread.py).  The other keys of a drive file are judged with the balance.
"""

from __future__ import annotations

import dataclasses

from fluxproof.diagnosis.conventions.table import says_pole_pairs
from fluxproof.diagnosis.ground.quantities import ascii_of, quantity
from fluxproof.diagnosis.ground.result import Convention

AGREES = 0.02  # of the speed: how well angle and speed agree with the right pole pairs
WHOLE = 0.1  # how near to a whole number: of many pole pairs 2 % would meet some number always


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
    return out + [
        Restated("machine", "pole_pairs", pairs, n, says_pole_pairs(n, pairs)) for n in _pole_pairs(recording, pairs)
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


def as_read(loaded, nominal):
    """The drive with the values that were needed to read the recordings."""
    restated = loaded[0].meta.get("restated") if loaded else None
    return restated.of(nominal) if restated else nominal
