# SPDX-License-Identifier: BSD-3-Clause
"""Telemetry dumps of the paper's drive as recordings, and where two replays of one differ."""

from __future__ import annotations

import numpy as np

from cocotb_tests.support.drives import PAPER
from fluxproof.diagnosis.ground.recording import from_columns
from fluxproof.diagnosis.replay import telemetry
from golden_model import drive, fluxproof

SAMPLE_TIME_S = drive.load(PAPER).sample_time_s
OWNERS = {}  # register -> blocks that have it, from their declarations
for _module, _ in fluxproof.WIRING.values():
    for _port in _module.BLOCK.registers:
        OWNERS.setdefault(_port.name, set()).add(_module.BLOCK.name)


def recording(path):
    columns, meta = telemetry.read_dump(path)
    found = from_columns(columns, SAMPLE_TIME_S, str(path))
    found.meta = meta
    return found


def first_row(a, b):
    """The first row in which two replays differ, or None."""
    rows = np.flatnonzero((a != b).any(axis=1))
    return int(rows[0]) if len(rows) else None
