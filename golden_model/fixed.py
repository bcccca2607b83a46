# SPDX-License-Identifier: BSD-3-Clause
"""Fixed-point formats and the two narrowing operations; twin of rtl/common/fixed_pkg.vhd.

A value is an integer; its format gives the meaning of the integer.  Python integers are unbounded
and the compiled kernels use 64 bits, so every product must fit 63 bits:
the widest is 25 x 18 bits with an exponent shift of 5.

Rounding is half up (add half an output LSB, then floor) and overflow saturates.  A block that
does anything else, floor or modulo, documents it there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from golden_model.kernel import kernel


@dataclass(frozen=True)
class Format:
    """A fixed-point format: sign bit, integer bits, fraction bits; width = sum of the three.

    ``int_bits`` may be negative (leading zeros are not stored), ``frac_bits`` larger than the width.
    """

    signed: int
    int_bits: int
    frac_bits: int

    @cached_property
    def width(self) -> int:
        return self.signed + self.int_bits + self.frac_bits

    @cached_property
    def lo(self) -> int:
        return -(1 << (self.width - 1)) if self.signed else 0

    @cached_property
    def hi(self) -> int:
        return (1 << (self.width - self.signed)) - 1

    @property
    def lsb(self) -> float:
        return 2.0**-self.frac_bits

    def to_float(self, value: int) -> float:
        """The real number that an integer of this format represents."""
        return value * self.lsb

    def to_int(self, value: float) -> int:
        """Nearest integer (half up), saturated.  Raises ValueError for NaN or infinity."""
        if value != value or value in (float("inf"), float("-inf")):
            raise ValueError(f"{value} cannot be represented in the format {self}")
        scaled = int((value / self.lsb + 0.5) // 1)
        return max(self.lo, min(self.hi, scaled))

    def limit(self, value: float) -> float:
        """``value`` limited to the range of the format: saturation of the exact number."""
        return max(self.lo * self.lsb, min(self.hi * self.lsb, value))

    def __str__(self) -> str:
        return f"{'S' if self.signed else 'U'}({self.int_bits},{self.frac_bits})"


@kernel
def round_half_up(x, drop):
    """x / 2**drop, rounded to the nearest integer, halves towards plus infinity."""
    if drop == 0:
        return x
    return (x + (1 << (drop - 1))) >> drop


@kernel
def saturate(x, width):
    """x limited to the range of a signed number of ``width`` bits."""
    hi = (1 << (width - 1)) - 1
    return max(-hi - 1, min(hi, x))


@kernel
def exceeds(x, width):
    """1 if saturating x to ``width`` signed bits changes it, else 0."""
    return 1 if saturate(x, width) != x else 0


@kernel
def saturate_u(x, width):
    """x limited to the range of an unsigned number of ``width`` bits."""
    return max(0, min((1 << width) - 1, x))


@kernel
def round_sat(x, drop, width):
    """The default narrowing: half up, then saturated to ``width`` signed bits."""
    return saturate(round_half_up(x, drop), width)


@kernel
def clamp(x, lo, hi):
    """x limited to [lo, hi]."""
    return max(lo, min(hi, x))


@kernel
def wrap(x, width):
    """x modulo 2**width as an unsigned number; for angles only."""
    return x & ((1 << width) - 1)


@kernel
def wrap_s(x, width):
    """x modulo 2**width as a signed number: the shorter of the two differences of two angles."""
    half = 1 << (width - 1)
    return ((x + half) & ((1 << width) - 1)) - half


@kernel
def length(x, y):
    """About the length of a vector: the larger size and half the smaller one; that of x < 0 is -1 - x."""
    x, y = x if x >= 0 else -1 - x, y if y >= 0 else -1 - y
    return max(x, y) + (min(x, y) >> 1)
