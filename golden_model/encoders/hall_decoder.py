# SPDX-License-Identifier: BSD-3-Clause
"""Three Hall sensors to the coarse electrical angle, to steps of a sixth turn and to the start of an encoder.

Forward, (a, b, c) = 101, 100, 110, 010, 011, 001 are the sectors 0 to 5; ``hall_reverse`` = 1 counts them the other way
round.  The angle is the middle of the sector, theta_hall = (sector + 1/2)/6 + hall_offset, so it is at most a twelfth
of an electrical turn off.  000 and 111 are illegal: they are counted, the last sector stays and ``hall_valid`` is 0.
A change by more than one sector is no step and is counted as skipped.  Both counters saturate.

    start_count = start_first + round(sector * sector_counts)

is the count of an incremental encoder in the middle of the sector (turn_counter takes it modulo a turn).
Formats: angles TURN, sector_counts U(16,4).  Rounding: the middle of the sector to nearest, the count half up.
``start_count`` follows the sector by two clocks, ``start_valid`` says that it does.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.encoders.quadrature_decoder import EVENTS, EVENTS_MAX
from golden_model.encoders.turn_counter import COUNT
from golden_model.fixed import Format, wrap
from golden_model.formats import BIT, TURN, TURN_W
from golden_model.kernel import kernel

SECTOR_COUNTS = Format(0, 16, 4)
SECTORS = (0, 1, 3, 2, 5, 0, 4, 0)  # of the code a + 2b + 4c
MIDDLE = tuple(((2 * k + 1) * (1 << TURN_W) + 6) // 12 for k in range(6))
HALF = 1 << (SECTOR_COUNTS.frac_bits - 1)


class State(NamedTuple):
    sector: int = 0
    seen: int = 0
    valid: int = 0
    illegal: int = 0  # 1: the code before was illegal, which counts once
    skipped: int = 0
    step_up: int = 0
    step_down: int = 0
    illegal_count: int = 0
    skipped_count: int = 0
    theta: int = 0
    product_1: int = 0
    valid_1: int = 0
    start_count: int = 0
    start_valid: int = 0


@kernel
def step(
    state,
    hall_a,
    hall_b,
    hall_c,
    settled,
    clear_faults,
    hall_reverse,
    hall_offset,
    start_first,
    sector_counts,
):
    s = state
    code = hall_a + 2 * hall_b + 4 * hall_c
    legal = settled and code != 0 and code != 7
    illegal = 1 if settled and not legal else 0
    now = SECTORS[code]
    now = 5 - now if hall_reverse else now
    sector = now if legal else s.sector

    change = sector - s.sector if s.seen else 0
    step_up = 1 if change == 1 or change == -5 else 0
    step_down = 1 if change == -1 or change == 5 else 0
    skipped = 1 if change != 0 and not step_up and not step_down else 0

    illegals = 0 if clear_faults else s.illegal_count
    skips = 0 if clear_faults else s.skipped_count
    following = State(
        sector,
        1 if s.seen or legal else 0,
        1 if legal else 0,
        illegal,
        skipped,
        step_up,
        step_down,
        min(illegals + (1 if illegal and not s.illegal else 0), EVENTS_MAX),
        min(skips + skipped, EVENTS_MAX),
        wrap(MIDDLE[sector] + hall_offset, TURN_W),
        s.sector * sector_counts,
        s.valid,
        start_first + ((s.product_1 + HALF) >> 4),
        s.valid_1,
    )
    f = following
    return following, (
        f.theta,
        f.sector,
        f.valid,
        f.step_up,
        f.step_down,
        wrap(f.start_count, 18),
        f.start_valid,
        f.illegal_count,
        f.skipped_count,
        f.skipped,
    )


def setting(counts, pole_pairs):
    """sector_counts: counts of the incremental encoder in a sixth of an electrical turn."""
    return SECTOR_COUNTS.to_int(counts / (6 * pole_pairs))


def lines(sector):
    """(hall_a, hall_b, hall_c) of a sector."""
    code = {0: 5, 1: 1, 2: 3, 3: 2, 4: 6, 5: 4}[sector % 6]
    return code & 1, code >> 1 & 1, code >> 2


def stimuli(rng, config):
    """Turns in both directions and senses, every pair of codes, illegal codes until their count saturates."""
    rows = []

    def show(code, clocks=1, **more):
        row = {"hall_a": code & 1, "hall_b": code >> 1 & 1, "hall_c": code >> 2, "settled": 1, "clear_faults": 0}
        row |= {"hall_reverse": 0, "hall_offset": 1234, "start_first": 77, "sector_counts": 2667} | more
        rows.extend(dict(row) for _ in range(clocks))

    show(0, clocks=2, settled=0)
    for reverse in (0, 1):
        for direction in (1, -1):
            for k in range(30):
                a, b, c = lines(direction * k)
                show(a + 2 * b + 4 * c, int(rng.integers(1, 5)), hall_reverse=reverse)
    for now in range(8):
        for then in range(8):
            show(now, clocks=2, hall_offset=TURN.hi, sector_counts=SECTOR_COUNTS.hi, start_first=COUNT.hi)
            show(then, clocks=2, hall_offset=0)
    show(1, clear_faults=1)
    for k in range(EVENTS_MAX + 4):
        show(7 if k & 1 else (1, 2)[k >> 1 & 1])
        show((1, 2, 4)[k % 3])
    show(0, clear_faults=1, clocks=3)
    show(6, settled=0, clocks=3)
    return rows


BLOCK = Block(
    name="hall_decoder",
    folder="encoders",
    paper="none: three Hall sensors, 120 degrees apart",
    step=step,
    inputs=(
        Port("hall_a", BIT, doc="sensor a, filtered"),
        Port("hall_b", BIT, doc="sensor b, filtered"),
        Port("hall_c", BIT, doc="sensor c, filtered"),
        Port("settled", BIT, doc="1: the three are valid"),
        Port("clear_faults", BIT, doc="1: clear the counters"),
    ),
    registers=(
        Port("hall_reverse", BIT, doc="1: the sectors count opposite to the phase order"),
        Port("hall_offset", TURN, doc="electrical angle at the beginning of sector 0"),
        Port("start_first", COUNT, doc="count in the middle of sector 0"),
        Port("sector_counts", SECTOR_COUNTS, doc="counts in a sector"),
    ),
    outputs=(
        Port("theta_hall", TURN, doc="electrical angle, middle of the sector"),
        Port("sector", Format(0, 3, 0), doc="sector, 0 to 5"),
        Port("hall_valid", BIT, doc="1: the code is legal"),
        Port("step_up", BIT, doc="1: a sector forward"),
        Port("step_down", BIT, doc="1: a sector backward"),
        Port("start_count", COUNT, doc="count in the middle of the sector"),
        Port("start_valid", BIT, doc="1: start_count is that of a legal code"),
        Port("illegal_count", EVENTS, doc="illegal codes entered, saturates"),
        Port("skipped_count", EVENTS, doc="changes by more than one sector, saturates"),
        Port("skipped", BIT, doc="1: such a change"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    roms={"MIDDLE": (TURN, [*MIDDLE, 0, 0])},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
