# SPDX-License-Identifier: BSD-3-Clause
"""The zero of the current sensors: mean of each phase's current while the gates are off and the shaft stands.

    mean_x = sum of WINDOW samples of i_x / WINDOW;   current_offset = |mean_x| >= offset_max in any phase

Evaluated after each WINDOW consecutive samples with run = 0 and |omega_me| < omega_stall: no current can flow then,
what the sensors show is their error.  Between two windows, and while the drive runs, the last verdict stays.

Formats: currents are cut (floor) to 12 fraction bits, the mean likewise: up to two steps, 2/4096 per unit, too low; |x|
is the one's complement where x is negative.  The sum holds every window.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import BIT, LIMIT, PU
from golden_model.io.sample_checks import DROP_LIMIT, reaches
from golden_model.kernel import kernel

WINDOW_BITS = 6
OFFSET = Format(0, -2, 12)
DROP_FINE = PU.frac_bits - OFFSET.frac_bits
LAST = (1 << WINDOW_BITS) - 1


class State(NamedTuple):
    sum_a: int = 0
    sum_b: int = 0
    sum_c: int = 0
    count: int = 0  # samples in the sums
    found: int = 0  # verdict of the last window


@kernel
def step(state, i_a, i_b, i_c, omega_me, run, omega_stall, offset_max):
    s = state
    still = not run and not reaches(omega_me >> DROP_LIMIT, omega_stall)
    sum_a = (s.sum_a if s.count else 0) + (i_a >> DROP_FINE)
    sum_b = (s.sum_b if s.count else 0) + (i_b >> DROP_FINE)
    sum_c = (s.sum_c if s.count else 0) + (i_c >> DROP_FINE)
    found = s.found
    if still and s.count == LAST:
        off_a = reaches(sum_a >> WINDOW_BITS, offset_max)
        off_b = reaches(sum_b >> WINDOW_BITS, offset_max)
        found = 1 if off_a or off_b or reaches(sum_c >> WINDOW_BITS, offset_max) else 0
    count = (s.count + 1) & LAST if still else 0
    return State(sum_a, sum_b, sum_c, count, found), (found,)


def stimuli(rng, _config):
    """Means at the limit and one step beside it in each phase, both signs; noise; windows cut by motion and by run."""
    calm = {"i_a": 0, "i_b": 0, "i_c": 0, "omega_me": 0, "run": 0, "omega_stall": 3, "offset_max": 20}
    rows = [calm]
    for phase in "abc":
        for near in (-1, 0, 1, 15, 16, 17):
            for level in (20 * 16 + near, -(21 * 16 + near)):
                rows += [calm | {f"i_{phase}": level}] * (LAST + 1)
    for _ in range(4):
        rows += [calm | {f"i_{x}": int(rng.normal(300, 400)) for x in "abc"} for _ in range(LAST + 1)]
    for cut in ({"run": 1}, {"omega_me": 3 << 8}, {"omega_me": -(3 << 8) - 1}):
        rows += [calm | {"i_b": 2000}] * (LAST - 3) + [calm | cut] + [calm | {"i_b": 2000}] * (LAST + 1)
        rows += [calm | cut | {"i_b": 0}] * 3 + [calm] * (LAST + 1)
    for end in (PU.lo, PU.hi):
        rows += [calm | {"i_a": end, "i_b": end, "i_c": end, "offset_max": OFFSET.hi}] * (LAST + 1)
    return [*rows, *[calm | {"offset_max": 0}] * (LAST + 2)]


BLOCK = Block(
    name="offset_check",
    folder="io",
    paper="none: protection and diagnosis of the drive",
    step=step,
    inputs=tuple(Port(f"i_{x}", PU, doc=f"current, phase {x}") for x in "abc")
    + (
        Port("omega_me", PU, doc="electrical speed"),
        Port("run", BIT, doc="1: gates are switching"),
    ),
    registers=(
        Port("omega_stall", LIMIT, doc="speed below which the shaft stands"),
        Port("offset_max", OFFSET, doc="mean current of a phase at rest that trips: the sensor's zero is wrong"),
    ),
    outputs=(Port("current_offset", BIT, doc="1: the zero of a current sensor is wrong"),),
    state=State(),
    latency=4,
    interval=4,
    constants={"WINDOW_BITS": WINDOW_BITS, "DROP_FINE": DROP_FINE},
    reference=None,
    bound=None,
    stimuli=stimuli,
)
