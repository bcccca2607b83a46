# SPDX-License-Identifier: BSD-3-Clause
"""The count at each index of an incremental encoder: the first one refers it, later ones find and mend lost counts.

    off = count + pending at the index, the shorter way round; it should be 0

* Until ``referenced`` an index is a candidate, remembered by its count and not followed.  The next one within
  ``correct_max`` of it confirms it, if the shaft was farther away meanwhile: the same place, passed twice.  Then the
  count is corrected at once (``fast``) and ``referenced`` set.  A spike on Z is no second pass of itself, and a Z that
  is stuck never lets the shaft away.  With ``index_once`` = 1 the first index is enough.
* Before that, ``start`` moves the count to ``start_count`` in the same way, for instance to that of a Hall sensor.
* At a later index an ``off`` up to ``correct_max`` is counted in ``lost_counts`` (saturates), flagged by ``index_lost``
  and corrected by one count a sample.  A larger one is flagged by ``index_wrong`` and not corrected; clearing it makes
  the next index a candidate.
An index or a start that comes while one is in work, five clocks, is ignored.  ``restart`` forgets the reference.
Formats: counts.  Rounding: none.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.encoders.quadrature_decoder import EVENTS, EVENTS_MAX
from golden_model.encoders.turn_counter import COUNT, COUNTS, PENDING, PENDING_W
from golden_model.fixed import Format, saturate
from golden_model.formats import BIT
from golden_model.kernel import kernel

CORRECT = Format(0, 12, 0)


class State(NamedTuple):
    wait: int = 0  # stage in work, 0: idle
    starting: int = 0  # it is a start, not an index
    target: int = 0  # what the count should be: 0 at the index
    found: int = 0  # count as if the correction were complete
    candidate: int = 0  # count at the index that waits for its second pass
    seen: int = 0  # 1: there is one
    away: int = 0  # 1: the shaft was farther from it than correct_max
    apart: int = 0  # from the candidate
    off: int = 0  # the same, less what it should be
    correct: int = 0
    correction: int = 0
    fast: int = 0
    referenced: int = 0
    index_count: int = 0
    lost_counts: int = 0
    index_lost: int = 0
    index_wrong: int = 0


@kernel
def step(state, index, count, pending, start, start_count, restart, clear_faults, counts, correct_max, index_once):
    s = state
    # Stage 0: an index, which came with a step that the count has at stage 1, or a start
    take = s.wait == 0 and (index or (start and not s.referenced))
    wait = 1 if take else (s.wait + 1) % 5 if s.wait != 0 else 0
    starting = (0 if index else 1) if take else s.starting
    target = (0 if index else start_count) if take else s.target
    # Stage 1: found
    found = count + pending
    index_count = count if s.wait == 1 and not s.starting else s.index_count
    # Stage 2: off, and apart
    apart = s.found - s.candidate
    off = s.found - s.target
    if not s.starting and 2 * s.found > counts:
        off = s.found - counts
    # Stage 3: start, first index, count that is off, or none of them
    now = s.wait == 3
    lost = abs(s.off)
    size = s.apart if s.apart >= 0 else -1 - s.apart
    near = size <= correct_max or size + correct_max >= counts
    tried = now and not s.starting and not s.referenced
    first = tried and (index_once or (s.seen and s.away and near))
    mend = now and not s.starting and s.referenced and 0 < lost <= correct_max
    wrong = now and not s.starting and s.referenced and lost > correct_max
    fast = first or (now and s.starting)

    lost_counts = 0 if clear_faults else s.lost_counts
    referenced = 1 if first or (s.referenced and not (s.index_wrong and clear_faults)) else 0
    forgotten = restart or first or (s.index_wrong and clear_faults)
    following = State(
        0 if restart else wait,
        starting,
        target,
        found,
        s.index_count if tried else s.candidate,
        0 if forgotten else (1 if tried or s.seen else 0),
        0 if forgotten or s.wait >= 3 else (1 if s.away or not near else 0),  # apart follows the candidate by a clock
        apart,
        off,
        1 if (fast or mend) and not restart else 0,
        saturate(-s.off, PENDING_W),
        1 if fast else 0,
        0 if restart else referenced,
        index_count,
        min(lost_counts + (lost if mend else 0), EVENTS_MAX),
        1 if mend or (s.index_lost and not clear_faults) else 0,
        1 if wrong or (s.index_wrong and not clear_faults) else 0,
    )
    f = following
    return following, (
        f.correct,
        f.correction,
        f.fast,
        f.referenced,
        f.index_count,
        f.lost_counts,
        f.index_lost,
        f.index_wrong,
    )


def stimuli(rng, config):
    """First and later indices with losses of every size, starts before and after, two at once, until it saturates."""
    rows = []
    still = {p.name: 0 for p in BLOCK.inputs}

    def run(clocks, **writes):
        rows.extend(still | {"counts": 60, "correct_max": 6, "index_once": 1} | writes for _ in range(clocks))

    for _ in range(3):
        for start_count in (0, 7, COUNT.hi):
            run(1, start=1, start_count=start_count, count=5)
            run(6, start_count=start_count, count=6)
        run(1, index=1, start=1, count=9)
        run(6, count=10, start=1)
        for count in (0, 1, 59, 6, 54, 7, 53, 30, 31):
            for pending in (0, 3, -3):
                run(1, index=1, count=count, pending=pending, start=int(rng.integers(2)))
                run(int(rng.integers(1, 8)), start_count=9, count=count, pending=pending, index=int(rng.integers(2)))
                run(6)
        run(2, clear_faults=1)
        run(1, index=1, count=33)
        run(5, count=33)
        run(1, restart=1)
    big = {"counts": 1 << 18, "correct_max": CORRECT.hi}
    run(1, index=1, **big)
    run(6, **big)
    for lost in (CORRECT.hi - 3, 2, 2, CORRECT.hi):
        run(1, index=1, count=lost, **big)
        run(6, count=lost, **big)
    for stage in range(6):
        run(1, index=1, count=3)
        run(stage, count=3)
        run(1, count=3, restart=1)
        run(3, count=3)
    return rows + _second_passes(rng)


def _second_passes(rng):
    """Candidates met again at every distance, with and without a way in between; a stuck Z; starts on the way."""
    rows = []

    def show(count, clocks=1, **more):
        rows.extend(
            {p.name: 0 for p in BLOCK.inputs} | {"counts": 60, "correct_max": 6, "index_once": 0, "count": count} | more
            for _ in range(clocks)
        )

    for first in (0, 3, 30, 57):
        for off in (0, 1, -1, 6, 7, -6, -7, -8, 29, 30, 31):
            for way in (0, 6, 7, -7, -8, 20):
                again = (first + off) % 60
                show(first, index=1, restart=0)
                show(first, 7)
                show((first + way) % 60, int(rng.integers(1, 9)), start=int(rng.integers(9) == 0), start_count=7)
                show(first, int(rng.integers(1, 7)))
                show(again, index=1)
                show(again, int(rng.integers(3, 9)))
                show(again, clear_faults=int(rng.integers(2)), restart=int(rng.integers(4) > 0))
    for count in (*range(0, 60, 4), *range(0, 20, 4)):
        show(count, index=1)
        show(count, 6)
    return rows


def patient_stimuli(rng, config):
    """A count at half a turn and beside it, with turns of any counts: which way round is shorter."""
    rows = []
    still = {p.name: 0 for p in BLOCK.inputs}
    for bit in range(2, COUNTS.width):
        for _ in range(8):
            counts = int(rng.integers(1 << bit, 2 << bit))
            regs = {"counts": counts, "correct_max": CORRECT.hi, "index_once": 1}
            for count in (counts // 2, counts // 2 + 1, (counts + 1) // 2):
                row = still | regs | {"count": count}
                rows += [row | {"index": 1}] + [row] * 6 + [row | {"restart": 1}]
    for bit in range(COUNT.width):  # a candidate at each bit, met again at the largest distance that counts, or beyond
        for off in (0, 1):
            most = int(rng.integers(1, CORRECT.hi))
            row = still | {"counts": 1 << 18, "correct_max": most, "index_once": 0}
            for sign in (1, -1):
                places = (1 << bit, (1 << bit) + (1 << 17), (1 << bit) + sign * (most + off))
                for place, index in zip(places, (1, 0, 1), strict=True):
                    here = row | {"count": place % (1 << 18)}
                    rows += [here | {"index": index}] + [here] * 6
                rows += [row | {"restart": 1}]
    return rows


BLOCK = Block(
    name="index_check",
    folder="encoders",
    paper="none: incremental encoder",
    step=step,
    inputs=(
        Port("index", BIT, doc="1: the index was entered with the step that is in the count at the next clock"),
        Port("count", COUNT, doc="count now"),
        Port("pending", PENDING, doc="counts of the correction still to be added"),
        Port("start", BIT, doc="1: move to start_count, before the first index only"),
        Port("start_count", COUNT, doc="count to start from"),
        Port("restart", BIT, doc="1: the count began again"),
        Port("clear_faults", BIT, doc="1: clear lost_counts and the flags"),
    ),
    registers=(
        Port("counts", COUNTS, doc="counts a turn, four for each line"),
        Port("correct_max", CORRECT, doc="largest correction at an index, counts"),
        Port("index_once", BIT, doc="1: the first index is believed, 0: the second at the same place"),
    ),
    outputs=(
        Port("correct", BIT, doc="1: take the correction"),
        Port("correction", PENDING, doc="counts to be added"),
        Port("fast", BIT, doc="1: add them at once, a count a clock"),
        Port("referenced", BIT, doc="1: the index has been found and believed"),
        Port("index_count", COUNT, doc="count found at the last index"),
        Port("lost_counts", EVENTS, doc="counts found lost, saturates"),
        Port("index_lost", BIT, doc="1: an index found lost counts"),
        Port("index_wrong", BIT, doc="1: an index was off by more than correct_max"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
