# SPDX-License-Identifier: BSD-3-Clause
"""Time over whole lines of an incremental encoder: a time stamp for each of the four edges of a line.

A phase between A and B that is not a quarter, or levels that are not half a line, move the four edges of every line
by the same four angles.  Between two edges of one kind there is a whole number of lines, in which these errors cancel:

    line_span = clocks from the last edge of this kind before the window to the last edge of the window
    next_span = clocks since the edge one line before the one that comes next, in the direction of the last one

A window begins with ``take`` (a sample of edge_timer); an edge at that clock belongs to the new one.  An edge after a
reversal is the edge passed before; a reversal, and a rest of the longest time (``still``), make the stamps of the
others unknown: a line then begins anew, and what trembles over an edge measures none.

Formats: time stamps and spans SPAN_W bits, two more than TIME_W: a line of four counts each of which is below the
longest time.  They wrap, a span is shorter than a turn of the clock.  Nothing is rounded.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT
from golden_model.kernel import kernel

KINDS, SPAN_MORE = 4, 2  # bits of a span above TIME_W


class State(NamedTuple):
    now: int = 0
    seen: int = 0
    forward: int = 0  # direction of the last edge
    kind: int = 0  # of the last edge, of four
    known: int = 0  # a bit for each kind: its last edge is of this run in one direction
    fresh: int = 0  # a bit for each kind: no edge in this window yet
    base_known: int = 0
    last_0: int = 0  # time stamps of the last edge of each kind
    last_1: int = 0
    last_2: int = 0
    last_3: int = 0
    base_0: int = 0  # time stamps of the last edge of each kind before the window
    base_1: int = 0
    base_2: int = 0
    base_3: int = 0
    next_stamp: int = 0
    line_span: int = 0
    line_known: int = 0
    next_known: int = 0


@kernel
def step(state, step_up, step_down, take, still, time_w):
    s = state
    mask = (1 << (time_w + SPAN_MORE)) - 1
    edge = step_up or step_down
    up = 1 if step_up else 0
    turned = s.seen and edge and up != s.forward
    way = 1 if up else 3
    kind = (s.kind + way) % KINDS if edge and s.seen and not turned else s.kind

    known = 0 if still or turned else s.known
    base_known = 0 if still or turned else s.base_known
    fresh = 15 if take else s.fresh
    last = (s.last_0, s.last_1, s.last_2, s.last_3)
    base = (s.base_0, s.base_1, s.base_2, s.base_3)
    line_span, line_known, next_stamp, next_known = s.line_span, s.line_known, s.next_stamp, s.next_known
    first, bit = (fresh >> kind) & 1, 1 << kind
    since = last[kind] if first else base[kind]
    if edge:
        base_known = (base_known & ~bit) | (known & bit) if first else base_known
        line_span, line_known = (s.now - since) & mask, (base_known >> kind) & 1
        known |= bit
        fresh &= ~bit
        following = (kind + way) % KINDS
        next_stamp, next_known = last[following], (known >> following) & 1
    now = s.now
    return State(
        (now + 1) & mask,
        1 if s.seen or edge else 0,
        up if edge else s.forward,
        kind,
        known,
        fresh,
        base_known,
        now if edge and kind == 0 else s.last_0,
        now if edge and kind == 1 else s.last_1,
        now if edge and kind == 2 else s.last_2,
        now if edge and kind == 3 else s.last_3,
        s.last_0 if edge and first and kind == 0 else s.base_0,
        s.last_1 if edge and first and kind == 1 else s.base_1,
        s.last_2 if edge and first and kind == 2 else s.base_2,
        s.last_3 if edge and first and kind == 3 else s.base_3,
        next_stamp,
        line_span,
        line_known,
        next_known,
    ), (line_span, line_known, (now + 1 - next_stamp) & mask, next_known)


def stimuli(rng, config):
    """Turns at every pace in both directions, reversals, windows with no edge, with few and with many, rests."""
    rows, base = [], {p.name: 0 for p in BLOCK.inputs}
    for pace in (1, 2, 3, 7, 20, 60):
        for name in ("step_up", "step_down", "step_up"):
            for _ in range(max(40, 600 // pace)):
                turn = base | {name: 1, "take": int(rng.integers(3) == 0)}
                wait = max(1, int(pace * rng.uniform(0.6, 1.4)))
                rows += [turn] + [base | {"take": int(rng.integers(6) == 0)} for _ in range(wait - 1)]
                if rng.integers(60) == 0:
                    rows += [base | {"still": 1}] * int(rng.integers(1, 4))
    for k in range(60):
        rows += [base | {("step_up", "step_down")[k & 1]: 1}] + [base | {"take": 1}] * int(rng.integers(0, 3))
    return rows


def patient_stimuli(rng, config):
    """Lines that last up to the longest span that the stamps hold, where a bench gets there."""
    rows, longest = [], 1 << config["TIME_W"]
    base = {p.name: 0 for p in BLOCK.inputs}
    if longest <= 4096:
        for count in (longest // 3, longest - 2, longest - 1, longest // 2 + 1):
            for _ in range(7):
                rows += [base | {"step_up": 1}] + [base | {"take": int(k == count // 2)} for k in range(count - 1)]
    return rows + stimuli(rng, config)


def span_format(config):
    """Two bits above those of a count's time."""
    return Format(0, config["TIME_W"] + SPAN_MORE, 0)


BLOCK = Block(
    name="line_timer",
    folder="encoders",
    paper="none: speed by the time over whole lines",
    step=step,
    inputs=(
        Port("step_up", BIT, doc="1: a count forward"),
        Port("step_down", BIT, doc="1: a count backward"),
        Port("take", BIT, doc="1: a window begins"),
        Port("still", BIT, doc="1: no edge for the longest time"),
    ),
    registers=(),
    outputs=(
        Port("line_span", Format(0, 26, 0), doc="clocks over the whole lines that the window's last edge ends"),
        Port("line_known", BIT, doc="1: line_span is valid"),
        Port("next_span", Format(0, 26, 0), doc="clocks since the edge one line before the next one"),
        Port("next_known", BIT, doc="1: next_span is valid"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"SPAN_MORE": SPAN_MORE},
    configs=({"TIME_W": 24}, {"TIME_W": 10}, {"TIME_W": 7}),
    too_wide=(0,),
    width_from={"line_span": span_format, "next_span": span_format},
    shown_with={"line_span": "line_known", "next_span": "next_known"},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
