# SPDX-License-Identifier: BSD-3-Clause
"""Steps of the inference whose results are kept as long as nothing that they read has changed.

A kept result is used again for the same arguments if every constant that the step read, itself or in a step within it,
still has the value that it had.  A pure step would then read the same constants again and return the same.  Reads are
recorded, not declared: inside ``recorded`` every access to an attribute of constants.py is seen.
"""

from __future__ import annotations

import contextlib
import types
from dataclasses import dataclass

import numpy as np

from fluxproof.diagnosis.ground import constants
from fluxproof.diagnosis.inference.setup import Setup

_reading: list[dict[str, float]] = []  # {constant: value} read by the steps that run now, the outermost first


class _Recorded(types.ModuleType):
    """The module of the constants, which tells the running steps what is read."""

    def __getattribute__(self, name):
        value = super().__getattribute__(name)
        if name.isupper():
            for reads in _reading:
                reads[name] = value
        return value


@contextlib.contextmanager
def recorded():
    """The constants are recorded inside the block."""
    usual = constants.__class__
    constants.__class__ = _Recorded
    try:
        yield
    finally:
        constants.__class__ = usual


@contextlib.contextmanager
def varied(name: str, factor: float):
    """A constant multiplied by a factor, inside the block."""
    value = getattr(constants, name)
    setattr(constants, name, value * factor)
    try:
        yield
    finally:
        setattr(constants, name, value)


@dataclass
class Kept:
    """A result, the arguments, which are kept alive as their identity is compared, and what was read."""

    arguments: tuple
    result: object
    reads: dict[str, float]


class Steps:
    """Runs steps, ``steps(function, *arguments)``, and keeps their results."""

    def __init__(self):
        self.kept: dict[tuple, list[Kept]] = {}
        self.lasting = True  # whether further results are kept for all variations, or only for the present one
        self.passing: list[tuple] = []
        self.ran = 0

    def __call__(self, function, *arguments):
        key = (function, *(_value(a) for a in arguments))
        for known in self.kept.get(key, ()):
            if all(vars(constants)[name] == value for name, value in known.reads.items()):
                self._tell(known.reads)
                return known.result
        reads: dict[str, float] = {}
        _reading.append(reads)
        try:
            result = function(*arguments)
        finally:
            _reading.pop()
        self.ran += 1
        for known in self.kept.get(key, ()):
            if _same(known.result, result):
                result = known.result  # so that later steps see the same argument
                break
        self.kept.setdefault(key, []).append(Kept(arguments, result, reads))
        if not self.lasting:
            self.passing.append(key)
        return result

    @staticmethod
    def _tell(reads):
        for outer in _reading:
            outer.update(reads)

    def forget(self):
        """Forget what was kept for one variation only."""
        for key in self.passing:
            self.kept[key].pop()
        self.passing.clear()

    def reads(self) -> set[str]:
        """Constants that any step has read."""
        return {name for kept in self.kept.values() for one in kept for name in one.reads}


def _value(argument):
    """What an argument is compared by: names and numbers by value, all else by identity."""
    if argument is None or isinstance(argument, str | bool | int | float):
        return (type(argument), argument)
    if isinstance(argument, tuple):
        return tuple(_value(a) for a in argument)
    return ("identity", id(argument))


def _same(a, b) -> bool:
    """Whether two setups of the same rows are equal; nothing else is compared by its contents."""
    if not isinstance(a, Setup) or not isinstance(b, Setup) or a.rows is not b.rows:
        return False
    alike = (a.noise is b.noise) and (a.cells is b.cells) and (a.call is b.call)
    return alike and all(np.array_equal(getattr(a, n), getattr(b, n)) for n in ("level", "points", "visits"))
