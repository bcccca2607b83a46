# SPDX-License-Identifier: BSD-3-Clause
"""A position that the host gives, standing or turning, in place of the encoder's: for commissioning.

    place(k) = forced_angle + travelled(k);  travelled(k) = travelled(k-1) + forced_rate while position_source stays 1

The source of a sample is that of its ``sample`` strobe, so it cannot change within a sample.  ``position_restart``
tells the core that a code has nothing to do with the one before: the source has changed, the host has moved
``forced_angle``, or the encoder says so (``encoder_restart``).  With a forced position the speed is that of the code:
``speed_now`` is ``speed_given`` of the encoder alone.
Formats: angles in turns of the shaft, as the encoder's code: place U(0,32), wraps; forced_rate in 2**-32 turn a sample.
The code follows ``sample`` by two clocks, the encoder's code by one.  Rounding: the bits below the code are cut.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, wrap
from golden_model.formats import BIT, TURN, TURN_W
from golden_model.io.position import code_format
from golden_model.kernel import kernel

RATE = Format(1, -7, 32)
PLACE_W = RATE.frac_bits
SHIFT = PLACE_W - TURN_W


class State(NamedTuple):
    source: int = 0  # of the last sample
    angle: int = 0
    travelled: int = 0
    jumped: int = 0  # 1: source or angle are not those of the sample before
    code: int = 0
    restart: int = 0
    speed_now: int = 0


@kernel
def step(
    state, encoder_code, encoder_restart, speed_given, sample, position_source, forced_angle, forced_rate,
    position_bits,
):  # fmt: skip
    s = state
    source, angle, travelled, jumped = s.source, s.angle, s.travelled, s.jumped
    if sample:
        source, angle = position_source, forced_angle
        travelled = wrap(s.travelled + forced_rate, PLACE_W) if s.source and position_source else 0
        moved = position_source and forced_angle != s.angle
        jumped = 1 if position_source != s.source or moved else 0
    place = wrap((s.angle << SHIFT) + s.travelled, PLACE_W)
    following = State(
        source,
        angle,
        travelled,
        jumped,
        place >> (PLACE_W - position_bits) if s.source else encoder_code,
        1 if s.jumped or (encoder_restart and not s.source) else 0,
        1 if speed_given and not s.source else 0,
    )
    f = following
    return following, (f.code, f.restart, f.speed_now, f.source)


def setting(rad_per_s, sample_time_s):
    """forced_rate of a speed of the shaft; ValueError where it does not fit the register."""
    rate = rad_per_s * sample_time_s / 6.283185307179586
    if not RATE.lo <= round(rate / RATE.lsb) <= RATE.hi:
        raise ValueError(f"forced_rate: {rad_per_s:g} rad/s is {rate:g} turns a sample, at most 1/128 is possible")
    return round(rate / RATE.lsb)


def stimuli(rng, config):
    """Standing and turning in both directions, the angle moved, sources changed between and at samples."""
    rows = []
    row = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers}
    top = (1 << config["POSITION_BITS"]) - 1
    turns = ((0, 5, 7), (1, 5, 7), (1, 5, RATE.hi), (1, 5, RATE.lo), (1, TURN.hi, RATE.hi), (0, 0, 1))
    for source, angle, rate in turns:
        row |= {"position_source": source, "forced_angle": angle, "forced_rate": rate}
        for k in range(200):
            changes = {"encoder_code": int(rng.integers(top + 1)), "encoder_restart": int(rng.integers(9) == 0)}
            changes |= {"speed_given": k >> 4 & 1, "sample": int(rng.integers(4) == 0)}
            rows.append(row | changes)
    return rows


BLOCK = Block(
    name="forced_position",
    folder="encoders",
    paper="none: commissioning",
    step=step,
    inputs=(
        Port("encoder_code", Format(0, 0, 16), doc="position code of the encoder"),
        Port("encoder_restart", BIT, doc="1: it has nothing to do with the one before"),
        Port("speed_given", BIT, doc="1: the speed is omega_given, not that of the code"),
        Port("sample", BIT, doc="1: a sample begins"),
    ),
    registers=(
        Port("position_source", BIT, doc="0: encoder, 1: forced_angle"),
        Port("forced_angle", TURN, doc="angle of the shaft that replaces the encoder's"),
        Port("forced_rate", RATE, doc="what it turns by, turns a sample"),
    ),
    outputs=(
        Port("position_code", Format(0, 0, 16), doc="position code, one mechanical turn"),
        Port("position_restart", BIT, doc="1: the code has nothing to do with the one of the sample before"),
        Port("speed_now", BIT, doc="1: the speed is omega_given, not that of the code"),
        Port("forced", BIT, doc="1: the code is the host's"),
    ),
    state=State(),
    latency=1,
    clocked=True,
    constants={"PLACE_W": PLACE_W, "SHIFT": SHIFT},
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 18}),
    width_from={"encoder_code": code_format, "position_code": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
