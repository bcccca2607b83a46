# SPDX-License-Identifier: BSD-3-Clause
"""Three Hall sensors from their pins to a code and a speed: filters, hall_decoder, hall_angle and edge_timer, wired.

Nothing is computed here.  The upper bits of hall_angle's angle are the code of a sensor alone, with ``pole_pairs`` 1;
the speed is that between two sectors, with ``k_edge`` for 6 counts a turn, and comes after the code.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common import input_filter
from golden_model.encoders import edge_timer, hall_angle, hall_decoder
from golden_model.encoders.edge_timer import MOVED_W, TIME_W
from golden_model.encoders.quadrature_decoder import EVENTS
from golden_model.fixed import Format
from golden_model.formats import BIT, TURN_W
from golden_model.io.position import code_format
from golden_model.kernel import kernel

filter_step, hall_step, timer_step = input_filter.step, hall_decoder.step, edge_timer.step
angle_step = hall_angle.step


class State(NamedTuple):
    of_filter_a: input_filter.State = input_filter.State()
    of_filter_b: input_filter.State = input_filter.State()
    of_filter_c: input_filter.State = input_filter.State()
    of_decoder: hall_decoder.State = hall_decoder.State()
    of_angle: hall_angle.State = hall_angle.State()
    of_timer: edge_timer.State = edge_timer.State()
    # Outputs that the next clock reads
    theta_hall: int = 0
    step_up: int = 0
    step_down: int = 0
    skipped: int = 0


@kernel
def step(state, inputs, regs, position_bits):
    x, r = inputs, regs
    s = state
    filter_a, (_, _) = filter_step(s.of_filter_a, x.hall_a, r.filter_clocks)
    filter_b, (_, _) = filter_step(s.of_filter_b, x.hall_b, r.filter_clocks)
    filter_c, (_, _) = filter_step(s.of_filter_c, x.hall_c, r.filter_clocks)
    settled = 1 if s.of_filter_a.settled and s.of_filter_b.settled and s.of_filter_c.settled else 0
    decoder, (
        theta_hall, _, hall_valid, step_up, step_down, start_count, start_valid, illegal_count, skipped_count,
        skipped,
    ) = hall_step(
        s.of_decoder, s.of_filter_a.level, s.of_filter_b.level, s.of_filter_c.level, settled, x.clear_encoder,
        r.hall_reverse, r.hall_offset, r.start_first, r.sector_counts,
    )  # fmt: skip
    angle, (theta,) = angle_step(
        s.of_angle, s.step_up, s.step_down, s.skipped, s.theta_hall, x.sample_trigger, hall_angle.TIME_W
    )
    timer, (omega_me, omega_valid) = timer_step(
        s.of_timer, s.step_up, s.step_down, x.sample_trigger, r.reverse, r.k_edge, 0, TIME_W, MOVED_W
    )
    code = theta >> (TURN_W - position_bits)
    following = State(filter_a, filter_b, filter_c, decoder, angle, timer, theta_hall, step_up, step_down, skipped)
    return following, (
        code, omega_me, omega_valid, hall_valid, start_count, start_valid, illegal_count, skipped_count, skipped,
    )  # fmt: skip


def _still():
    """Usual settings, pins at 0."""
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"k_edge": 900 << 12, "hall_offset": 9999}
    return still | {"filter_clocks": 1, "start_first": 77, "sector_counts": 160}


def stimuli(rng, config):
    """Turns in both directions at three speeds, bounce, a wire that is lost."""
    rows, still = [], _still()
    for k in range(4200):
        sector = (k // 23 if k < 1000 else 43 - k // 40 if k < 2200 else k // 9) % 6
        hall = dict(zip(("hall_a", "hall_b", "hall_c"), hall_decoder.lines(sector), strict=True))
        hall["hall_a"] ^= int(rng.integers(40) == 0)
        hall["hall_b"] &= int(not 3000 < k < 3300)
        rows.append(still | hall | {"sample_trigger": int(k % 61 == 0), "clear_encoder": int(k == 3500)})
    return rows


def patient_stimuli(rng, config):
    """Turns that take long, with other settings in each, so that every bit of k_edge makes a speed; sectors skipped.

    At the end illegal codes and skipped sectors until their counters are full.
    """
    rows, sector = [], 0
    ports = {p.name: p for p in REGISTERS + (_PORTS["k_edge"],)}
    for turn in range(16):
        regs = {name: int(rng.integers(p.high >> int(rng.integers(p.fmt.width)), endpoint=True))
                for name, p in ports.items()} | {"filter_clocks": turn % 4, "reverse": turn & 1}  # fmt: skip
        pause = int(12 * 2 ** rng.uniform(0, 6))
        for _ in range(max(8, 4000 // pause)):
            sector = (sector + int(rng.choice([1, 1, 1, 5, 2, 3]) if turn % 3 == 2 else 1)) % 6
            hall = dict(zip(("hall_a", "hall_b", "hall_c"), hall_decoder.lines(sector), strict=True))
            row = _still() | regs | hall
            rows += [row | {"sample_trigger": int(k % 50 == 20)} for k in range(pause)]
    for k in range(EVENTS.hi + 4):
        for code in (7, (1, 2, 4)[k % 3]):
            pins = {f"hall_{x}": code >> place & 1 for place, x in enumerate("abc")}
            rows.append(_still() | pins | {"filter_clocks": 0})
    return rows


_PORTS = {
    p.name: p
    for module in (edge_timer, hall_decoder, input_filter)
    for p in module.BLOCK.inputs + module.BLOCK.registers + module.BLOCK.outputs
}
REGISTERS = tuple(_PORTS[n] for n in ("filter_clocks", "hall_reverse", "hall_offset", "start_first", "sector_counts"))

INPUTS = (
    *(Port(f"hall_{x}", BIT, doc=f"Hall sensor {x}, asynchronous pin") for x in "abc"),
    Port("sample_trigger", BIT, doc="1: a sample begins"),
    Port("clear_encoder", BIT, doc="1: clear the encoder's faults and counters"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
ALL_REGISTERS = REGISTERS + (_PORTS["reverse"], _PORTS["k_edge"])
Registers = namedtuple("Registers", [p.name for p in ALL_REGISTERS])

BLOCK = Block(
    name="hall_front",
    folder="encoders",
    paper="none: three Hall sensors, 120 degrees apart",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=ALL_REGISTERS,
    outputs=(Port("code_theta", Format(0, 0, 16), doc="angle at the trigger, a few clocks later"),)
    + tuple(_PORTS[n] for n in ("omega_me", "omega_valid", "hall_valid", "start_count", "start_valid"))
    + tuple(_PORTS[n] for n in ("illegal_count", "skipped_count", "skipped")),
    state=State(),
    latency=1,
    clocked=True,
    configs=({"POSITION_BITS": 16},),
    width_from={"code_theta": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
