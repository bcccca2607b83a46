# SPDX-License-Identifier: BSD-3-Clause
"""Plausibility of the motion, one bit each, evaluated with every sample after the speed regulator.

    0  overspeed   |omega_me| >= omega_trip
    1  runaway     speed mode: the shaft turns against its reference, at omega_away or faster, and for
                   ``runaway_samples`` samples in sequence not slower than at the slowest of them
    2  stall       speed mode: i_q_ref at its limit for ``stall_samples`` in sequence, and the shaft stayed on a way
                   of twice ``way_stall``

A bus that limits the braking current (``regen_limited``) lets the shaft coast: check 1 then waits with its count.

Check 1: a reversal, a stop and a load step turn against the reference as well, but the drive brakes: the speed falls
below its own minimum again and again, and each time the count starts anew.  With an angle, a direction or a phase order
that is wrong the regulator accelerates instead.  A reference of zero is against either direction.  In torque mode the
load decides about the direction: there check 0 is the limit.

Check 2: the way is the sum of omega_me since the current came to its limit.  A sample that ends beyond
way_stall on either side begins the count anew, and is left out where it leads further out, so the middle of the way
follows a shaft that gets on.  A rotor that trembles does not, however fast: the speed of a sample would not tell.

Formats: limits U(1,8), |x| is the one's complement where x is negative, cut (floor) to their format; way_stall U(12,8),
the way and the minimum in full.  Counters saturate, the way fits whatever comes.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT, LIMIT, PU
from golden_model.io.sample_checks import DROP_LIMIT
from golden_model.kernel import kernel

FAULTS = Format(0, 3, 0)
AWAY, STALLED = Format(0, 12, 0), Format(0, 16, 0)  # counts of samples
AWAY_HI, STALLED_HI = AWAY.hi, STALLED.hi
WAY_LIMIT = Format(0, 12, LIMIT.frac_bits)  # speed times samples
WAY = Format(1, WAY_LIMIT.int_bits, PU.frac_bits)


class State(NamedTuple):
    slowest: int = 0  # |omega_me| of the sample at which the count began
    away: int = 0  # samples since then
    stalled: int = 0  # samples at the limit on this way
    way: int = 0  # WAY, from its middle


@kernel
def step(
    state, omega_me, omega_ref, speed_mode, speed_limited, regen_limited, run, omega_trip, omega_away,
    runaway_samples, way_stall, stall_samples,
):  # fmt: skip
    size = omega_me if omega_me >= 0 else -1 - omega_me
    coarse = size >> DROP_LIMIT
    over = 1 if coarse >= omega_trip else 0

    against = (omega_me < 0) != (omega_ref < 0) or omega_ref == 0
    leaving = run and speed_mode and against and coarse >= omega_away
    begins = state.away == 0 or size < state.slowest
    slowest = size if begins else state.slowest
    counted = state.away if regen_limited else min(state.away + 1, AWAY_HI)
    away = (1 if begins else counted) if leaving else 0
    runaway = 1 if away > 0 and away >= runaway_samples else 0

    held = run and speed_mode and speed_limited
    gone = state.way + omega_me
    leaves = (gone if gone >= 0 else -1 - gone) >> DROP_LIMIT >= way_stall
    stalled = min(state.stalled + 1, STALLED_HI) if held and not leaves else 0
    outward = (state.way < 0) == (omega_me < 0)
    way = (state.way if leaves and outward else gone) if held else 0
    stall = 1 if stalled > 0 and stalled >= stall_samples else 0
    return State(slowest, away, stalled, way), (over + 2 * runaway + 4 * stall,)


USUAL = {"speed_mode": 1, "speed_limited": 0, "run": 1, "omega_trip": 300, "omega_away": 20, "runaway_samples": 5}
USUAL |= {"way_stall": 12, "stall_samples": 4, "omega_ref": 5000, "omega_me": 5000, "regen_limited": 0}


def stimuli(rng, _config):
    """Limits met and just missed with both signs; a runaway, a reversal, a wavering one; stalls; modes and stops."""
    usual = USUAL
    rows = []
    for edge in (300 << 8, 20 << 8, 3 << 8):
        for near in (-1, 0, 1):
            for sign in (1, -1):
                for ref in (sign, -sign, 0):
                    rows += [usual | {"omega_me": sign * (edge + near), "omega_ref": ref, "speed_limited": 1}] * 6
                    rows.append(usual)
    for sign in (1, -1):
        for slope in (30, 0, -1, -30, 7):
            for k in range(12):
                wave = 400 if slope == 7 and k % 4 == 3 else 0
                rows.append(usual | {"omega_me": -sign * (7000 + slope * k - wave), "omega_ref": 300 * sign})
            rows.append(usual)
    for breaks in ({"run": 0}, {"speed_mode": 0}, {"omega_ref": -1}, {"speed_limited": 0}, {"regen_limited": 1}):
        for row in ({"omega_me": -8000}, {"omega_me": 10, "speed_limited": 1}):
            rows += [usual | row] * 4 + [usual | row | breaks] + [usual | row] * 6 + [usual]
    for sign in (1, -1):  # to the end of the way, just not beyond, back and over the other end; a limit that moves
        row = usual | {"speed_limited": 1, "omega_me": sign * 1000}
        for near in (-1, 0, 1):
            over = row | {"omega_me": sign * (72 + near)}
            back = row | {"omega_me": -sign * (6071 - near)}
            rows += [row] * 3 + [over, row | {"omega_me": -sign}, over, back, row, row, row, usual]
        rows += [row] * 9 + [row | {"way_stall": 4}] * 2 + [row | {"way_stall": 4, "omega_me": -sign * 600}] * 9
    for most in (0, 1, AWAY_HI):
        row = {"omega_me": -9000, "runaway_samples": most}
        rows += [usual | row] * 3 + [usual | {"omega_me": 1, "speed_limited": 1, "stall_samples": most}] * 3
    return rows


def patient_stimuli(rng, _config):
    """Both counters to their ends by way of limits between powers of two, and the way to one at each of its bits; a
    shaft that brakes by an LSB.
    """
    rows = []
    for bit in range(PU.width - 1):  # the slowest speed so far with this bit and without
        for slowest in (int(rng.integers(PU.hi)) | 1 << bit, int(rng.integers(PU.hi)) & ~(1 << bit)):
            row = USUAL | {"omega_away": 0, "runaway_samples": 2}
            speeds = (max(PU.lo, -1 - slowest + off) for off in (0, -1, 0, 1, 1))
            rows += [USUAL, *(row | {"omega_me": speed} for speed in speeds)]
    for bit in range(3, AWAY.width + 1):
        for most in ((1 << bit) - 1, int(rng.integers(1 << bit - 1, 1 << bit))):
            rows += [USUAL] + [USUAL | {"omega_me": -9000, "runaway_samples": most}] * (most + 3)
    for bit in range(WAY_LIMIT.width):
        for sign in (1, -1):
            limit = int(rng.integers(1 << bit, 2 << bit))
            whole, rest = divmod(limit << DROP_LIMIT, PU.hi)
            row = USUAL | {"speed_limited": 1, "way_stall": limit}
            ends = (sign * rest - (sign > 0), sign, -sign, -sign * (PU.hi - rest))
            rows += [USUAL] + [row | {"omega_me": sign * PU.hi}] * whole + [row | {"omega_me": end} for end in ends] * 3
    between = (int(rng.integers(1 << bit - 1, 1 << bit)) for bit in range(7, 14))
    for most in (63, *between, STALLED_HI):
        row = {"omega_me": 0, "speed_limited": 1, "stall_samples": most}  # on the way for good
        rows += [USUAL] + [USUAL | row] * (most + 3)
    return rows


BLOCK = Block(
    name="motion_checks",
    folder="io",
    paper="none: protection and diagnosis of the drive",
    step=step,
    inputs=(
        Port("omega_me", PU, doc="electrical speed"),
        Port("omega_ref", PU, doc="speed reference"),
        Port("speed_mode", BIT, doc="1: speed control"),
        Port("speed_limited", BIT, doc="1: i_q_ref at its limit"),
        Port("regen_limited", BIT, doc="1: the bus voltage limits the braking current"),
        Port("run", BIT, doc="1: gates are switching"),
    ),
    registers=(
        Port("omega_trip", LIMIT, doc="speed that trips, electrical"),
        Port("omega_away", LIMIT, doc="speed against the reference from which a runaway is looked for"),
        Port("runaway_samples", AWAY, doc="samples in sequence against the reference without braking that trip"),
        Port("way_stall", WAY_LIMIT, lo=1, doc="way to either side on which the shaft stalls: speed times samples"),
        Port("stall_samples", STALLED, doc="samples in sequence at the current limit on this way that are a stall"),
    ),
    outputs=(Port("motion_faults", FAULTS, doc="overspeed, runaway, stall, see motion_checks"),),
    state=State(),
    latency=4,
    interval=4,
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
