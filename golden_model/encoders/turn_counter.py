"""Steps to the count within a turn of ``counts`` and to the position code; an index finds and mends lost counts.

    code = round((count + 1/2) * 2**POSITION_BITS / counts), modulo one turn

The middle of a count is the code: the shaft is never more than half a count away.  Nothing is multiplied: code and
``rest`` are quotient and remainder of a division by 2*counts, and a step adds that of 2*2**POSITION_BITS, which software
writes as ``code_step`` = floor(2**POSITION_BITS / counts) and ``code_rest``, its remainder.  The code is exact at every count.
``code_theta`` is latched by ``sample``.

* The first index makes the count 0 at the index; the correction takes a count a clock, the shorter way (``moving``).
  ``start`` moves the count to ``start_count`` in the same way before that, for instance to that of a Hall sensor.
* At a later index a count other than 0 is counted in ``lost_counts`` (saturates), flagged by ``index_lost`` and
  corrected by one count a sample.  A difference above ``correct_max`` is flagged by ``index_wrong`` and not corrected;
  clearing it makes the next index a first one.
* A new setting starts again.  One with fewer than 4 or more than 2**18 counts, or a remainder not below them, is
  refused (``setting_refused``) and the count stays 0.
Formats: counts.  Rounding: half up, exact.  The code wraps, because angles wrap; so does the count.
"""

from typing import NamedTuple

from fluxproof.golden_model.block import Block, Port
from fluxproof.golden_model.encoders.quadrature_decoder import EVENTS, EVENTS_MAX
from fluxproof.golden_model.fixed import Format, wrap
from fluxproof.golden_model.formats import BIT
from fluxproof.golden_model.io.position import code_format
from fluxproof.golden_model.kernel import kernel

COUNTS = Format(0, 19, 0)
COUNT = Format(0, 18, 0)
CODE_STEP = Format(0, 17, 0)
CORRECT = Format(0, 12, 0)
COUNTS_MIN, COUNTS_MAX = 4, 1 << 18


class State(NamedTuple):
    counts: int = 0
    code_step: int = 0
    code_rest: int = 0
    refused: int = 0
    count: int = 0
    code: int = 0
    rest: int = 0
    pending: int = 0  # counts still to be added by the correction
    moving: int = 0
    referenced: int = 0
    index_1: int = 0
    index_2: int = 0
    index_3: int = 0
    index_count: int = 0
    found_2: int = 0  # count at the index, as if the correction were complete
    off_3: int = 0  # the same, the shorter way round
    lost_counts: int = 0
    index_lost: int = 0
    index_wrong: int = 0
    code_theta: int = 0


@kernel
def step(
    state,
    step_up,
    step_down,
    index,
    sample,
    start,
    start_count,
    clear_faults,
    counts,
    code_step,
    code_rest,
    correct_max,
    position_bits,
):
    s = state
    good = COUNTS_MIN <= counts <= COUNTS_MAX and code_rest < counts
    begin = not good or counts != s.counts or code_step != s.code_step or code_rest != s.code_rest

    # A step of the encoder, else one count of the correction
    stepped = step_up or step_down
    correct = s.pending != 0 and not stepped and not start and (sample or s.moving)
    up = step_up or (correct and s.pending > 0)
    down = not up and (step_down or correct)

    count, code, rest = s.count, s.code, s.rest
    if up:
        count = 0 if s.count == s.counts - 1 else s.count + 1
        rest = s.rest + 2 * s.code_rest
        past = rest >= 2 * s.counts
        code = wrap(s.code + s.code_step + (1 if past else 0), position_bits)
        rest -= 2 * s.counts if past else 0
    elif down:
        count = s.counts - 1 if s.count == 0 else s.count - 1
        rest = s.rest - 2 * s.code_rest
        past = rest < 0
        code = wrap(s.code - s.code_step - (1 if past else 0), position_bits)
        rest += 2 * s.counts if past else 0

    # Stage 1: the index came with a step, which the count has now
    index_1 = 1 if index and not (s.index_1 or s.index_2 or s.index_3) else 0
    # Stage 2: found = count at the index
    index_count = s.count if s.index_1 else s.index_count
    found_2 = s.count + s.pending
    # Stage 3: off = found, the shorter way round
    off_3 = s.found_2 - s.counts if 2 * s.found_2 > s.counts else s.found_2
    # Stage 4: the first index, or a count that is off
    lost = abs(s.off_3)
    first = s.index_3 and not s.referenced
    mend = s.index_3 and s.referenced and 0 < lost <= correct_max
    wrong = s.index_3 and s.referenced and lost > correct_max

    pending, moving = s.pending, 1 if s.moving and s.pending != 0 else 0
    if correct:
        pending += -1 if up else 1
    if first or mend:
        pending -= s.off_3
    if start and not s.referenced:
        pending = start_count - s.count
    if first or (start and not s.referenced):
        moving = 1

    lost_counts = 0 if clear_faults else s.lost_counts
    lost_counts = min(lost_counts + (lost if mend else 0), EVENTS_MAX)
    index_lost = 1 if mend or (s.index_lost and not clear_faults) else 0
    index_wrong = 1 if wrong or (s.index_wrong and not clear_faults) else 0
    referenced = 1 if first or (s.referenced and not (s.index_wrong and clear_faults)) else 0
    index_2, index_3 = s.index_1, s.index_2
    if begin:
        count, pending, moving, referenced = 0, 0, 0, 0
        index_1, index_2, index_3 = 0, 0, 0
        code = wrap((code_step + 1) >> 1, position_bits)
        rest = code_rest + (0 if code_step & 1 else counts)
    following = State(
        counts if good else s.counts,
        code_step if good else s.code_step,
        code_rest if good else s.code_rest,
        0 if good else 1,
        count,
        code,
        rest,
        pending,
        moving,
        referenced,
        index_1,
        index_2,
        index_3,
        index_count,
        found_2,
        off_3,
        lost_counts,
        index_lost,
        index_wrong,
        s.code if sample else s.code_theta,
    )
    f = following
    return following, (
        f.code_theta,
        f.count,
        f.referenced,
        f.moving,
        f.index_count,
        f.lost_counts,
        f.index_lost,
        f.index_wrong,
        f.refused,
    )


