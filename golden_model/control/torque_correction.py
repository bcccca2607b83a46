# SPDX-License-Identifier: BSD-3-Clause
"""The correction of the torque table by the estimated torque: a factor, learnt by least mean squares.

    torque_gain += k_torque*(torque_now - torque)*torque_now    within 1/2..3/2, where ``run``, ``calm``,
                                                                |omega_me| >= omega_learn and not ``torque_limited``

The estimated flux linkage has no error in steady state, so its torque corrects the map.  A factor: nothing is learnt at
zero torque and the sign of a torque never changes.  It is held near the voltage circle, where the minimum pulse keeps
legs from switching: their dead time is compensated without being lost, and the estimate is up to 7 % off
(docs/speed_range.md).

Formats: torque_gain U(1,28), of which U(1,16) is shown; the error and its product PU.
Rounding: the error saturates, its product is floored and saturated, the increment rounded half up.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, clamp, round_half_up, saturate
from golden_model.formats import BIT, KI, PU, PU_W
from golden_model.kernel import kernel

TORQUE_GAIN = Format(0, 1, 28)
SHOWN = Format(0, 1, 16)
ONE = 1 << TORQUE_GAIN.frac_bits
DROP_GAIN = TORQUE_GAIN.frac_bits - SHOWN.frac_bits
DROP_STEP = PU.frac_bits + KI.frac_bits - TORQUE_GAIN.frac_bits
PU_BITS = PU.frac_bits


class State(NamedTuple):
    torque_gain: int = ONE


@kernel
def step(state, torque_now, torque, omega_me, torque_limited, calm, run, k_torque, omega_learn):
    error = saturate(torque_now - torque, PU_W)
    pull = saturate((error * torque_now) >> PU_BITS, PU_W)
    torque_gain = state.torque_gain
    if run and calm and not torque_limited and abs(omega_me) >= omega_learn:
        torque_gain = clamp(torque_gain + round_half_up(k_torque * pull, DROP_STEP), ONE // 2, ONE // 2 * 3)
    return State(torque_gain), (torque_gain >> DROP_GAIN,)


def reference(v, state):
    gain = state.torque_gain * TORQUE_GAIN.lsb
    if v["run"] and v["calm"] and not v["torque_limited"] and abs(v["omega_me"]) >= v["omega_learn"]:
        low, high = PU.lo * PU.lsb, PU.hi * PU.lsb
        error = min(max(v["torque_now"] - v["torque"], low), high)
        gain = min(max(gain + v["k_torque"] * min(max(error * v["torque_now"], low), high), 0.5), 1.5)
    return {"torque_gain": gain}


def bound(v, _state):
    return {"torque_gain": v["k_torque"] * PU.lsb + TORQUE_GAIN.lsb + SHOWN.lsb}


def stimuli(rng, _config):
    """Both ends at gains of all sizes, each condition alone, speeds on the border of learning."""
    learns = {"torque_now": 40000, "torque": 12000, "omega_me": 60000, "torque_limited": 0, "calm": 1, "run": 1}
    learns |= {"k_torque": 5000, "omega_learn": 9000}
    rows = []
    for k in range(120):
        sign = 1 if k % 60 < 30 else -1
        given = {"torque_now": 40000 * sign, "torque": int(rng.choice((0, 30000, 80000))), "k_torque": KI.hi >> (k % 8)}
        rows.append({**learns, **given, "run": int(k % 29 > 0)})
    for name in ("torque_limited", "calm", "run"):
        rows += [{**learns, name: bit} for bit in (0, 1)]
    rows += [{**learns, "omega_me": omega} for omega in (0, 8999, 9000, -9000, -8999, PU.lo, PU.hi)]
    ends = (PU.lo, -1, 0, 1, PU.hi)
    rows += [{**learns, "torque_now": a, "torque": b, "k_torque": KI.hi} for a in ends for b in ends]
    for _ in range(100):
        wide = int(2 ** rng.uniform(1, 17))
        row = {"torque_now": int(rng.integers(-wide, wide)), "torque": int(rng.integers(-wide, wide))}
        rows.append({**learns, **row, "k_torque": int(2 ** rng.uniform(0, 24))})
    return rows


BLOCK = Block(
    name="torque_correction",
    folder="control",
    paper="none: docs/speed_range.md",
    step=step,
    inputs=(
        Port("torque_now", PU, doc="torque reference of this sample"),
        Port("torque", PU, doc="estimated torque"),
        Port("omega_me", PU, doc="electrical speed"),
        Port("torque_limited", BIT, doc="1: no more torque at this flux limit"),
        Port("calm", BIT, doc="1: the voltage is well within the circle"),
        Port("run", BIT, doc="1: the gates are switching"),
    ),
    registers=(
        Port("k_torque", KI, doc="gain of the torque correction per sample"),
        Port("omega_learn", PU, lo=0, doc="the torque correction is held below this speed"),
    ),
    outputs=(Port("torque_gain", SHOWN, doc="factor of the torque reference"),),
    state=State(),
    latency=6,
    interval=6,
    constants={"DROP_STEP": DROP_STEP},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
