# SPDX-License-Identifier: BSD-3-Clause
"""Speed from two consecutive position codes, then a first-order filter.

    raw(k)   = k_speed * wrap(code(k) - code(k-1))
    omega(k) = omega(k-1) + k_filter * (raw(k) - omega_me(k-1)),  omega_me = omega, rounded

Formats: the difference is the shorter angle, S(-1,18) of a mechanical turn, so speeds up to half a turn per
sample are unambiguous.  raw is rounded half up to PU; the filter's state omega has 12 bits more, so that it settles
within one PU LSB of its input, and is rounded half up to omega_me.  k_filter = 1: no filter.
The first sample after reset has no predecessor: its difference is zero.  A sample with ``position_restart`` has none
either, and the filter keeps its speed.  With ``speed_given`` the speed is ``omega_given``, measured elsewhere (by the
time between the edges of an encoder); the filter goes on behind it.  On a board both may change from sample to sample,
so the outputs say what this one had: a recording can be replayed.
Saturation: raw saturates at 2 per unit; with k_filter <= 1 the state moves towards raw by at most the distance
from omega_me, so omega stays within half an LSB of PU of the range of raw, and omega_me within that range.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up, round_sat, wrap_s
from golden_model.formats import BIT, PU, PU_W, TURN_W
from golden_model.io.position import code_format
from golden_model.kernel import kernel

K_SPEED = Format(0, 12, 12)
K_FILTER = Format(0, 1, 16)
OMEGA = Format(1, 2, 28)
OMEGA_W = OMEGA.width
TO_PU = OMEGA.frac_bits - PU.frac_bits
DROP_RAW = TURN_W + K_SPEED.frac_bits - PU.frac_bits
DROP_STATE = PU.frac_bits + K_FILTER.frac_bits - OMEGA.frac_bits


class State(NamedTuple):
    code: int = 0
    seen: int = 0
    omega: int = 0  # OMEGA


@kernel
def step(
    state, code_theta, reverse, k_speed, k_filter, position_restart, speed_given, omega_given, position_bits
):  # fmt: skip
    aligned = code_theta << (TURN_W - position_bits)
    mech = -aligned if reverse else aligned
    last = state.code if state.seen else mech
    delta = wrap_s(mech - last, TURN_W)
    raw = round_sat(delta * k_speed, DROP_RAW, PU_W)
    err = 0 if position_restart else raw - round_half_up(state.omega, TO_PU)
    omega = state.omega + round_half_up(err * k_filter, DROP_STATE)
    omega_me = omega_given if speed_given else round_half_up(omega, TO_PU)
    return State(mech, 1, omega), (omega_me, speed_given, position_restart)


def reference(v, state):
    mech = -v["code_theta"] if v["reverse"] else v["code_theta"]
    delta = (mech - state.code / 2**TURN_W + 0.5) % 1.0 - 0.5 if state.seen else 0.0
    raw = PU.limit(v["k_speed"] * delta)
    old = state.omega * OMEGA.lsb
    said = {"speed_was_given": v["speed_given"], "position_restarted": v["position_restart"]}
    if v["speed_given"]:
        return said | {"omega_me": v["omega_given"]}
    if v["position_restart"]:
        return said | {"omega_me": old}
    return said | {"omega_me": old + v["k_filter"] * (raw - old)}


def bound(v, _state):
    """Rounding of raw and of the fed-back output (each weighted by k_filter), of the increment, of the output."""
    return {"speed_was_given": 0, "position_restarted": 0, "omega_me": v["k_filter"] * PU.lsb + OMEGA.lsb / 2 + PU.lsb}


def stimuli(rng, config):
    """Standstill, constant speed in both directions through the wrap, a reversal, jumps of half a turn."""
    size = 1 << config["POSITION_BITS"]
    rows, code = [], 0
    for speed in (0, 1, -1, size // 200, -size // 200, size // 2 - 1, size // 2, size // 2 + 1, 0):
        regs = {"k_speed": int(200 * 4096), "k_filter": int(rng.integers(1, 65537)), "reverse": 0}
        for _ in range(12):
            code = (code + speed) % size
            rows.append({"code_theta": code, **regs})
        rows.append({"code_theta": size // 3, **regs, "position_restart": 1})
        rows.append({"code_theta": code, **regs, "position_restart": 1})
        rows.append({"code_theta": code, **regs, "speed_given": 1, "omega_given": -speed % 1000})
    return rows


BLOCK = Block(
    name="speed",
    folder="io",
    paper="001, section 5.1, speed by differentiating two consecutive samples",
    step=step,
    inputs=(Port("code_theta", Format(0, 0, 16), doc="position code, one mechanical turn"),),
    registers=(
        Port("reverse", BIT, doc="1: code counts opposite to the phase order"),
        Port("k_speed", K_SPEED, doc="speed per turn and sample"),
        Port("k_filter", K_FILTER, hi=1 << 16, doc="filter weight of the new sample, 1 = no filter"),
        Port("position_restart", BIT, doc="1: the code has nothing to do with the one of the sample before"),
        Port("speed_given", BIT, doc="1: the speed is omega_given, not that of the code"),
        Port("omega_given", PU, doc="electrical speed, measured elsewhere"),
    ),
    outputs=(
        Port("omega_me", PU, doc="electrical speed"),
        Port("speed_was_given", BIT, doc="1: omega_me of this sample was measured elsewhere"),
        Port("position_restarted", BIT, doc="1: the code of this sample had nothing to do with the one before"),
    ),
    state=State(),
    latency=7,
    interval=4,
    constants={"OMEGA_W": OMEGA_W, "TO_PU": TO_PU, "DROP_RAW": DROP_RAW, "DROP_STATE": DROP_STATE},
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 12}, {"POSITION_BITS": 18}),
    width_from={"code_theta": code_format},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
