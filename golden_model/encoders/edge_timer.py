# SPDX-License-Identifier: BSD-3-Clause
"""Speed of an incremental encoder from the time between its edges, at every speed by the same equation.

    omega_me = k_edge * (counts between two edges) / (clocks between these edges)

The edges are the last one of this sample and the last one of the latest sample that had an edge: many counts at high
speed, one at low speed, so there is no change-over and no step.  Without an edge the shaft has moved less than a count
since the last one, so |omega_me| is at most k_edge / (clocks since the last edge): it falls to zero with time.
An edge after a reversal is the edge passed before, so it moves the shaft by no count: a shaft that trembles on an edge
has no speed.  The first edge after a reset is where counting begins.

``whole_lines`` = 1 measures over whole lines of four counts instead, by line_timer: the counts up to the next multiple
of four, over the clocks from the last edge of the same kind before the window; without an edge at most a line in the
time since the edge a line before the next one.  Uneven counts then do not tremble.  The first line has no speed.

``k_edge`` = 2*pi * pole_pairs * clock_hz / (counts * omega_base); see ``setting``.  ``reverse`` inverts the sense.
Formats: k_edge U(20,12), large for the few edges of Hall sensors; counts MOVED_W (16) bits and clocks TIME_W (24)
bits, both saturating, output PU.  A time beyond TIME_W bits is standstill.
Rounding: the size to nearest, halves away from zero; it saturates at 2 per unit.
A sample takes ``TAKES`` clocks from ``sample`` to ``omega_valid``, one bit of the product or the quotient a clock; a
``sample`` before that is ignored and its edges belong to the next.
"""

import math
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.encoders import line_timer
from golden_model.fixed import Format
from golden_model.formats import BIT, PU
from golden_model.kernel import kernel

K_EDGE = Format(0, 20, 12)
UP = PU.frac_bits - K_EDGE.frac_bits  # from the product's fraction bits to the quotient's, less the rounding bit
TIME_W, MOVED_W, QUOTIENT_W = 24, 16, 19
EVER = (1 << TIME_W) - 1  # a reset leaves the longest time there is
OMEGA_MAX = PU.hi
APART = 48  # clocks between two edges, for the bench
TAKES = MOVED_W + QUOTIENT_W + 4  # with MOVED_W as it is by default
LINE = line_timer.KINDS  # counts
line_step = line_timer.step


class State(NamedTuple):
    seen: int = 0
    forward: int = 0  # direction of the last edge
    elapsed: int = EVER  # clocks since the edge that the next speed starts from
    since: int = EVER  # clocks since the last edge
    edges: int = 0  # 1: this sample has an edge
    span: int = 0  # clocks between the two edges
    moved: int = 0  # counts between the two edges
    clock: int = 0  # of the engine, 0: idle
    measured: int = 0
    negative: int = 0
    factor: int = 0
    divisor: int = 0
    work: int = 0  # product, then remainder and bits still to be divided
    quotient: int = 0
    past: int = 0  # 1: the quotient is above its range
    omega: int = 0
    omega_valid: int = 0
    of_lines: line_timer.State = line_timer.State()
    line_span: int = 0
    line_known: int = 0
    next_span: int = 0
    next_known: int = 0


