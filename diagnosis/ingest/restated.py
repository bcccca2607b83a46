"""A drive file whose sample time or pole pairs are off by two: the recording is read again with the right ones.

These two decide how rows follow each other and what the angle is, so that nothing can be judged without them.  The
other keys of a drive file are judged with the balance (judge.py).
"""

from __future__ import annotations

import dataclasses

import numpy as np

from fluxproof.diagnosis.checks.balance import discriminates, misfit, rows_of
from fluxproof.diagnosis.quantities import ascii_of, quantity
from fluxproof.diagnosis.result import Convention

FITS = 0.02  # of the voltage: largest misfit of a recording that is read rightly, whatever effect the drive has
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


def alternatives(nominal) -> list[Restated]:
    """The drive file with its sample time or its pole pairs halved and doubled."""
    period, pairs = nominal.sample_time_s, nominal.machine.pole_pairs
    words = lambda s: ascii_of(quantity(s, "s"))  # noqa: E731
    out = [
        Restated(
            "control", "sample_time_s", period, period * f,
            f"the rows are {words(period * f)} apart, not {words(period)} as in the drive file",
        )
        for f in (0.5, 2.0)
    ]  # fmt: skip
    whole = [n for n in (pairs / 2, pairs * 2) if n == int(n)]
    says = "the machine has {} pole pairs, not {} as in the drive file"
    return out + [Restated("machine", "pole_pairs", pairs, int(n), says.format(int(n), pairs)) for n in whole]


def fits(recording, nominal) -> bool:
    """Whether a recording, as read with a drive file, is met by the nominal balance and would show another timing."""
    if recording.fatal or recording.slow or recording.points:
        return False
    rows = rows_of(recording, nominal)
    if rows is None or rows.steady or not discriminates(rows):
        return False
    turn = float(np.percentile(np.abs(rows.omega), 75)) * nominal.sample_time_s
    return turn > VISIBLE * FITS and misfit(rows) < FITS


def as_read(loaded, nominal):
    """The drive with the values that were needed to read the recordings."""
    restated = loaded[0].meta.get("restated") if loaded else None
    return restated.of(nominal) if restated else nominal
