# SPDX-License-Identifier: BSD-3-Clause
"""Edges of an incremental encoder or of Hall sensors at the samples of a simulated drive: speed and Hall code.

The speed as encoders/edge_timer, with real numbers: counts between the last edges of two samples over the time between
these edges; the place within a sample moves with the speed at its end.  The Hall code is that of encoders/hall_angle
itself, which is given each edge at its clock.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from golden_model.board_registers import SECTORS
from golden_model.encoders import hall_angle, hall_decoder
from golden_model.formats import PU, TURN_W
from golden_model.kernel import kernel

COUNTS, HALL, SCALE, LAST, TIME, SENSE, OMEGA = range(7)  # of ``speed``
SEEN, SECTOR, CLOCK = range(3)  # of ``place``: 1 after the first sample; sector, clock of the last step
MIDDLE = np.array(hall_decoder.MIDDLE, np.int64)
TIME_W, TAKES = hall_angle.TIME_W, hall_angle.TAKES
PU_MOST = PU.hi


class Edges(NamedTuple):
    """The edges of one encoder; the arrays change in place."""

    speed: np.ndarray  # (7,) COUNTS to OMEGA
    place: np.ndarray  # (3,) int64, SEEN to CLOCK
    angle: np.ndarray  # int64, the fields of hall_angle.State
    sectors: int  # of Hall sensors in a turn of the shaft
    clock_hz: float


def no_edges() -> Edges:
    """Of an encoder whose position is a code."""
    return Edges(np.zeros(OMEGA + 1), np.zeros(CLOCK + 1, np.int64), np.array(hall_angle.State(), np.int64), 0, 1.0)


def edges_of(drive) -> Edges:
    """State of the edges: counts a turn (0: no edges), 1 for Hall sensors, per-unit speed of a count a second."""
    kind, pairs = drive.encoder.kind, drive.machine.pole_pairs
    counts = drive.encoder.counts if kind == "abz" else SECTORS * pairs if kind == "hall" else 0
    edges = no_edges()._replace(sectors=SECTORS * pairs, clock_hz=float(drive.core.clock_hz))
    speed = edges.speed
    speed[COUNTS], speed[HALL], speed[TIME], speed[LAST] = counts, kind == "hall", -math.inf, math.nan
    if counts:
        speed[SCALE] = 2.0 * math.pi * pairs / counts / drive.bases.omega_me_rad_s / PU.lsb
    return edges


@kernel
def edge_speed(edges, turns, turns_per_s, now):
    """Speed as the integer of omega_given, in the sense of the code; ``turns``: place of the shaft."""
    e = edges.speed
    place, count = turns * e[COUNTS], math.floor(turns * e[COUNTS])
    if math.isnan(e[LAST]):
        e[LAST] = count
    moved = count - e[LAST]
    if moved != 0.0:
        sense = 1.0 if moved > 0.0 else -1.0
        behind = abs(place - count) if moved > 0.0 else abs(count + 1 - place)
        speed = max(abs(turns_per_s) * e[COUNTS], 1e-9)
        at = now - behind / speed
        if sense != e[SENSE]:
            moved -= sense  # an edge after a reversal is the edge passed before
        e[OMEGA] = 0.0 if at <= e[TIME] else moved / (at - e[TIME])
        e[SENSE], e[TIME], e[LAST] = sense, at, count
    else:
        most = 1.0 / max(now - e[TIME], 1e-12)
        e[OMEGA] = max(-most, min(most, e[OMEGA]))
    omega = round(e[OMEGA] * e[SCALE])
    return int(max(-PU_MOST, min(PU_MOST, omega)))


@kernel
def hall_code(edges, turns, turns_per_s, now, position_bits):
    """The angle of hall_angle at a sample as a code of an electrical turn; ``now`` [s], ``turns`` of the shaft."""
    p, place = edges.place, turns * edges.sectors
    sector, at_sample = math.floor(place), round(now * edges.clock_hz)
    state = hall_angle.state_of(edges.angle)
    if p[SEEN] == 0:
        p[SEEN], p[SECTOR], p[CLOCK] = 1, sector, at_sample - 1
        state, _ = hall_angle.step(state, 0, 0, 0, MIDDLE[sector % 6], 0, TIME_W)
    speed = max(abs(turns_per_s) * edges.sectors, 1e-9)
    sense = 1 if sector > p[SECTOR] else -1
    while p[SECTOR] != sector:
        p[SECTOR] += sense
        passed = p[SECTOR] if sense == 1 else p[SECTOR] + 1  # the edge
        behind = min(abs(place - passed) / speed * edges.clock_hz, at_sample - 1.0 * p[CLOCK])
        clock = max(min(at_sample - round(behind), at_sample - 1), p[CLOCK] + 1)
        state = hall_angle.rest(state, clock - p[CLOCK] - 1, TIME_W)
        up, down = (1, 0) if sense == 1 else (0, 1)
        state, _ = hall_angle.step(state, up, down, 0, MIDDLE[p[SECTOR] % 6], 0, TIME_W)
        p[CLOCK] = clock
    state, theta = hall_angle.rest(state, max(at_sample - p[CLOCK] - 1, 0), TIME_W), 0
    for k in range(TAKES):
        state, (theta,) = hall_angle.step(state, 0, 0, 0, MIDDLE[sector % 6], 1 if k == 0 else 0, TIME_W)
    p[CLOCK] = at_sample + TAKES
    for n, value in enumerate(state):
        edges.angle[n] = value
    return theta >> (TURN_W - position_bits)