@kernel
def step(state, step_up, step_down, sample, reverse, k_edge, whole_lines, time_w, moved_w):
    s = state
    time_max, moved_max = (1 << time_w) - 1, (1 << moved_w) - 1
    elapsed, since = min(s.elapsed, time_max), min(s.since, time_max)
    # Clocks of the engine: the product, a check for overflow, the quotient, its limit, the result
    divide_at = moved_w + 1
    limit_at = divide_at + QUOTIENT_W + 1
    edge = step_up or step_down
    take = sample and s.clock == 0
    forward = 1 if step_up else 0
    of_lines, lines = line_step(s.of_lines, step_up, step_down, take, since == time_max, time_w)

    # The window between two samples; an edge at the sample's clock belongs to the next
    base = since if take and s.edges else elapsed
    moved = 0 if take else s.moved
    if edge and s.seen and forward == s.forward:
        moved = min(max(moved + (1 if step_up else -1), -moved_max), moved_max)

    clock, measured, negative = s.clock, s.measured, s.negative
    factor, divisor, work, quotient, past = s.factor, s.divisor, s.work, s.quotient, s.past
    omega, omega_valid = s.omega, 0
    if take:
        clock = 1
        measured = s.edges
        divisor = s.span if s.edges else since
        factor = abs(s.moved) if s.edges else 1
        rest = divisor == time_max
        if whole_lines and s.edges:
            divisor = s.line_span
            factor = min((factor + LINE - 1) & ~(LINE - 1), moved_max & ~(LINE - 1)) if s.line_known else 0
        elif whole_lines and s.next_known:
            factor, divisor = LINE, s.next_span
        if rest:
            factor = 0
        negative = 1 if (s.moved < 0) != (reverse == 1) else 0
        work, quotient = 0, 0
    elif s.clock != 0:
        clock = 0 if s.clock > limit_at else s.clock + 1
        if s.clock < divide_at:
            bit = (s.factor >> (moved_w - 1)) & 1
            factor = (s.factor << 1) & moved_max
            work = 2 * s.work + (k_edge if bit else 0)
        elif s.clock == divide_at:
            past = 1 if (s.work >> (QUOTIENT_W - 1 - UP)) >= s.divisor else 0
            work = 0 if past else s.work << (1 + UP)
        elif s.clock < limit_at:
            top, low = 2 * s.work >> QUOTIENT_W, (2 * s.work) & ((1 << QUOTIENT_W) - 1)
            enough = top >= s.divisor
            work = ((top - s.divisor if enough else top) << QUOTIENT_W) | low
            quotient = 2 * s.quotient + (1 if enough else 0)
        elif s.clock == limit_at:
            size = (s.quotient + 1) >> 1
            quotient = OMEGA_MAX if s.past or size > OMEGA_MAX else size
        else:
            if s.measured:
                omega = -s.quotient if s.negative else s.quotient
            elif abs(s.omega) > s.quotient:
                omega = -s.quotient if s.omega < 0 else s.quotient
            omega_valid = 1
    following = State(
        1 if s.seen or edge else 0,
        forward if edge else s.forward,
        min(base + 1, time_max),
        1 if edge else min(since + 1, time_max),
        1 if edge or (s.edges and not take) else 0,
        base if edge else s.span,
        moved,
        clock,
        measured,
        negative,
        factor,
        divisor,
        work,
        quotient,
        past,
        omega,
        omega_valid,
        of_lines,
        lines[0],
        lines[1],
        lines[2],
        lines[3],
    )
    return following, (omega, omega_valid)


def setting(counts, pole_pairs, clock_hz, omega_base):
    """k_edge of an encoder; omega_base in electrical rad/s.  ValueError where it does not fit the register."""
    real = 2 * math.pi * pole_pairs * clock_hz / (counts * omega_base)
    if not 1 <= real / K_EDGE.lsb <= K_EDGE.hi:
        raise ValueError(f"k_edge = {real:g} of {counts} counts a turn does not fit {K_EDGE}")
    return K_EDGE.to_int(real)


def stimuli(rng, config):
    """Steps from one a clock to none for long, reversals and trembling on an edge, samples too early."""
    return _motion(rng, (60 << 12,), 400)


def patient_stimuli(rng, config):
    """The same with every corner of k_edge, and rests that end beside the longest time, where a bench gets there."""
    longest = (1 << config["TIME_W"]) - 1
    rows = _motion(rng, (0, 1, K_EDGE.hi, 7 << 10, 60 << 12), longest if longest < 5000 else 400)
    if longest < 5000:
        still = {p.name: 0 for p in BLOCK.inputs} | {"k_edge": K_EDGE.hi, "reverse": 0, "whole_lines": 0}
        for rest in range(longest - TAKES - 4, longest + 3):
            rows += [still | {"step_up": 1}] * 2 + [still] * rest
            rows += [still | {"sample": 1}] + [still] * (TAKES + 1)
    for k_edge, gap in factors(rng):
        if gap <= longest:
            still = {p.name: 0 for p in BLOCK.inputs} | {"k_edge": k_edge, "reverse": int(rng.integers(2))}
            still["whole_lines"] = 0
            turn = still | {("step_up", "step_down")[int(rng.integers(2))]: 1}
            rows += [turn] + [still] * gap + [turn] * int(rng.integers(1, 9))
            rows += [still | {"sample": 1}] + [still] * (TAKES + 1)
    return rows + (_at_limit(rng) + _divisions(rng) + _falling(rng) if longest > 2 * APART else [])


def _two_edges(rng, k_edge, apart, after=TAKES + 1):
    """A speed from two edges, in any direction, and clocks after its sample."""
    regs = {p.name: 0 for p in BLOCK.inputs} | {"k_edge": k_edge, "reverse": int(rng.integers(2))}
    regs["whole_lines"] = 0
    turn = regs | {("step_up", "step_down")[int(rng.integers(2))]: 1}
    return [row for rest in (apart - 2, after) for row in [turn, regs | {"sample": 1}, *[regs] * rest]]


def _at_limit(rng):
    """Speeds at the end of their range, or below it by a bit, or beside these."""
    sizes = {OMEGA_MAX - (1 << bit) for bit in range(OMEGA_MAX.bit_length())} | {OMEGA_MAX, OMEGA_MAX + 1}
    sizes = sorted({size + off for size in sizes for off in (-1, 0, 1)})
    return [row for size in sizes for row in _two_edges(rng, size * APART >> UP, APART)]


