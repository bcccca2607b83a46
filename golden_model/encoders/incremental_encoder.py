# SPDX-License-Identifier: BSD-3-Clause
"""An incremental encoder from its pins to code and speed: three filters, decoder, counter, index and edge timer, wired.

Nothing is computed here.  The blocks are one register apart, as in the VHDL: a step reaches the counter and the timer
one clock after the decoder has seen it.  From a pin to the count: filter_clocks + 5 clocks, to the code one more.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common import input_filter
from golden_model.encoders import edge_timer, index_check, quadrature_decoder, turn_counter
from golden_model.encoders.edge_timer import MOVED_W, TIME_W
from golden_model.formats import BIT
from golden_model.io.position import code_format
from golden_model.kernel import kernel

filter_step, decoder_step = input_filter.step, quadrature_decoder.step
counter_step, check_step, timer_step = turn_counter.step, index_check.step, edge_timer.step


class State(NamedTuple):
    of_filter_a: input_filter.State = input_filter.State()
    of_filter_b: input_filter.State = input_filter.State()
    of_filter_z: input_filter.State = input_filter.State()
    of_decoder: quadrature_decoder.State = quadrature_decoder.State()
    of_counter: turn_counter.State = turn_counter.State()
    of_check: index_check.State = index_check.State()
    of_timer: edge_timer.State = edge_timer.State()
    # Outputs that the next clock reads
    step_up: int = 0
    step_down: int = 0
    index: int = 0
    count: int = 0
    pending: int = 0
    restarted: int = 0
    correct: int = 0
    correction: int = 0
    fast: int = 0


@kernel
def step(state, inputs, regs, position_bits):
    x, r = inputs, regs
    s = state
    filter_a, (_, _) = filter_step(s.of_filter_a, x.pin_a, r.filter_clocks)
    filter_b, (_, _) = filter_step(s.of_filter_b, x.pin_b, r.filter_clocks)
    filter_z, (_, _) = filter_step(s.of_filter_z, x.pin_z, r.filter_clocks)
    settled = 1 if s.of_filter_a.settled and s.of_filter_b.settled and s.of_filter_z.settled else 0

    decoder, (step_up, step_down, forward, index, _, illegal_count) = decoder_step(
        s.of_decoder,
        s.of_filter_a.level,
        s.of_filter_b.level,
        s.of_filter_z.level,
        settled,
        x.clear_faults,
        r.index_phase,
    )
    counter, (code_theta, count, pending, moving, restarted, setting_refused) = counter_step(
        s.of_counter,
        s.step_up,
        s.step_down,
        x.sample,
        s.correct,
        s.correction,
        s.fast,
        r.counts,
        r.code_step,
        r.code_rest,
        position_bits,
    )
    check, (correct, correction, fast, referenced, index_count, lost_counts, index_lost, index_wrong) = check_step(
        s.of_check,
        s.index,
        s.count,
        s.pending,
        x.start,
        x.start_count,
        s.restarted,
        x.clear_faults,
        r.counts,
        r.correct_max,
        r.index_once,
    )
    timer, (omega_me, omega_valid) = timer_step(
        s.of_timer, s.step_up, s.step_down, x.sample, r.reverse, r.k_edge, r.whole_lines, TIME_W, MOVED_W
    )
    following = State(
        filter_a,
        filter_b,
        filter_z,
        decoder,
        counter,
        check,
        timer,
        step_up,
        step_down,
        index,
        count,
        pending,
        restarted,
        correct,
        correction,
        fast,
    )
    return following, (
        code_theta,
        omega_me,
        omega_valid,
        count,
        forward,
        referenced,
        moving,
        index_count,
        illegal_count,
        lost_counts,
        index_lost,
        index_wrong,
        setting_refused,
    )


def stimuli(rng, config):
    """Turns in both directions with an index, bounce on every edge, a lost line, a start, samples all the while."""
    rows = []
    counts = 60
    regs = {"filter_clocks": 2, "index_phase": 1, "correct_max": 9, "index_once": 0, "reverse": 0, "k_edge": 900 << 12}
    regs |= turn_counter.setting(counts, config["POSITION_BITS"]) | {"whole_lines": 0}
    still = {p.name: 0 for p in BLOCK.inputs} | regs

    def show(place, clocks, **more):
        a, b = quadrature_decoder.lines(place)
        z = int(place % counts in (0, 1, 2))
        for k in range(clocks):
            bounce = int(k == 1 and rng.integers(3) == 0)
            row = {"pin_a": a ^ bounce, "pin_b": b, "pin_z": z, "sample": int(rng.integers(60) == 0)}
            rows.append(still | row | more)

    show(7, 12)
    show(7, 1, start=1, start_count=20)
    show(7, 30)
    for place in [*range(7, 200), *range(200, -90, -1), *range(-90, 40)]:
        show(place, int(rng.integers(5, 9)))
    for place in [*range(40, 55), *range(59, 90), *range(90, 50, -1)]:
        show(place, 6)
    still["whole_lines"] = 1
    for place in [*range(50, 110), *range(110, 50, -1)]:
        show(place, int(rng.integers(5, 20)))
    show(50, 1, clear_faults=1)
    show(50, 60)
    return rows


def patient_stimuli(rng, config):
    """Back and forth over the index while the shaft slips: losses of every size, at correct_max or far from it."""
    rows, slip = [], 0
    still = {p.name: 0 for p in BLOCK.inputs} | {"filter_clocks": 1, "index_phase": 1, "k_edge": 900 << 16}
    still |= {"index_once": 1, "whole_lines": 0}
    for turn in range(160):
        if turn % 40 == 0:
            counts = int(rng.integers(1000, 6000))
            still |= turn_counter.setting(counts, config["POSITION_BITS"]) | {"reverse": turn // 40 & 1}
        lost, way = int(2 ** rng.uniform(0, 10)) % (counts // 2), int(rng.choice([-1, 1]))
        for _ in range(lost):  # the shaft turns, its index with it: the count is off when it comes again
            slip += way
            a, b = quadrature_decoder.lines(slip + (8 if turn % 2 == 0 else -6))
            rows.append(still | {"pin_a": a, "pin_b": b})
        still["correct_max"] = lost + int(rng.integers(-1, 2)) if rng.integers(2) else lost ^ 1 << int(rng.integers(12))
        still["correct_max"] = max(still["correct_max"], 0)
        for place in range(-6, 9) if turn % 2 else range(8, -7, -1):
            a, b = quadrature_decoder.lines(place + slip)
            row = still | {"pin_a": a, "pin_b": b, "pin_z": int(place in (0, 1, 2))}
            rows += [row | {"sample": int(rng.integers(60) == 0)} for _ in range(5)]
    return rows + _speeds(rng, config)


def _speeds(rng, config):
    """Each bit of k_edge at a speed that shows it; then as many illegal steps as a counter's bits need."""
    rows, place = [], 0
    still = {p.name: 0 for p in BLOCK.inputs} | turn_counter.setting(4000, config["POSITION_BITS"])
    still |= {"filter_clocks": 1, "index_phase": 1, "correct_max": 9, "reverse": 0, "whole_lines": 0}

    def show(clocks, **more):
        a, b = quadrature_decoder.lines(place)
        rows.extend([still | {"pin_a": a, "pin_b": b} | more] * clocks)

    for k_edge, gap in edge_timer.factors(rng):
        still["k_edge"] = k_edge
        for clocks in (gap, 6):
            place += int(rng.integers(2)) or 1
            show(clocks)
        show(1, sample=1)
        show(edge_timer.TAKES + 4)
    for _ in range(1100):
        place += 2
        show(4)
    return rows


