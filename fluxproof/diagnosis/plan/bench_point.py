# SPDX-License-Identifier: BSD-3-Clause
"""Requested operating points as numbers that are set on a test bench, within the limits of the drive.

    omega, i = on_the_bench(304.7, -1.3075 + 2.2647j, machine, within)      # 300.0, -1.3 + 2.3j

Two significant digits move a point by at most a twentieth of itself, which is less than the distance to the next
candidate; so the point remains the one that was chosen.
"""

from __future__ import annotations

import itertools
import math

FINE_A = 0.1  # step to which currents of large machines are set
LARGE_A = 10.0  # rated current from which on a machine is large


def on_the_bench(omega: float, i: complex, machine, within=lambda omega, i: True) -> tuple[float, complex]:
    """The nearest round point: electrical speed [rad/s] and dq current [A]; within: the limits, (omega, i) to bool.

    If no round neighbour is within the limits, the point itself.
    """
    least = FINE_A if machine.rated_current_a >= LARGE_A else 0.0
    choices = (neighbours(omega), neighbours(i.real, least), neighbours(i.imag, least))
    sizes = [max(abs(x), 1e-12) for x in (omega, i.real, i.imag)]
    sizes[1:] = [max(abs(i), 1e-12)] * 2
    best = (math.inf, omega, i)
    for w, d, q in itertools.product(*choices):
        off = sum(abs(a - b) / s for a, b, s in zip((w, d, q), (omega, i.real, i.imag), sizes, strict=True))
        if off < best[0] and within(w, complex(d, q)):
            best = (off, w, complex(d, q))
    return best[1], best[2]


def neighbours(x: float, least: float = 0.0) -> tuple[float, ...]:
    """The numbers of two significant digits below and above x, in steps of at least ``least``."""
    if abs(x) < 1e-9:
        return (0.0,)
    step = max(10.0 ** (math.floor(math.log10(abs(x))) - 1), least)
    places = max(-math.floor(math.log10(step) + 1e-9), 0)
    counts = math.floor(x / step + 1e-9), math.ceil(x / step - 1e-9)
    return tuple(dict.fromkeys(round(n * step, places) + 0.0 for n in counts))
