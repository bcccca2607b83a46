# SPDX-License-Identifier: BSD-3-Clause
"""Steps to the count within a turn of ``counts`` and to the position code; corrections that do not jump.

    code = round((count + 1/2) * 2**POSITION_BITS / counts), modulo one turn

The middle of a count is the code: the shaft is never more than half a count away.  Nothing is multiplied: code and
``rest`` are quotient and remainder of a division by 2*counts, and a step adds that of 2*2**POSITION_BITS, which
software writes as ``code_step`` = floor(2**POSITION_BITS / counts) and ``code_rest``, its remainder.  The code is exact
at every count.  ``code_theta`` is latched by ``sample``; it follows the count by a clock.

``correct`` adds ``correction`` to ``pending``, the counts still to be added.  They are added one by one between the
steps of the encoder: one at each sample, or with ``fast`` one at each clock until none is left (``moving``).
A new setting starts again at count 0 (``restarted``).  One with fewer than 4 or more than 2**18 counts, or a remainder
not below them, is refused (``setting_refused``) and the count stays 0.
Formats: counts.  Rounding: half up, exact.  Code and count wrap, because angles wrap; ``pending`` saturates.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, saturate, wrap
from golden_model.formats import BIT
from golden_model.io.position import code_format
from golden_model.kernel import kernel

COUNTS = Format(0, 19, 0)
COUNT = Format(0, 18, 0)
CODE_STEP = Format(0, 17, 0)
PENDING = Format(1, 19, 0)
PENDING_W = PENDING.width
COUNTS_MIN, COUNTS_MAX = 4, 1 << 18


class State(NamedTuple):
    counts: int = 0
    code_step: int = 0
    code_rest: int = 0
    count: int = 0
    code: int = 0
    rest: int = 0
    pending: int = 0
    moving: int = 0
    moved_1: int = 0  # the count's last move: 1, 0 or -1
    past_1: int = 0  # 1: rest has passed its end
    restarted: int = 0
    refused: int = 0
    code_theta: int = 0


@kernel
def step(
    state,
    step_up,
    step_down,
    sample,
    correct,
    correction,
    fast,
    counts,
    code_step,
    code_rest,
    position_bits,
):
    s = state
    good = COUNTS_MIN <= counts <= COUNTS_MAX and code_rest < counts
    restart = not good or counts != s.counts or code_step != s.code_step or code_rest != s.code_rest

    # A step of the encoder, else one count of the correction
    stepped = step_up or step_down
    mend = s.pending != 0 and not stepped and not correct and (sample or s.moving)
    up = step_up or (mend and s.pending > 0)
    down = not up and (step_down or mend)

    # Stage 1: count, rest and the carry to the code
    sign = 1 if up else -1
    moved_1 = sign if up or down else 0
    total = s.rest + sign * 2 * s.code_rest
    past_1 = 1 if (total >= 2 * s.counts if up else total < 0) else 0
    count, rest = s.count, s.rest
    if moved_1 != 0:
        count = s.count + sign
        if up and s.count == s.counts - 1:
            count = 0
        elif not up and s.count == 0:
            count = s.counts - 1
        rest = total - sign * 2 * s.counts if past_1 else total
    # Stage 2: code
    code = wrap(s.code + s.moved_1 * (s.code_step + s.past_1), position_bits)

    pending = s.pending
    if mend:
        pending += -1 if up else 1
    if correct:
        pending = saturate(s.pending + correction, PENDING_W)
    moving = 1 if (correct and fast) or (s.moving and s.pending != 0) else 0
    if restart:
        count, pending, moving, moved_1 = 0, 0, 0, 0
        code = wrap((code_step + 1) >> 1, position_bits)
        rest = code_rest + (0 if code_step & 1 else counts)
    following = State(
        counts if good else s.counts,
        code_step if good else s.code_step,
        code_rest if good else s.code_rest,
        count,
        code,
        rest,
        pending,
        moving,
        moved_1,
        past_1,
        1 if restart else 0,
        0 if good else 1,
        s.code if sample else s.code_theta,
    )
    f = following
    return following, (f.code_theta, f.count, f.pending, f.moving, f.restarted, f.refused)


def setting(counts, position_bits):
    """The registers of an encoder of ``counts`` counts a turn; ValueError where the block would refuse it."""
    if not COUNTS_MIN <= counts <= COUNTS_MAX:
        raise ValueError(f"an encoder of {counts} counts a turn: {COUNTS_MIN} to {COUNTS_MAX} are possible")
    code_step, code_rest = divmod(1 << position_bits, counts)
    return {"counts": counts, "code_step": code_step, "code_rest": code_rest}


def stimuli(rng, config):
    """Turns of odd and even counts, corrections of every size among steps and samples, settings that are refused."""
    bits = config["POSITION_BITS"]
    rows = []
    still = {p.name: 0 for p in BLOCK.inputs}

    def run(clocks, regs, **writes):
        rows.extend(still | regs | writes for _ in range(clocks))

    def turn(regs, steps):
        for _ in range(abs(steps)):
            run(1, regs, **{"step_up" if steps > 0 else "step_down": 1})
            run(int(rng.integers(3)), regs, sample=int(rng.integers(2)))

    for counts in (4, 5, 24, 33, 100, COUNTS_MAX, 250000):
        regs = setting(counts, bits)
        run(3, regs)
        turn(regs, min(counts, 40) + 3)
        turn(regs, -2 * min(counts, 40))
        for correction in (1, -1, 7, -7, PENDING.hi, PENDING.lo):
            for fast in (0, 1):
                run(1, regs, correct=1, correction=correction, fast=fast)
                run(1, regs, correction=3, fast=1)
                turn(regs, 6)
                run(20, regs, sample=1, step_down=int(rng.integers(2)))
                run(1, regs, correct=1, correction=-correction - (correction == PENDING.lo), fast=fast, sample=1)
                run(20, regs)
                turn(regs, -4)
    good = setting(24, bits)
    for bad in ({"counts": 3}, {"counts": COUNTS_MAX + 1}, {"code_rest": 24}, {"code_step": 1}, {"code_rest": 1}):
        run(1, good, correct=1, correction=9, fast=1)
        run(20, good, sample=1)
        run(3, good | bad, sample=1, step_up=1)
        run(3, good, sample=1)
    return rows


BLOCK = Block(
    name="turn_counter",
    folder="encoders",
    paper="none: incremental encoder",
    step=step,
    inputs=(
        Port("step_up", BIT, doc="1: a count forward"),
        Port("step_down", BIT, doc="1: a count backward"),
        Port("sample", BIT, doc="1: latch the code"),
        Port("correct", BIT, doc="1: take the correction"),
        Port("correction", PENDING, doc="counts to be added"),
        Port("fast", BIT, doc="1: add them at once, a count a clock"),
    ),
    registers=(
        Port("counts", COUNTS, doc="counts a turn, four for each line"),
        Port("code_step", CODE_STEP, doc="2**POSITION_BITS / counts, whole part"),
        Port("code_rest", COUNT, doc="2**POSITION_BITS / counts, remainder"),
    ),
    outputs=(
        Port("code_theta", Format(0, 0, 16), doc="position code of the last sample"),
        Port("count", COUNT, doc="count now, 0 at the index"),
        Port("pending", PENDING, doc="counts of the correction still to be added"),
        Port("moving", BIT, doc="1: on the way to a start or to the first index"),
        Port("restarted", BIT, doc="1: the count began again at 0"),
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
