# SPDX-License-Identifier: BSD-3-Clause
"""How a key of drive.toml is declared: type, unit and allowed range, written once at the dataclass field.

A section of the file is a frozen dataclass whose fields are made with the functions below; drive_file
reads any such dataclass and writes the error messages, so that a new key is one line in drive.py.
"""

import dataclasses
import math
from dataclasses import MISSING, dataclass
from typing import TypeVar

T = TypeVar("T")

# Unit: (least of a positive value, largest magnitude).  From a vibration motor of 1 g (mA, mohm to kohm, 1e-10 kg m2)
# and a telescope that turns once a day to a generator of 50 MW (100 kA, 30 kV, 1e7 kg m2), with two or three decades to
# spare on each side: what lies beyond is a typing error or a wrong unit, and would overflow a format or a division.
RANGES = {
    "1": (1e-12, 1e6),
    "A": (1e-6, 1e6),
    "V": (1e-6, 1e6),
    "ohm": (1e-7, 1e6),
    "H": (1e-9, 1e4),
    "F": (1e-9, 1e4),
    "Wb": (1e-9, 1e5),
    "rad/s": (1e-6, 1e6),
    "rad/s2": (1e-6, 1e9),
    "rad/s3": (1e-6, 1e15),
    "kg m2": (1e-15, 1e10),
    "Nm s": (1e-15, 1e10),
    "Nm": (1e-12, 1e10),
    "degC": (-273.15, 2000.0),
    "1/K": (1e-9, 1.0),
    "1/A2": (1e-15, 1e12),
    "Wb/A2": (1e-15, 1e6),
    "S": (1e-12, 1e6),
    "Hz": (1e-6, 1e12),
    "s": (1e-12, 1e6),
    "samples": (1e-6, 10.0),
    "V/A": (1e-9, 1e9),
    "V/(A s)": (1e-9, 1e12),
    "A s/rad": (1e-12, 1e9),
    "A/rad": (1e-12, 1e12),
    "1/s": (1e-9, 1e12),
    "s2/rad2": (1e-24, 1e12),
    "codes": (1e-6, 2.0**32),
    "rad": (1e-9, 1e4),
    "W": (1e-9, 1e12),
}

TRIM = 2.0  # largest trim of a sensor, its inverse the least


class DriveError(ValueError):
    """An invalid drive description; the message is one line for its author."""


def refuse(key, value, allowed):
    """DriveError for a value that contradicts others; ``allowed``: in words."""
    raise DriveError(f"{key} = {value:g} is out of range: allowed is {allowed}")


@dataclass(frozen=True)
class Key:
    """Type and legal range of one key, both ends included; ``least``: smaller magnitudes between them are excluded."""

    kind: str  # "float", "int", "bool", "word"
    unit: str = "1"
    lo: float = -math.inf
    hi: float = math.inf
    least: float = 0.0
    count: int = 0  # 0: a single value; n: a list of n values
    doc: str = ""
    words: tuple = ()  # of a "word": the allowed ones

    def accepts(self, value):
        """Whether one number is finite and within the range, or a word one of the allowed."""
        if self.kind == "word":
            return value in self.words
        return self.lo <= value <= self.hi and math.isfinite(value) and abs(value) >= self.least

    @property
    def allowed(self):
        """The range in words, unit included."""
        if self.kind == "word":
            return f"{', '.join(self.words[:-1])} or {self.words[-1]}"
        unit = "" if self.unit == "1" else f" {self.unit}"
        inner = f"{-self.least:.10g} or {self.least:.10g} up to " if self.lo < 0.0 < self.least else ""
        return f"{self.lo:.10g} up to {inner}{self.hi:.10g}{unit}"


def _field(key, default):
    return dataclasses.field(default=default, metadata={"key": key})


def real(unit, doc, default=MISSING, count=0):
    """A real number of either sign, within the range of its unit."""
    least, most = RANGES[unit]
    return _field(Key("float", unit, -most if least > 0.0 else least, most, count=count, doc=doc), default)


def trim(doc, default, count=0, signed=False):
    """A factor around one: what is beyond half or twice is another range or unit, and blinds the core to its sensor."""
    return _field(Key("float", "1", -TRIM if signed else 1.0 / TRIM, TRIM, 1.0 / TRIM, count, doc), default)


def positive(unit, doc, default=MISSING, most=None):
    """A real number above zero, within the range of its unit."""
    return _field(Key("float", unit, RANGES[unit][0], most or RANGES[unit][1], doc=doc), default)


def not_negative(unit, doc, default=MISSING, most=None):
    """Zero, or a real number up to the largest of its unit."""
    return _field(Key("float", unit, 0.0, most or RANGES[unit][1], doc=doc), default)


def whole(lo, hi, doc, default=MISSING):
    """An integer of a range, both ends included."""
    return _field(Key("int", "1", lo, hi, doc=doc), default)


def flag(doc, default=MISSING):
    """true or false."""
    return _field(Key("bool", doc=doc), default)


def choice(words, doc, default=MISSING):
    """One of several words."""
    return _field(Key("word", doc=doc, words=words), default)


def needed(value: T | None) -> T:
    """The value of a key that the kind of its section needs, which drive_checks has required."""
    if value is None:
        raise DriveError("a key is missing that its section needs")
    return value


def is_finite(value):
    """Whether a value of TOML is a number, true and false excepted, that a float holds."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    return abs(value) < 1e300 if isinstance(value, int) else math.isfinite(value)


def key_of(field):
    """The declaration that belongs to a dataclass field."""
    return field.metadata["key"]
