# SPDX-License-Identifier: BSD-3-Clause
"""Runs of the golden board that end in a fault or use a forced position; as a program: the facts of one as JSON.

    NUMBA_DISABLE_JIT=1 python -m cocotb_tests.support.board.fault_cases index_wrong

Some thousand clocks are faster in plain Python than compiled first.
"""

from __future__ import annotations

import json
import sys

import numpy as np

from cocotb_tests.support.board.loop_bench import COUNTS, BoardLoop, with_abz_and_spi
from cocotb_tests.support.board.run_cases import (
    CARRIER_HALF,
    DRIVE,
    HALL_SPOILS,
    before_the_index,
    clear_at_a_trip,
    hall_spoiled,
    start_from_standstill,
    status,
)
from cocotb_tests.support.peripherals.incremental_model import Incremental
from fluxproof.cosim.board_clock import SEEN, STATUS
from golden_model.drive import load
from golden_model.formats import PU, TURN
from golden_model.io.board_faults import NAMES

MOVED = 60  # counts by which Z moves after the first index
RATE = 1 << 20  # turns a sample, in 2**-32
CURRENT_A = 2.0


def index_wrong() -> dict:
    """Z moves by MOVED counts once the drive is referenced: the next one trips, and says so."""
    loop, moved, off_after = start_from_standstill(), False, 0
    for chunk in loop.run(220):
        if status(chunk)["encoder_flags"] & 1 and not moved:
            loop.pins.encoder.encoder, moved = Incremental(COUNTS, index_from=float(MOVED)), True
        if status(chunk)["board_first"]:
            break
    fault = (chunk.status[:, 9] & 1).nonzero()[0][0]
    gates = chunk.seen[:, :2].any(axis=1)
    off_after = int(gates[fault:].sum())
    core = loop.golden.state.of_core.of_fault_latch
    irq = int(chunk.seen[-1, SEEN.index("irq")])
    return {**status(chunk), "moved": moved, "clocks_to_off": off_after, "first_fault": core.first, "irq": irq}


def forced() -> dict:
    """A current along a position that the host turns; its source changes with the gates off; the snapshot has both."""
    drive = with_abz_and_spi(load(DRIVE), CARRIER_HALF)
    writes = {
        22: {"forced_angle": TURN.to_int(0.05), "forced_rate": RATE},
        23: {"position_source": 1},
        25: {"enable": 1, "i_d_ref": PU.to_int(CURRENT_A / drive.bases.current_a)},
        60: {"take_snapshot": 1},
        61: {"board_ignore": 1 << NAMES.index("no_index")},
        62: {"position_source": 0, "enable": 0},  # the gates switch still: refused
        64: {"position_source": 0},
    }
    loop, codes, currents = BoardLoop(drive, writes), [], []
    for chunk in loop.run(68):
        codes.append(loop.golden.state.wires.position_code)
        if chunk.number == 61:
            currents = [round(float(i), 2) for i in loop.plant.i_abc]
        if chunk.number == 63:
            refused = codes[-1]
    steps = np.diff(codes[30:60]) % (1 << 16)
    latch = loop.golden.state.of_core.of_fault_latch
    facts = {
        "refused": refused,
        "steps": sorted({int(s) for s in steps}),
        "fault_flags": latch.flags,
        "currents": currents,
    }
    return {**status(chunk), **facts, "after": codes[-1]}


def gates_on(chunk) -> int:
    """Clocks with a gate on."""
    return int(chunk.seen[:, :2].any(axis=1).sum())


def no_index() -> dict:
    """The encoder of two passes: enabled at once, cleared and enabled again, then with an angle of the host."""
    loop = before_the_index()
    at = loop.settled
    chunks, firsts = [], []
    for chunk in loop.run(at + 16):
        chunks.append(chunk)
        firsts.append(loop.golden.state.of_core.of_fault_latch.first)
    first = dict(zip(STATUS, chunks[at + 8].status[-1].tolist(), strict=True))
    return {
        "gates_before": sum(map(gates_on, chunks[: at + 6])),
        "refused_again": sum(map(gates_on, chunks[at + 6 : at + 9])),
        "board_first": first["board_first"],
        "first_fault": firsts[at + 8],
        "gates_forced": gates_on(chunks[-1]),
    }


def trip_against_clear() -> dict:
    """Trips, then a pulse at the pin at each clock from one before to ten after a write of clear_trip begins."""
    loop = clear_at_a_trip()
    at, after, firsts, before = loop.settled + 4, [], [], None
    for chunk in loop.run(at + 3 * 12 + 6):
        latch = loop.golden.state.of_core.of_fault_latch
        if chunk.number == at - 1:
            before = loop.golden.state.wires.running
        elif at < chunk.number and (chunk.number - at) % 3 == 1 and len(after) < 12:
            after.append(gates_on(chunk))
            firsts.append(latch.first)
    return {
        "running_before": before,
        "after": after,
        "first_faults": firsts,
        "running_at_last": loop.golden.state.wires.running,
    }


def hall_code() -> dict:
    """The hub with codes that its sensors cannot give, from some periods after the enable on, or before it."""
    found = {}
    for name in ("good", *HALL_SPOILS):
        loop = hall_spoiled(name)
        chunks = list(loop.run(loop.settled + 12))
        ran = any(gates_on(chunk) for chunk in chunks[: loop.settled + 8])
        found[name] = {**status(chunks[-1]), "ran": bool(ran), "gates_after": gates_on(chunks[-1])}
    return found


CASES = {case.__name__: case for case in (index_wrong, forced, no_index, trip_against_clear, hall_code)}

if __name__ == "__main__":
    print(json.dumps(CASES[sys.argv[1]]()))
