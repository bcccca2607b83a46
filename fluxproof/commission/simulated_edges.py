# SPDX-License-Identifier: BSD-3-Clause
"""Edges of an incremental encoder or of Hall sensors at the samples of a simulated drive: speed and Hall code.

As encoders/edge_timer, with real numbers: counts between the last edges of two samples over the time between these
edges; the place within a sample moves with the speed at its end.
"""

from __future__ import annotations

import math

import numpy as np

from golden_model.board_registers import SECTORS
from golden_model.encoders import hall_decoder
from golden_model.formats import PU, TURN_W
from golden_model.kernel import kernel

COUNTS, HALL, SCALE, LAST, TIME, SENSE, OMEGA = range(7)  # of ``edges``
MIDDLE = np.array(hall_decoder.MIDDLE, np.int64)


def edges_of(drive) -> np.ndarray:
    """State of the edges: counts a turn (0: no edges), 1 for Hall sensors, per-unit speed of a count a second."""
    kind, pairs = drive.encoder.kind, drive.machine.pole_pairs
    counts = drive.encoder.counts if kind == "abz" else SECTORS * pairs if kind == "hall" else 0
    edges = np.zeros(OMEGA + 1)
    edges[COUNTS], edges[HALL], edges[TIME] = counts, kind == "hall", -math.inf
    if counts:
        edges[SCALE] = 2.0 * math.pi * pairs / counts / drive.bases.omega_me_rad_s / PU.lsb
    edges[LAST] = math.nan
    return edges


@kernel
def edge_speed(edges, turns, turns_per_s, now):
    """Speed as the integer of omega_given, in the sense of the code; ``turns``: place of the shaft."""
    place, count = turns * edges[COUNTS], math.floor(turns * edges[COUNTS])
    if math.isnan(edges[LAST]):
        edges[LAST] = count
    moved = count - edges[LAST]
    if moved != 0.0:
        sense = 1.0 if moved > 0.0 else -1.0
        behind = abs(place - count) if moved > 0.0 else abs(count + 1 - place)
        speed = max(abs(turns_per_s) * edges[COUNTS], 1e-9)
        at = now - behind / speed
        if sense != edges[SENSE]:
            moved -= sense  # an edge after a reversal is the edge passed before
        edges[OMEGA] = 0.0 if at <= edges[TIME] else moved / (at - edges[TIME])
        edges[SENSE], edges[TIME], edges[LAST] = sense, at, count
    else:
        most = 1.0 / max(now - edges[TIME], 1e-12)
        edges[OMEGA] = max(-most, min(most, edges[OMEGA]))
    omega = round(edges[OMEGA] * edges[SCALE])
    return int(max(-PU_MOST, min(PU_MOST, omega)))


PU_MOST = PU.hi


@kernel
def hall_code(pairs, turns, position_bits):
    """The middle of the sector as a code of an electrical turn."""
    sector = int(math.floor(turns * pairs * 6.0)) % 6
    return MIDDLE[sector] >> (TURN_W - position_bits)
