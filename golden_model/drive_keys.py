"""How a key of drive.toml is declared: type, unit and allowed range, written once at the dataclass field.

A section of the file is a frozen dataclass whose fields are made with the functions below; drive_file
reads any such dataclass and writes the error messages, so that a new key is one line in drive.py.
"""

import dataclasses
import math
from dataclasses import MISSING, dataclass


class DriveError(ValueError):
    """An invalid drive description; the message is one line for its author."""


@dataclass(frozen=True)
class Key:
    """Type and legal range of one key; ``open_lo``: the lower end itself is excluded."""

    kind: str  # "float", "int", "bool", "word"
    unit: str = "1"
    lo: float = -math.inf
    hi: float = math.inf
    open_lo: bool = False
    count: int = 0  # 0: a single value; n: a list of n values
    doc: str = ""
    words: tuple = ()  # of a "word": the allowed ones

    def accepts(self, value):
        """Whether one number is finite and within the range, or a word one of the allowed."""
        if self.kind == "word":
            return value in self.words
        above = value > self.lo if self.open_lo else value >= self.lo
        return above and value <= self.hi and math.isfinite(value)

    @property
    def allowed(self):
        """The range in words, unit included."""
        if self.kind == "word":
            return f"{', '.join(self.words[:-1])} or {self.words[-1]}"
        unit = "" if self.unit == "1" else f" {self.unit}"
        if math.isfinite(self.lo) and math.isfinite(self.hi):
            return f"{'above ' if self.open_lo else ''}{self.lo:g} up to {self.hi:g}{unit}"
        if math.isfinite(self.lo):
            return f"{'above' if self.open_lo else 'at least'} {self.lo:g}{unit}"
        return f"a finite number{unit and ' of' + unit}"


def _field(key, default):
    return dataclasses.field(default=default, metadata={"key": key})


def real(unit, doc, default=MISSING, count=0):
    """A real number of either sign."""
    return _field(Key("float", unit, count=count, doc=doc), default)


def positive(unit, doc, default=MISSING, most=math.inf):
    """A real number above zero."""
    return _field(Key("float", unit, 0.0, most, open_lo=True, doc=doc), default)


def not_negative(unit, doc, default=MISSING, most=math.inf):
    """A real number of zero or more."""
    return _field(Key("float", unit, 0.0, most, doc=doc), default)


def whole(lo, hi, doc, default=MISSING):
    """An integer of a range, both ends included."""
    return _field(Key("int", "1", lo, hi, doc=doc), default)


def flag(doc, default=MISSING):
    """true or false."""
    return _field(Key("bool", doc=doc), default)


def choice(words, doc, default=MISSING):
    """One of several words."""
    return _field(Key("word", doc=doc, words=words), default)


def key_of(field):
    """The declaration that belongs to a dataclass field."""
    return field.metadata["key"]