def setting(counts, position_bits):
    """The registers of an encoder of ``counts`` counts a turn; ValueError where the block would refuse it."""
    if not COUNTS_MIN <= counts <= COUNTS_MAX:
        raise ValueError(f"an encoder of {counts} counts a turn: {COUNTS_MIN} to {COUNTS_MAX} are possible")
    code_step, code_rest = divmod(1 << position_bits, counts)
    return {"counts": counts, "code_step": code_step, "code_rest": code_rest}


def stimuli(rng, config):
    """Whole turns of odd and even counts, an index with lost counts of every size, starts, settings that are refused."""
    bits = config["POSITION_BITS"]
    rows = []
    still = {p.name: 0 for p in BLOCK.inputs} | {"correct_max": 6}

    def run(clocks, regs, **writes):
        rows.extend(still | regs | writes for _ in range(clocks))

    def turn(regs, steps, **writes):
        """Steps with gaps, samples at random clocks, an index when the count that was meant passes 0."""
        for _ in range(abs(steps)):
            run(1, regs, **{"step_up" if steps > 0 else "step_down": 1} | writes)
            run(int(rng.integers(3)), regs, sample=int(rng.integers(2)))

    for counts in (4, 5, 24, 33, 100, 1 << 18, 250000):
        regs = setting(counts, bits)
        run(3, regs)
        turn(regs, min(counts, 40) + 3)
        turn(regs, -2 * min(counts, 40))
        run(1, regs, start=1, start_count=counts // 3)
        run(60, regs, sample=1)
        run(1, regs, index=1)
        run(60, regs, sample=1)
        for lost in (0, 1, -1, 5, -5, 7, 0):
            turn(regs, lost)
            run(1, regs, index=1, step_up=1)
            run(8, regs, index=1)
            run(6, regs, sample=1, step_up=int(lost > 0))
            run(20, regs, sample=1)
            run(1, regs, step_down=1)
            run(1, regs, start=1, start_count=2)
        run(1, regs, clear_faults=1)
        run(1, regs, index=1)
        run(20, regs, sample=1)
    good = setting(24, bits)
    for bad in ({"counts": 3}, {"counts": COUNTS_MAX + 1}, {"code_rest": 24}, {"code_step": 1}, {"code_rest": 1}):
        run(1, good, start=1, start_count=9)
        run(20, good, sample=1)
        run(3, good | bad, sample=1, step_up=1)
        run(3, good, sample=1)
    regs = setting(1 << 18, bits) | {"correct_max": CORRECT.hi}
    run(1, regs)
    run(10, regs, index=1)
    for lost in (EVENTS_MAX - 3, 2, 2):  # until lost_counts saturates
        run(lost, regs, step_up=1)
        run(6, regs, index=1)
        run(lost + 4, regs, sample=1)
    run(2, regs, clear_faults=1)
    return rows


BLOCK = Block(
    name="turn_counter",
    folder="encoders",
    paper="none: incremental encoder",
    step=step,
    inputs=(
        Port("step_up", BIT, doc="1: a count forward"),
        Port("step_down", BIT, doc="1: a count backward"),
        Port("index", BIT, doc="1: the index was entered with this step"),
        Port("sample", BIT, doc="1: latch the code"),
        Port("start", BIT, doc="1: move to start_count, before the first index only"),
        Port("start_count", COUNT, doc="count to start from"),
        Port("clear_faults", BIT, doc="1: clear lost_counts and the flags"),
    ),
    registers=(
        Port("counts", COUNTS, doc="counts a turn, four for each line"),
        Port("code_step", CODE_STEP, doc="2**POSITION_BITS / counts, whole part"),
        Port("code_rest", COUNT, doc="2**POSITION_BITS / counts, remainder"),
        Port("correct_max", CORRECT, doc="largest correction at an index, counts"),
    ),
    outputs=(
        Port("code_theta", Format(0, 0, 16), doc="position code of the last sample"),
        Port("count", COUNT, doc="count now, 0 at the index"),
        Port("referenced", BIT, doc="1: the index has been found"),
        Port("moving", BIT, doc="1: on the way to a start or to the first index"),
        Port("index_count", COUNT, doc="count found at the last index"),
        Port("lost_counts", EVENTS, doc="counts found lost, saturates"),
        Port("index_lost", BIT, doc="1: an index found lost counts"),
        Port("index_wrong", BIT, doc="1: an index was off by more than correct_max"),
        Port("setting_refused", BIT, doc="1: counts or code_rest are impossible"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 12}, {"POSITION_BITS": 18}),
    width_from={"code_theta": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
