# SPDX-License-Identifier: BSD-3-Clause
"""The angle between the edges of Hall sensors, by the time of the last sector, never outside the sector.

t is the time since the last edge, T that of the last sector, d = 1 or -1 the direction of the edge:

    theta = middle of the sector + d * place * turn/6

    two edges in one direction, T below the longest time:  place = t/T - 1/2 up to t = T,  then (T/t)/2
    else, the speed is not known:                          place = (t/T - 1)/2 up to t = T,  then 0

So the angle passes from one edge to the next where the speed is constant, goes back to the middle where the next edge
is late, and is the middle at rest.  After a reversal the shaft is at the edge it has passed: the angle goes on from
this edge, towards the middle.  There T is the longer one of the last sector and the time since the edge before, a
quarter of the longest time at most; as long an edge after a rest may take.  Before the first edge, and after a change
by more than one sector, the angle is the middle.
Formats: angles TURN, times TIME_W bits, saturating; t/T has QUOTIENT_W bits.  Rounding: the quotient is cut, the angle
half up; it wraps.
A sample takes ``TAKES`` clocks from ``sample`` to the angle, one bit of the quotient a clock; a ``sample`` before that
is ignored.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import round_half_up, wrap
from golden_model.formats import BIT, TURN, TURN_W
from golden_model.kernel import kernel

TIME_W, QUOTIENT_W, GUARD = 21, 16, 6
HALF_SECTOR = round((1 << (TURN_W + GUARD)) / 12)  # with GUARD bits more than TURN
TAKES = QUOTIENT_W + 2


class State(NamedTuple):
    seen: int = 0  # 1: an edge, no skipped sector since
    forward: int = 0  # direction of the last edge
    known: int = 0  # 1: sector_time is that of a whole sector
    since: int = 1  # clocks since the last edge
    sector_time: int = 1
    middle: int = 0  # of the sector that the values above belong to
    clock: int = 0  # of the engine, 0: idle
    remainder: int = 0
    divisor: int = 0
    part: int = 0  # what the next bit of the quotient is worth
    place: int = 0
    backward: int = 0
    begin: int = 0  # the middle at the sample
    theta: int = 0


@kernel
def step(state, step_up, step_down, skipped, theta_hall, sample, time_w):
    s = state
    time_max, slow = (1 << time_w) - 1, 1 << (time_w - 2)
    edge = step_up or step_down
    forward = 1 if step_up else 0
    onward = edge and s.seen and forward == s.forward  # a second edge in one direction
    seen, known, since, sector_time = s.seen, s.known, min(s.since + 1, time_max), s.sector_time
    if skipped:
        seen = 0
    elif edge:
        seen, since = 1, 1
        known = 1 if onward and s.since != time_max else 0
        sector_time = s.since if known else min(max(s.sector_time, s.since), slow)

    # t/T or T/t, each bit of the quotient worth half the one before
    clock, remainder, divisor, part, place = s.clock, s.remainder, s.divisor, s.part, s.place
    backward, begin, theta = s.backward, s.begin, s.theta
    if sample and s.clock == 0:
        within = s.since <= s.sector_time
        clock = 1
        remainder = s.since if within else s.sector_time
        divisor = s.sector_time if within else s.since
        part = HALF_SECTOR if within and s.known else HALF_SECTOR >> 1
        place = -HALF_SECTOR if within else 0
        if not s.seen or not (within or s.known):
            part, place = 0, 0
        backward = 1 - s.forward
        begin = s.middle
    elif s.clock != 0 and s.clock <= QUOTIENT_W:
        clock = s.clock + 1
        enough = 2 * s.remainder >= s.divisor
        remainder = 2 * s.remainder - (s.divisor if enough else 0)
        place = s.place + (s.part if enough else 0)
        part = s.part >> 1
    elif s.clock != 0:
        clock = 0
        theta = wrap(s.begin + round_half_up(-s.place if s.backward else s.place, GUARD), TURN_W)
    following = State(
        seen,
        forward if edge else s.forward,
        known,
        since,
        sector_time,
        theta_hall,
        clock,
        remainder,
        divisor,
        part,
        place,
        backward,
        begin,
        theta,
    )
    return following, (theta,)


@kernel
def rest(state, clocks, time_w):
    """The state after so many clocks without an edge or a sample, the engine idle."""
    s = state
    since = min(s.since + clocks, (1 << time_w) - 1)
    return State(
        s.seen, s.forward, s.known, since, s.sector_time, s.middle, s.clock, s.remainder, s.divisor, s.part, s.place,
        s.backward, s.begin, s.theta,
    )  # fmt: skip


@kernel
def state_of(v):
    """The state of an array that holds its fields."""
    return State(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11], v[12], v[13])


def _turning(rng, clocks, gaps, still):
    """Rows of so many clocks with an edge after each of the gaps, sector by sector, samples at any time."""
    rows, sector = [], int(rng.integers(6))
    middle = tuple(((2 * k + 1) * (1 << TURN_W) + 6) // 12 for k in range(6))
    for gap, move in gaps:
        if len(rows) >= clocks:
            break
        at = len(rows)
        sector = (sector + move) % 6
        rows += [still | {"theta_hall": middle[sector]} for _ in range(gap)]
        rows[at]["step_up"], rows[at]["step_down"] = int(move == 1), int(move == -1)
        rows[at]["skipped"] = int(abs(move) > 1)
        for k in range(int(rng.integers(TAKES + 3)), gap, TAKES + int(rng.integers(5))):
            rows[at + k]["sample"] = 1
    return rows


def stimuli(rng, config):
    """Constant speeds, sectors longer and shorter than the last, reversals, trembling, rests, skipped sectors."""
    still = {p.name: 0 for p in BLOCK.inputs}
    longest = (1 << config["TIME_W"]) - 1
    rows = [still | {"theta_hall": 1234, "sample": int(k % 30 == 3)} for k in range(100)]
    for move in (1, -1):
        for gap in (1, 2, 37, 128, 301):
            rows += _turning(rng, 2500, [(gap, move)] * 8, still)
    uneven = [(int(2 ** rng.uniform(0, 9)), int(rng.choice([1, 1, 1, 1, -1, -1, 2]))) for _ in range(60)]
    rows += _turning(rng, 9000, uneven, still)
    rows += _turning(rng, 2000, [(int(rng.integers(1, 60)), (1, -1)[k & 1]) for k in range(40)], still)
    rows += _turning(rng, 1000, [(30 + int(rng.integers(4)), (1, -1)[k & 1]) for k in range(30)], still)
    # A reset between the edges leaves no sector time, however soon the next edge comes
    rows += [still | {"step_up": int(k % 26 in (0, 12)), "sample": int(k % 26 == 5)} for k in range(700)]
    if longest < 5000:
        for gap in (longest - 1, longest, longest + 1, longest // 4, longest // 4 + 2):
            after = [(3 * longest // 4, 1), (gap, 1), (gap, -1)]  # a slow sector, and a slower one behind it
            rows += _turning(rng, 20000, [(70, 1), (gap, 1), *after, (80, -1), (60, -1)], still)
    rows += [still | {"step_up": 1, "sample": 1}] * 3 + [still | {"sample": 1}] * 45
    return rows


BLOCK = Block(
    name="hall_angle",
    folder="encoders",
    paper="none: three Hall sensors, 120 degrees apart",
    step=step,
    inputs=(
        Port("step_up", BIT, doc="1: a sector forward"),
        Port("step_down", BIT, doc="1: a sector backward"),
        Port("skipped", BIT, doc="1: more than one sector at once"),
        Port("theta_hall", TURN, doc="middle of the sector, electrical"),
        Port("sample", BIT, doc="1: compute the angle"),
    ),
    outputs=(Port("theta", TURN, doc="electrical angle of the last sample"),),
    state=State(),
    latency=1,
    clocked=True,
    constants={"TIME_W": TIME_W, "QUOTIENT_W": QUOTIENT_W, "GUARD": GUARD, "HALF_SECTOR": HALF_SECTOR},
    configs=({"TIME_W": TIME_W}, {"TIME_W": 10}),
    too_wide=(0,),
    reference=None,
    bound=None,
    stimuli=stimuli,
)
