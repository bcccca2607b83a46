# SPDX-License-Identifier: BSD-3-Clause
"""Whether the motor is connected: current in all three phases while the regulator asks for some.

    asked = run = 1 and |i_q_ref| >= 2*i_open
    turning   two of the phases carry |i_x| >= i_open within half an electrical turn or more, the third never does, in
              two such turns in sequence: one phase is open
    standing  a stall (motion_checks), and no phase carries i_open: the motor is not connected

A turn begins anew where nothing is asked for, and ends when theta_me has been in all four quadrants: at least half an
electrical turn, in which the current of a connected phase passes its peak.  A motor that gets too little voltage has
little current in all phases and is no open load.

Formats: i_open U(1,8); currents are cut (floor) to it, |x| is the one's complement where x is negative.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.formats import BIT, LIMIT, PU, TURN, TURN_W
from golden_model.io.motion_checks import FAULTS
from golden_model.io.sample_checks import DROP_LIMIT, reaches
from golden_model.kernel import kernel

STALL = 4  # of motion_faults
ALL = 15  # quadrants


class State(NamedTuple):
    carried: int = 0  # bit x: phase x has carried current in this turn
    visited: int = 0  # bit k: theta_me was in quadrant k
    suspect: int = 0  # the last turn had an open phase


@kernel
def step(state, i_a, i_b, i_c, i_q_ref, theta_me, run, motion_faults, i_open):
    s = state
    now = 1 if reaches(i_a >> DROP_LIMIT, i_open) else 0
    now += 2 if reaches(i_b >> DROP_LIMIT, i_open) else 0
    now += 4 if reaches(i_c >> DROP_LIMIT, i_open) else 0
    asked = run and reaches(i_q_ref >> (DROP_LIMIT + 1), i_open)
    carried = s.carried | now
    visited = s.visited | (1 << (theta_me >> (TURN_W - 2)))

    turned = visited == ALL
    missing = 1 if carried == 3 or carried == 5 or carried == 6 else 0  # two phases of three
    open_phase = turned and missing and s.suspect
    unconnected = motion_faults & STALL and now == 0
    open_load = 1 if asked and (open_phase or unconnected) else 0

    suspect = missing if turned else s.suspect
    if turned or not asked:
        carried, visited = 0, 0
    return State(carried, visited, suspect if asked else 0), (open_load,)


def stimuli(_rng, _config):
    """Turns in both directions with each set of phases carrying; dithering; asked and not; stalls with and without."""
    usual = dict.fromkeys((p.name for p in BLOCK.inputs), 0) | {"i_open": 10, "i_q_ref": 20 << 8, "run": 1}
    rows = []
    for carrying in (*range(8), 3, 3, 5, 6, 7):
        for turn in (1, -1, 1):
            for k in range(5):
                now = {f"i_{x}": (10 << 8) * (1 if k % 2 else -1) - (k % 2 == 0) if carrying >> n & 1 else (10 << 8) - 1
                       for n, x in enumerate("abc")}  # fmt: skip
                rows.append(usual | now | {"theta_me": turn * k * (1 << (TURN_W - 2)) % TURN.hi})
    half = {"i_a": 9000, "i_b": -9000}
    rows += [usual | half | {"theta_me": k % 2 << (TURN_W - 2)} for k in range(20)]
    for stop in ({"run": 0}, {"i_q_ref": (20 << 8) - 1}, {"i_q_ref": -(20 << 8) - 1}, {"i_q_ref": -(20 << 8)}):
        for at in range(9):
            rows += [usual | half | {"theta_me": k % 4 << (TURN_W - 2)} | (stop if k == at else {}) for k in range(9)]
    for motion in range(8):
        rows += [usual | {"motion_faults": motion}, usual | half | {"motion_faults": motion}, usual]
        rows += [usual | {"motion_faults": motion, "run": 0}]
    return rows


def patient_stimuli(rng, _config):
    """A limit of any bits, met exactly by two phases and by what is asked, missed by one LSB by the third."""
    usual, rows = dict.fromkeys((p.name for p in BLOCK.inputs), 0) | {"run": 1}, []
    limits = [1 << bit for bit in range(LIMIT.width)] + [int(rng.integers(1, LIMIT.hi)) for _ in range(30)]
    for limit in limits:
        for apart in range(3):
            at = {f"i_{x}": limit - (n == apart) << DROP_LIMIT for n, x in enumerate("abc")}
            at = {name: value if rng.integers(2) else -value - 1 for name, value in at.items()}
            for ask in (limit << DROP_LIMIT + 1, (limit << DROP_LIMIT + 1) - 1):
                now = usual | {p.name: max(min(at.get(p.name, ask), p.high), p.low) for p in BLOCK.inputs[:4]}
                rows += [now | {"i_open": limit, "theta_me": k % 4 << (TURN_W - 2)} for k in range(9)]
    return rows


BLOCK = Block(
    name="load_check",
    folder="io",
    paper="none: protection and diagnosis of the drive",
    step=step,
    inputs=tuple(Port(f"i_{x}", PU, doc=f"current, phase {x}") for x in "abc")
    + (
        Port("i_q_ref", PU, doc="current reference, q axis"),
        Port("theta_me", TURN, doc="electrical angle"),
        Port("run", BIT, doc="1: gates are switching"),
        Port("motion_faults", FAULTS, doc="overspeed, runaway, stall, see motion_checks"),
    ),
    registers=(Port("i_open", LIMIT, doc="current that a connected phase reaches when twice as much is asked for"),),
    outputs=(Port("open_load", BIT, doc="1: a phase or the motor is not connected"),),
    state=State(),
    latency=3,
    interval=3,
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
