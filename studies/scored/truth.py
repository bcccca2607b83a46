# SPDX-License-Identifier: BSD-3-Clause
"""What is true of a recording, in the words of the diagnosis: causes with the intervals of their sizes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

JUDGES = ("right", "covering", "honest limit", "withheld", "wrong")
USEFUL = JUDGES[:3]


@dataclass(frozen=True)
class Cause:
    """One cause that a right answer accounts for.

    names: effects of the catalogue of which any one is this cause.
    sizes: {parameter: (low, high)}, SI units as in diagnosis.json; an effect that is named must have this size.
    may: effects that leave the same in this recording: right as alternatives, wrong if named alone.
    reading: regex over code and text of a convention or of a correction that is the cause in other words.
    may_read: the same for conventions that leave the same: right only beside the rivals that they have.
    words: regex of a headline that describes the cause without an effect of the catalogue.
    """

    names: tuple[str, ...] = ()
    sizes: dict[str, tuple[float, float]] = field(default_factory=dict)
    may: tuple[str, ...] = ()
    reading: str = ""
    may_read: str = ""
    words: str = ""


@dataclass(frozen=True)
class Truth:
    """All that is known of a recording; no cause: recording and drive file agree.

    beside: causes that are there, or cannot be excluded, and need not be named.
    readings: regex of conventions and corrections that are right and need not be told.
    limit: regex of a message that names the true reason why this recording cannot be diagnosed.
    never: regex of a headline or advice that is wrong whatever else the answer says.
    tells: regex that the sentence of an answer must match, as time, speed or unit had to be guessed.
    guess: regex of a note without which nothing was guessed after all.
    """

    causes: tuple[Cause, ...] = ()
    beside: tuple[Cause, ...] = ()
    readings: str = ""
    limit: str = ""
    never: str = ""
    tells: str = ""
    guess: str = ""
    text: str = ""

    def told(self) -> str:
        """The truth in one line: as written, else the causes."""
        return self.text or ", ".join("|".join(c.names) or c.reading or c.words for c in self.causes) or "agrees"


@dataclass(frozen=True)
class Case:
    """A recording, or several of one drive, with the truth.

    files: writes whatever must be made into a folder; returns (recordings, drive file); FileNotFoundError if absent.
    """

    name: str
    truth: Truth
    files: Callable[[Path], tuple[list[Path], Path]]
