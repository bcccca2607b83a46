# SPDX-License-Identifier: BSD-3-Clause
"""What the bench asks for: speeds of a load machine and current references, one held point after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Plan:
    """speed [rad/s of the shaft] and i_ref [A, d + jq] of each period; held: (first, last) rows of the points."""

    speed: np.ndarray
    i_ref: np.ndarray
    held: tuple[tuple[int, int], ...]
    bandwidth: float  # rad/s of the current regulator


def _ramp(values, lengths, rise):
    """Held values with linear transitions of ``rise`` rows at the begin of each."""
    out, last = [], values[0]
    for value, length in zip(values, lengths, strict=True):
        share = np.minimum(1.0, np.arange(1, length + 1) / rise)
        out.append(last + (value - last) * share)
        last = value
    return np.concatenate(out)


def course(drive, points, seconds, bandwidth, rows=0) -> Plan:
    """Hold each point (omega_e, i_d, i_q) for a time; the last one until there are ``rows``."""
    rise = int(0.02 / drive.period)
    lengths = [int(seconds / drive.period) + rise] * len(points)
    lengths[-1] += max(0, rows - sum(lengths))
    ends = np.cumsum(lengths)
    held = tuple((int(e - n + 2 * rise), int(e)) for e, n in zip(ends, lengths, strict=True))
    speed = _ramp([w / drive.pole_pairs for w, _, _ in points], lengths, rise)
    i_ref = _ramp([complex(d, q) for _, d, q in points], lengths, rise)
    return Plan(speed, i_ref, held, bandwidth)


def top_speed(drive, points) -> float:
    """Electrical speed [rad/s] at which the worst of the currents takes 0.42 of the bus, with 16 samples a turn."""
    omega = 2 * np.pi / 16 / drive.period
    while max(drive.voltage(s * omega, d, q) for d, q in points for s in (1, -1)) > 0.42 * drive.bus:
        omega *= 0.98
    return omega


def bench(rng, drive) -> Plan:
    """Five speeds with six or seven currents of both signs, after a time without current; the first points again."""
    a = 0.92 * drive.current
    low, high, side = rng.uniform(0.25, 0.4), rng.uniform(0.8, 1.0), rng.uniform(0.35, 0.65)
    currents = [(0, low), (0, -low), (0.25, 0.3), (-side, 0.2), (-0.6 * side, high * 0.8), (-0.6 * side, -high * 0.8)]
    currents += [(0, high)][: int(rng.integers(0, 2))]
    currents = [(d * a, q * a) for d, q in currents]
    top = top_speed(drive, currents)
    shares = [0.08, -0.08, rng.uniform(0.35, 0.55), -rng.uniform(0.5, 0.8), rng.uniform(0.85, 1.0)]
    rng.shuffle(shares)
    points = [(shares[0] * top, 0.0, 0.0)]
    for share in shares:
        points += [(share * top, d, q) for d, q in rng.permutation(currents)]
    points += points[1:4]
    seconds = max(0.11, 2.5 / (0.08 * top / 2 / np.pi))
    return course(drive, points, seconds, 2 * np.pi * rng.uniform(120, 300), 40_000)
