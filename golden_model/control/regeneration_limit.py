# SPDX-License-Identifier: BSD-3-Clause
"""Limits the current that brakes, so that what braking feeds back does not charge the bus up to its trip.

    most    = max(i_max - regen_slope*max(u_dc - regen_start, 0), 0)          of the last sample
    i_q_ref = limit(i_q_asked, +-most)      while i_q_asked brakes, that is i_q_asked*omega_me < 0
            = i_q_asked                     otherwise, and always with regen_slope = 0

The line is a proportional regulator of the bus voltage: C*du/dt = P/u, with P = 1.5*omega_me*psi*|i_q| less the losses,
settles where the current that is left feeds back no more than the losses take.  It acts one sample late, while the bus
moves within milliseconds, and therefore needs no multiplier: the product is made bit by bit beside everything else.
``regen_limited`` tells speed_pi, which then integrates no braking, and motion_checks, which counts no runaway.

Formats: most PU, product exact, cut (floor) to PU: the limit is less than an LSB too high.  Nothing else is rounded.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, clamp
from golden_model.formats import BIT, PU, U_DC
from golden_model.kernel import kernel

SLOPE = Format(0, 8, 8)  # current over voltage, per unit of their bases
SLOPE_W, DROP = SLOPE.width, U_DC.frac_bits + SLOPE.frac_bits - PU.frac_bits


class State(NamedTuple):
    most: int = 0  # PU, of the last sample's bus voltage


@kernel
def step(state, i_q_asked, omega_me, u_dc, i_max, regen_start, regen_slope):
    braking = omega_me != 0 and (i_q_asked < 0) != (omega_me < 0)
    i_q_ref = clamp(i_q_asked, -state.most, state.most) if braking else i_q_asked
    taken = (regen_slope * max(u_dc - regen_start, 0)) >> DROP
    return State(max(i_max - taken, 0)), (i_q_ref, 1 if i_q_ref != i_q_asked else 0)


def reference(v, state):
    braking = v["i_q_asked"] * v["omega_me"] < 0.0
    most = state.most * PU.lsb
    return {"i_q_ref": min(max(v["i_q_asked"], -most), most) if braking else v["i_q_asked"]}


def bound(_v, _state):
    return {"i_q_ref": 0.0}


def stimuli(rng, _config):
    """Both quadrants of both directions at, above and below the limit; lines of every slope; the bus at their ends."""
    rows = []
    for slope in (0, 1, 255, 256, 1031, SLOPE.hi, *(int(2 ** rng.uniform(0, 16)) for _ in range(6))):
        for start in (0, 60000, U_DC.hi):
            for over in (-1, 0, 1, 255, 4096, 70000):
                for i_max in (0, 1, 40000, PU.hi):
                    line = {"i_max": i_max, "regen_start": start, "regen_slope": slope}
                    rows.append(line | {"u_dc": min(max(start + over, 0), U_DC.hi), "i_q_asked": 0, "omega_me": 0})
                    most = max(i_max - (slope * max(rows[-1]["u_dc"] - start, 0) >> DROP), 0)
                    near = int(rng.integers(-1, 2))
                    for sign in (1, -1):
                        i_q = sign * min(most + near, PU.hi)
                        rows.append(rows[-1] | {"i_q_asked": i_q, "omega_me": -sign if i_q else sign})
                        rows.append(rows[-1] | {"omega_me": int(rng.integers(-1, 2))})
    return rows


def patient_stimuli(rng, _config):
    """A line of which each bit of the slope and of the voltage counts, with the current at the limit that it leaves."""
    rows = []
    for k in range(SLOPE.width + U_DC.width):
        slope = 1 << k if k < SLOPE.width else int(rng.integers(1, SLOPE.hi))
        over = int(rng.integers(1, U_DC.hi)) if k < SLOPE.width else 1 << k - SLOPE.width
        start = int(rng.integers(0, U_DC.hi - over + 1))
        taken = slope * over >> DROP
        for i_max in (min(taken + off, PU.hi) for off in (-1, 0, 1, 77)):
            line = {"i_max": max(i_max, 0), "regen_start": start, "regen_slope": slope, "u_dc": start + over}
            for i_q in (1, 2, 77, 78, 79, PU.hi):
                rows += [line | {"i_q_asked": s * i_q, "omega_me": -s} for s in (1, -1)]
    return rows


BLOCK = Block(
    name="regeneration_limit",
    folder="control",
    paper="none: protection of the bus, docs/faults.md",
    step=step,
    inputs=(
        Port("i_q_asked", PU, doc="current reference in the circle, q axis"),
        Port("omega_me", PU, doc="electrical speed"),
        Port("u_dc", U_DC, doc="bus voltage"),
    ),
    registers=(
        Port("i_max", PU, lo=0, doc="limit of the current: radius of the circle of i_d and i_q references"),
        Port("regen_start", U_DC, doc="bus voltage from which the braking current is limited"),
        Port("regen_slope", SLOPE, doc="braking current that a bus above it takes away, per voltage; 0: no limit"),
    ),
    outputs=(
        Port("i_q_ref", PU, doc="current reference, q axis"),
        Port("regen_limited", BIT, doc="1: the bus voltage limits the braking current"),
    ),
    state=State(),
    latency=1,
    interval=SLOPE_W + 3,
    constants={"SLOPE_W": SLOPE_W, "DROP": DROP},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