_PORTS = {
    p.name: p
    for module in (edge_timer, turn_counter, index_check, quadrature_decoder, input_filter)
    for p in module.BLOCK.inputs + module.BLOCK.registers + module.BLOCK.outputs
}

INPUTS = (
    Port("pin_a", BIT, doc="A, asynchronous pin"),
    Port("pin_b", BIT, doc="B, asynchronous pin"),
    Port("pin_z", BIT, doc="Z, asynchronous pin"),
    *(_PORTS[name] for name in ("sample", "start", "start_count", "clear_faults")),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = tuple(
    _PORTS[name]
    for name in (
        "filter_clocks",
        "index_phase",
        "counts",
        "code_step",
        "code_rest",
        "correct_max",
        "index_once",
        "reverse",
        "k_edge",
        "whole_lines",
    )
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="incremental_encoder",
    folder="encoders",
    paper="none: incremental encoder",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=tuple(
        _PORTS[name]
        for name in (
            "code_theta",
            "omega_me",
            "omega_valid",
            "count",
            "forward",
            "referenced",
            "moving",
            "index_count",
            "illegal_count",
            "lost_counts",
            "index_lost",
            "index_wrong",
            "setting_refused",
        )
    ),
    state=State(),
    latency=1,
    clocked=True,
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 12}),
    width_from={"code_theta": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
