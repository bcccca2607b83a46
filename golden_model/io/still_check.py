# SPDX-License-Identifier: BSD-3-Clause
"""Whether the position code stands although the shaft cannot have stopped: a frozen sensor, or a shaft that jammed.

    turned = code(k) - code(k-1);  least = the one of turned and mean nearer to zero;  mean += (turned - mean)/4
    v(k)   = v(k-1) + (least - v(k-1), at most slow_turn either way)     speed that changes no faster than a shaft can
    moved  = |code - anchor| >= still_turn                               then anchor = code
    owed   = 0 if moved or v turns against it, else owed + v             code that should have come since, and did not
    stands = |owed| >= 3*still_turn + 2*slow_turn, gates on

``slow_turn`` is the largest deceleration, so v is the least speed that a shaft has that was braked since the code moved
last, and owed the least angle.  A stop, a reversal and a shaft at rest brake no harder: nothing is owed.  Less than a
code a sample is a speed by the mean; a stop shows at once; noise of the code moves v by slow_turn a sample at most.
Whether the sensor is frozen or the shaft jammed, emf_check decides: a jammed shaft has no EMF.
``omega_was`` is |omega_me| of the sample in which the code moved last.  ``stands`` ends when the code moves, and after
1,022 samples.  ``still_turn`` = 0: off.  After a reset and with ``position_restart`` speed and anchor begin anew.

Formats: codes in 2**-18 turn, v and owed in 2**-26 turn, a difference is the shorter angle.  |x| is the one's
complement where x is negative.  mean is cut (floor); owed saturates at two turns, the count of samples at 1,023.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, clamp, saturate, wrap_s
from golden_model.formats import BIT, PU, TURN_W
from golden_model.io.position import code_format
from golden_model.io.sample_checks import reaches
from golden_model.kernel import kernel

STILL = Format(0, -1, 18)
SLOW = Format(0, -6, 26)
SPEED_MAX = Format(0, 1, 16)  # |omega_me|
SHIFT = SLOW.frac_bits - TURN_W
OWED_W = SLOW.frac_bits + 2
AGE = Format(0, 10, 0)
MEAN = 2  # 2**MEAN samples
STILL_TIMES, SLOW_TIMES = 3, 2
AGE_HI = AGE.hi


class State(NamedTuple):
    seen: int = 0  # 1: a code since the reset
    code: int = 0  # of the last sample, in 2**-18 turn
    anchor: int = 0  # where the code moved last
    mean: int = 0  # of what the code turned by, 2**-26 turn a sample
    v: int = 0  # 2**-26 turn a sample
    owed: int = 0  # 2**-26 turn
    was: int = 0
    age: int = 0  # samples since owed reached its limit


@kernel
def step(state, code_theta, omega_me, run, position_restart, still_turn, slow_turn, position_bits):
    s = state
    code = code_theta << (TURN_W - position_bits)
    begins = not s.seen or position_restart
    turned = wrap_s(code - s.code, TURN_W) << SHIFT
    moved = begins or reaches(wrap_s(code - s.anchor, TURN_W), still_turn)
    mean = 0 if begins else s.mean + ((turned - s.mean) >> MEAN)
    least = min(turned, s.mean) if s.mean >= 0 else max(turned, s.mean)
    v = 0 if begins else s.v + clamp(least - s.v, -slow_turn, slow_turn)
    back = (s.owed > 0 and v < 0) or (s.owed < 0 and v > 0)
    owed = 0 if moved or back else saturate(s.owed + v, OWED_W)
    off = still_turn != 0 and reaches(owed, (STILL_TIMES * still_turn << SHIFT) + SLOW_TIMES * slow_turn)
    age = min(s.age + 1, AGE_HI) if off and run else 0
    size = omega_me if omega_me >= 0 else -1 - omega_me
    was = size if moved else s.was
    following = State(1, code, code if moved else s.anchor, mean, v, owed, was, age)
    return following, (1 if 0 < age < AGE_HI else 0, was)


def stimuli(rng, config):
    """Turns that freeze, brake as fast as allowed and a little faster, reverse, tremble, pass zero, restart."""
    size = 1 << config["POSITION_BITS"]
    unit = 1 << (TURN_W - config["POSITION_BITS"])
    usual = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"run": 1, "still_turn": 2 * unit}
    rows, place = [], 0.0
    for slow in (0.02, 0.3, 2.0):  # codes a sample, each
        regs = usual | {"slow_turn": round(slow * unit * (1 << SHIFT))}
        for speed in (0.4, 1.0, 7.3, -2.6, -40.0):
            for brake in (0.0, 0.5, 1.0, 1.05, 3.0, 1e9):
                v = speed
                for k in range(60 if abs(speed) < 20 else 130):
                    if brake and k > 30:
                        v = (-1.0 if v < 0.0 else 1.0) * max(abs(v) - brake * slow, 0.0)
                    place = (place + v) % size
                    omega = int(clamp(round(v * 900), PU.lo, PU.hi))
                    rows.append(regs | {"code_theta": int(place), "omega_me": omega})
                rows.append(regs | {"code_theta": int(place), "position_restart": int(brake == 0.5)})
    for most in (1, 3 * unit, STILL.hi):  # a random walk of the code, gates and restarts now and then
        for bits in (3, 9, 17):
            row = usual | {"still_turn": most, "slow_turn": int(rng.integers(1 << bits))}
            for _ in range(90):
                place = (place + int(rng.integers(-3, 9)) * (rng.integers(4) > 0)) % size
                row = row | {"code_theta": int(place), "omega_me": int(rng.integers(PU.lo, PU.hi))}
                rows.append(row | {"run": int(rng.integers(9) > 0), "position_restart": int(rng.integers(40) == 0)})
    for still in (0, 1, 2 * unit):  # off, and the sum at its limit and beside it
        for owed in range(-1, 2):
            slow = (still << SHIFT + 1) + owed
            row = usual | {"still_turn": still, "slow_turn": max(slow, 0)}
            rows += [row | {"position_restart": 1}, *[row | {"code_theta": unit * k % size} for k in range(9)]]
            rows += [row | {"code_theta": unit * 8 % size}] * 12
    return rows


def patient_stimuli(rng, config):
    """A suspicion to its end, sums to saturation in both directions, limits of any bits."""
    size = 1 << config["POSITION_BITS"]
    usual = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"run": 1}
    rows = []
    for sign in (1, -1):
        row = usual | {"still_turn": 1, "slow_turn": 1 << 14}
        rows += [row | {"code_theta": sign * 5 * k % size} for k in range(400)]
        rows += [row | {"code_theta": sign * 5 * 399 % size}] * (AGE_HI + 40)
        row |= {"still_turn": STILL.hi, "slow_turn": SLOW.hi}
        rows += [row | {"code_theta": sign * size // 3 * k % size, "position_restart": int(k == 9)} for k in range(300)]
    for bit in range(SLOW.width):
        slow = int(rng.integers(1 << bit, 2 << bit))
        for still in (1 << min(bit, STILL.width - 1), int(rng.integers(1, STILL.hi))):
            row, fast = usual | {"still_turn": still, "slow_turn": slow}, int(rng.integers(1, size // 3))
            rows += [row | {"code_theta": fast * k % size} for k in range(12)]
            rows += [row | {"code_theta": fast * 11 % size}] * 12
    return rows


BLOCK = Block(
    name="still_check",
    folder="io",
    paper="none: protection and diagnosis of the drive",
    step=step,
    inputs=(
        Port("code_theta", Format(0, 0, 16), doc="position code, one mechanical turn"),
        Port("omega_me", PU, doc="electrical speed"),
        Port("run", BIT, doc="1: gates are switching"),
    ),
    registers=(
        Port("position_restart", BIT, doc="1: the code has nothing to do with the one of the sample before"),
        Port("still_turn", STILL, doc="a code that changes by less stands; 0: no check of a code that stands"),
        Port("slow_turn", SLOW, doc="largest deceleration, turns of the code a sample squared"),
    ),
    outputs=(
        Port("stands", BIT, doc="1: the code stands although the shaft cannot have stopped"),
        Port("omega_was", SPEED_MAX, doc="size of the electrical speed when the code moved last"),
    ),
    state=State(),
    latency=8,
    interval=8,
    constants={
        "SHIFT": SHIFT,
        "OWED_W": OWED_W,
        "MEAN": MEAN,
        "STILL_TIMES": STILL_TIMES,
        "SLOW_TIMES": SLOW_TIMES,
    },
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 12}, {"POSITION_BITS": 18}),
    width_from={"code_theta": code_format},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
