# SPDX-License-Identifier: BSD-3-Clause
"""The pins of an incremental encoder and of three Hall sensors at an angle.

    count = counts*theta_m               0 to counts - 1; A, B are its Gray code, Z is the count 0
    sector = 6*(theta_e - hall_offset)   Hall codes as in `hall_decoder`: 101, 100, 110, 010, 011, 001

Formats: angles U(0,25) turns, counts U(16,0), products exact, cut (floor) to the count and the sector; angles wrap.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format, wrap
from golden_model.formats import BIT, MOTOR_ANGLE
from golden_model.kernel import kernel

COUNTS = Format(0, 16, 0)
ANGLE_W = MOTOR_ANGLE.width
HALLS = (0b101, 0b001, 0b011, 0b010, 0b110, 0b100)  # a + 2b + 4c of the sectors


@kernel
def step(theta_m, theta_e, counts, hall_offset):
    count = (theta_m * counts) >> ANGLE_W
    phase = count & 3
    hall = HALLS[(6 * wrap(theta_e - hall_offset, ANGLE_W)) >> ANGLE_W]
    pin_a, pin_b = 1 if phase == 1 or phase == 2 else 0, 1 if phase >= 2 else 0
    return pin_a, pin_b, 1 if count == 0 else 0, hall & 1, hall >> 1 & 1, hall >> 2


def stimuli(_rng, _config):
    """Both sides of every edge of a coarse encoder, of the turn, and of every sector."""
    turn = 1 << ANGLE_W
    rows = []
    for counts in (1, 4, 12, 4000, COUNTS.hi):
        for k in (0, 1, 2, 3, 5, counts - 1):
            edge = -(-(k * turn) // counts)
            rows += [{"theta_m": (edge + d) % turn, "counts": counts} for d in (-1, 0)]
    for sector in range(7):
        edge = -(-sector * turn // 6)
        for offset in (0, 1, turn // 5):
            rows += [{"theta_e": (edge + offset + d) % turn, "hall_offset": offset} for d in (-1, 0)]
    return [{p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | row for row in rows]


BLOCK = Block(
    name="motor_encoder",
    folder="motor",
    paper="docs/hil.md: sensors",
    step=step,
    inputs=(
        Port("theta_m", MOTOR_ANGLE, doc="mechanical angle"),
        Port("theta_e", MOTOR_ANGLE, doc="electrical angle"),
    ),
    registers=(
        Port("counts", COUNTS, doc="counts of the encoder in a turn"),
        Port("hall_offset", MOTOR_ANGLE, doc="electrical angle at which the first sector begins"),
    ),
    outputs=(
        Port("pin_a", BIT, doc="encoder, A"),
        Port("pin_b", BIT, doc="encoder, B"),
        Port("pin_z", BIT, doc="encoder, index"),
        *(Port(f"hall_{x}", BIT, doc=f"Hall sensor {x}") for x in "abc"),
    ),
    latency=3,
    interval=1,
    reference=None,
    bound=None,
    stimuli=stimuli,
)
