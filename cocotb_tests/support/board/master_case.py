# SPDX-License-Identifier: BSD-3-Clause
"""A golden board whose second encoder turns: JSON of its code and what it must be, for a process without numba."""

from __future__ import annotations

import json

import numpy as np

from fluxproof.cosim.board_clock import PINS, BoardClock, GoldenBlocks
from golden_model.encoders import master_encoder
from golden_model.encoders.quadrature_decoder import lines
from golden_model.fluxproof import Config

COUNTS, CLOCKS, EDGE, BEGIN = 60, 2600, 23, 400  # counts a turn; clocks; of a count; before the first
CONFIG = Config(carrier_half=128, estimators=0)


def turned(master: int) -> dict:
    """A board with or without the pins of a master, which turns forward."""
    board = BoardClock(GoldenBlocks(CONFIG, encoder=0, currents=0, master=master), 25_600_000)
    for k, (name, value) in enumerate(master_encoder.setting(COUNTS).items()):
        board.write(name, value, 20 * k)
    counted = np.maximum(np.arange(CLOCKS) - BEGIN, 0) // EDGE
    pins = np.zeros((CLOCKS, len(PINS)), np.int64)
    for name, levels in zip(("master_a", "master_b"), zip(*map(lines, counted.tolist()), strict=True), strict=True):
        pins[:, PINS.index(name)] = levels
    seen, _ = board.advance(pins)
    triggers = np.flatnonzero(seen[:, board.seen_names.index("sample_trigger")])
    last = int(counted[triggers[-1]])
    codes = [
        ((2 * (n % COUNTS) + 1) * (1 << 18) + COUNTS) // (2 * COUNTS) for n in (last - 1, last)
    ]  # filters are late
    return {"code": int(board.state.wires.master_code), "triggers": len(triggers), "expected": codes}


if __name__ == "__main__":
    print(json.dumps(turned(1) | {"unbuilt": turned(0)["code"]}))
