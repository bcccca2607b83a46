# SPDX-License-Identifier: BSD-3-Clause
"""What the encoder and the converters said at one sample, for software to read word by word.

``take_snapshot`` asks for it; the next ``sample_valid`` takes all values at once and sets ``snap_ready``.  They stay
until the next one is asked for, which clears ``snap_ready``.  Raw codes: with the offsets of the registers they are the
currents of the sample; ``snap_code`` is the encoder's own, also while the host forces the position.
Formats: codes right-aligned.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.encoders import position_front
from golden_model.encoders.turn_counter import COUNT
from golden_model.fixed import Format
from golden_model.formats import BIT, CODE, TURN
from golden_model.io.current_conditioning import code_format
from golden_model.io.position import code_format as turn_format
from golden_model.kernel import kernel

CODES = ("a", "b", "c", "u_dc")
RAW = Format(0, CODE.width, 0)


class State(NamedTuple):
    wanted: int = 0
    ready: int = 0
    code: int = 0
    used: int = 0
    count: int = 0
    flags: int = 0
    adc_a: int = 0
    adc_b: int = 0
    adc_c: int = 0
    adc_u_dc: int = 0


@kernel
def step(
    state, sample_valid, take_snapshot, encoder_code, position_code, encoder_count, encoder_flags, adc_a, adc_b, adc_c,
    adc_u_dc, *_widths,
):  # fmt: skip
    s = state
    taken = 1 if s.wanted and sample_valid else 0
    following = State(
        1 if take_snapshot or (s.wanted and not taken) else 0,
        1 if (taken or s.ready) and not take_snapshot else 0,
        encoder_code if taken else s.code,
        position_code if taken else s.used,
        encoder_count if taken else s.count,
        encoder_flags if taken else s.flags,
        adc_a if taken else s.adc_a,
        adc_b if taken else s.adc_b,
        adc_c if taken else s.adc_c,
        adc_u_dc if taken else s.adc_u_dc,
    )
    f = following
    return following, (f.ready, f.code, f.used, f.count, f.flags, f.adc_a, f.adc_b, f.adc_c, f.adc_u_dc)


def stimuli(rng, config):
    """Requests before, at and after samples, two in a row; values that change at every clock."""
    ports = BLOCK.ports(config)
    rows = []
    for often in (3, 20):
        for k in range(800):
            row = {p.name: int(rng.integers(p.high + 1)) for p in ports}
            row |= {"sample_valid": int(k % 17 == 3), "take_snapshot": int(rng.integers(often) == 0)}
            rows.append(row)
    return rows


BLOCK = Block(
    name="board_snapshot",
    folder="io",
    paper="none: commissioning",
    step=step,
    inputs=(
        Port("sample_valid", BIT, doc="1: all of the sample is there"),
        Port("take_snapshot", BIT, doc="1: keep what the next sample brings"),
        Port("encoder_code", Format(0, 0, 16), doc="position code of the encoder"),
        Port("position_code", Format(0, 0, 16), doc="position code of the sample"),
        Port("encoder_count", COUNT, doc="count of the encoder"),
        Port("encoder_flags", position_front.FLAGS, doc="flags of the encoder"),
        *(Port(f"adc_{x}", CODE, doc=f"ADC code, {x}") for x in CODES),
    ),
    outputs=(
        Port("snap_ready", BIT, doc="1: the snapshot is there"),
        Port("snap_code", TURN, doc="snapshot: position code of the encoder, right-aligned"),
        Port("snap_position", TURN, doc="snapshot: position code of the sample, right-aligned"),
        Port("snap_count", COUNT, doc="snapshot: count of the encoder"),
        Port("snap_flags", position_front.FLAGS, doc="snapshot: flags of the encoder, see position_front"),
        *(Port(f"snap_adc_{x}", RAW, doc=f"snapshot: ADC code, {x}, right-aligned") for x in CODES),
    ),
    state=State(),
    latency=1,
    clocked=True,
    configs=({"ADC_BITS": 16, "POSITION_BITS": 16}, {"ADC_BITS": 12, "POSITION_BITS": 18}),
    width_from={f"adc_{x}": code_format for x in CODES} | {"encoder_code": turn_format, "position_code": turn_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