def _divisions(rng):
    """Quotients of every size that just come out, or miss it by one: there the lowest bit of the dividend counts."""
    rows, by = [], APART + 1  # odd: any remainder occurs
    for bit in range(4, K_EDGE.width - 10):
        for remainder in (0, 1, by - 1):
            k_edge = int(rng.integers(1 << bit, 2 << bit))
            while (k_edge << UP + 1) % by != remainder:
                k_edge += 1
            rows += _two_edges(rng, k_edge, by)
    return rows


def _falling(rng):
    """A speed of every size, then a sample without an edge whose bound is this size or beside it."""
    rows = []
    for bit in range(1, PU.width - 1):
        for off in (-1, 0, 1):
            size = int(rng.integers(1 << bit, min(2 << bit, OMEGA_MAX)))
            rows += _two_edges(rng, size * APART >> UP, APART, 2 * APART - 2)
            regs = rows[-1] | {"k_edge": 2 * (size + off) * APART >> UP}
            rows += [regs | {"sample": 1}] + [regs] * (TAKES + 1)
    return rows


def factors(rng):
    """(k_edge, clocks between edges): each bit of k_edge alone, and with any lower ones, at a speed that shows them."""
    pairs = []
    for bit in range(K_EDGE.width):
        for k_edge in (1 << bit, 1 << bit | int(rng.integers(1 << bit)), int(rng.integers(1 << bit, 2 << bit))):
            shows = 2 << max(bit - K_EDGE.frac_bits, 1)  # clocks at which this speed is within the range
            pairs += [(k_edge, 5), (k_edge, int(rng.integers(shows, 2 * shows)))][: 1 + (shows < 3000)]
    return pairs


def _motion(rng, k_edges, rest):
    """Every kind of motion for each of ``k_edges``, with a rest of that many clocks."""
    rows = []

    def run(clocks, **writes):
        base = {"step_up": 0, "step_down": 0, "sample": 0, "reverse": 0, "k_edge": 60 << 12, "whole_lines": 0}
        rows.extend(base | writes for _ in range(clocks))

    def sample(**writes):
        run(1, sample=1, **writes)
        run(TAKES + 2, **writes)

    sample()
    for k_edge in k_edges:
        for reverse, lines in ((0, 0), (1, 0), (1, 1), (0, 1)):
            regs = {"k_edge": k_edge, "reverse": reverse, "whole_lines": lines}
            for name in ("step_up", "step_down"):
                for gap in (0, 1, 7, 60, 300):
                    for _ in range(max(2, 200 // (gap + 1))):
                        run(1, **{name: 1}, **regs, sample=int(rng.integers(20) == 0))
                        run(gap, **regs)
                    sample(**regs)
                sample(**regs)
                run(rest, **regs)
                sample(**regs)
            for k in range(40):
                run(1, **{("step_up", "step_down")[k & 1]: 1}, **regs)
                run(int(rng.integers(1, 20)), **regs)
                if k % 8 == 0:
                    sample(**regs)
    run(1, step_up=1, sample=1)
    run(30, sample=1)
    run(3, step_up=1, step_down=1)
    sample()
    for name in ("step_up", "step_down", "step_up"):  # uneven counts, samples without an edge between them
        for k in range(60):
            run(1, whole_lines=1, **{name: 1})
            run((5, 90, 31, 62)[k % 4], whole_lines=1)
            if k % 3 == 0:
                sample(whole_lines=1)
        sample(whole_lines=1)
        run(rest, whole_lines=1)
        sample(whole_lines=1)
    return rows


BLOCK = Block(
    name="edge_timer",
    folder="encoders",
    paper="none: speed by the time between edges",
    step=step,
    inputs=(
        Port("step_up", BIT, doc="1: a count forward"),
        Port("step_down", BIT, doc="1: a count backward"),
        Port("sample", BIT, doc="1: compute the speed"),
    ),
    registers=(
        Port("reverse", BIT, doc="1: code counts opposite to the phase order"),
        Port("k_edge", K_EDGE, doc="speed of one count a clock"),
        Port("whole_lines", BIT, doc="1: over whole lines of four counts, which uneven counts do not disturb"),
    ),
    outputs=(
        Port("omega_me", PU, doc="electrical speed"),
        Port("omega_valid", BIT, doc="1: omega_me is that of the last sample"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={
        "TIME_W": TIME_W,
        "MOVED_W": MOVED_W,
        "QUOTIENT_W": QUOTIENT_W,
        "UP": UP,
    },
    configs=({"TIME_W": TIME_W, "MOVED_W": MOVED_W}, {"TIME_W": 10, "MOVED_W": 4}, {"TIME_W": 12, "MOVED_W": 6}),
    too_wide=(0,),
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
