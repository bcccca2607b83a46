# SPDX-License-Identifier: BSD-3-Clause
"""A position code for each sample from an absolute encoder: delay compensated, bad frames bridged, then a trip.

    good frame since the last sample:  place(k) = code,  delta(k) = delta + (code - place(k-1) - delta) / n
    none:                              place(k) = place(k-1) + delta,  one more sample is bridged
    code_theta(k) = place(k) + delay * delta

``delay`` is the time from the instant at which the encoder latches its position to the sampling instant of the
currents, in samples; it includes the frame where that ends after the sample.  The first good frame after a bridge holds
the error of the whole bridge: n is 1 without a bridge, 2 after one bridged sample, 4 after two or three; after more
delta is kept.  So delta follows where every second frame is bad.
More than ``bridge_max`` samples without a good frame set ``position_lost``, which stays until ``clear_faults``; so does
an encoder that never answered.  ``position_valid`` is 1 from the first good frame on.
Formats: codes of POSITION_BITS, modulo one turn; delay U(2,16).  Rounding: delay * delta half up, a part of an
error is cut (floor).
``code_theta`` and ``code_valid`` follow ``sample`` after ``TAKES`` clocks; samples are at least as far apart.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.encoders.quadrature_decoder import EVENTS, EVENTS_MAX
from golden_model.fixed import Format, round_half_up, wrap, wrap_s
from golden_model.formats import BIT
from golden_model.io.position import code_format
from golden_model.kernel import kernel

DELAY = Format(0, 2, 16)
DROP = DELAY.frac_bits
BRIDGE = Format(0, 8, 0)
BRIDGE_MAX = BRIDGE.hi
LONGEST = 3  # bridged samples whose error still tells delta
TAKES = 4


class State(NamedTuple):
    fresh: int = 0  # 1: a good frame since the last sample
    frame: int = 0  # its code
    seen: int = 0
    place: int = 0
    delta: int = 0
    missing: int = 0  # samples since the last good frame
    valid_1: int = 0
    product_2: int = 0
    valid_2: int = 0
    ahead_3: int = 0
    valid_3: int = 0
    code: int = 0
    code_valid: int = 0
    position_lost: int = 0
    bridged_count: int = 0


@kernel
def step(state, frame_code, frame_valid, sample, clear_faults, delay, bridge_max, position_bits):
    s = state
    fresh = 1 if frame_valid or (s.fresh and not sample) else 0
    frame = frame_code if frame_valid else s.frame
    place, delta, seen, missing = s.place, s.delta, s.seen, s.missing
    bridge = sample and not s.fresh
    # Stage 1: place and delta
    if sample and s.fresh:
        place, seen, missing = s.frame, 1, 0
        if s.seen and s.missing <= LONGEST:
            error = wrap_s(s.frame - s.place - s.delta, position_bits)
            delta = wrap_s(s.delta + (error >> min(s.missing, 2)), position_bits)
    elif sample:
        place = wrap(s.place + s.delta, position_bits)
        missing = min(s.missing + 1, BRIDGE_MAX)
    # Stage 2: delay * delta.  Stage 3: rounded
    product_2 = s.delta * delay
    ahead_3 = round_half_up(s.product_2, DROP)

    lost = bridge and s.missing >= bridge_max
    counted = 0 if clear_faults else s.bridged_count
    following = State(
        fresh,
        frame,
        seen,
        place,
        delta,
        missing,
        1 if sample else 0,
        product_2,
        s.valid_1,
        ahead_3,
        s.valid_2,
        wrap(s.place + s.ahead_3, position_bits) if s.valid_3 else s.code,
        s.valid_3,
        1 if lost or (s.position_lost and not clear_faults) else 0,
        min(counted + (1 if bridge else 0), EVENTS_MAX),
    )
    f = following
    return following, (f.code, f.code_valid, f.seen, f.position_lost, f.bridged_count)


def stimuli(rng, config):
    """Constant speeds through the turn's end with gaps of every length, every delay, no frame at all."""
    size = 1 << config["POSITION_BITS"]
    rows = []
    still = {"frame_code": 0, "frame_valid": 0, "sample": 0, "clear_faults": 0, "delay": 1 << 15, "bridge_max": 3}

    def run(clocks, **writes):
        rows.extend(still | writes for _ in range(clocks))

    place = 0
    for _ in range(6):
        run(1, sample=1, bridge_max=4)
        run(TAKES, bridge_max=4)
    run(1, clear_faults=1)
    for delay in (0, 1, 1 << 15, 1 << 16, DELAY.hi):
        for speed in (0, 3, -3, size // 100, -size // 100, size // 2 - 1, -size // 2):
            for gap in (0, 0, 0, 1, 2, 3, 4, 0):
                for missing in range(gap + 1):
                    place += speed
                    if missing == gap:
                        run(1, frame_code=place % size, frame_valid=1, delay=delay)
                    run(int(rng.integers(3)), frame_code=int(rng.integers(size)), delay=delay)
                    run(1, sample=1, delay=delay)
                    run(TAKES, delay=delay)
            run(1, clear_faults=1, delay=delay)
    for bridged in (1, 1, 1, 2, 3, 4, 1, 2, 3, 4):  # frames that come every so often, at speeds that change
        for k in range(8):
            place += int(rng.integers(-size // 40, size // 40))
            run(1, frame_code=place % size, frame_valid=1, bridge_max=9)
            for _ in range(bridged + (k == 5)):
                run(1, sample=1, bridge_max=9)
                run(TAKES, bridge_max=9)
    run(1, frame_valid=1, sample=1, frame_code=5)
    run(300, sample=1, bridge_max=BRIDGE_MAX)
    run(EVENTS_MAX, sample=1)
    run(1, sample=1, clear_faults=1)
    run(3)
    return rows


BLOCK = Block(
    name="position_bridge",
    folder="encoders",
    paper="none: absolute encoders",
    step=step,
    inputs=(
        Port("frame_code", Format(0, 0, 16), doc="position code of a good frame"),
        Port("frame_valid", BIT, doc="1: frame_code is new"),
        Port("sample", BIT, doc="1: a sample begins"),
        Port("clear_faults", BIT, doc="1: clear position_lost and bridged_count"),
    ),
    registers=(
        Port("delay", DELAY, doc="transport delay, samples"),
        Port("bridge_max", BRIDGE, doc="samples that may be bridged one after the other"),
    ),
    outputs=(
        Port("code_theta", Format(0, 0, 16), doc="position code of the sample"),
        Port("code_valid", BIT, doc="1: code_theta is that of the last sample"),
        Port("position_valid", BIT, doc="1: there has been a good frame"),
        Port("position_lost", BIT, doc="1: more than bridge_max samples without a good frame"),
        Port("bridged_count", EVENTS, doc="samples without a good frame, saturates"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"DROP": DROP},
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 12}, {"POSITION_BITS": 18}),
    width_from={"frame_code": code_format, "code_theta": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
