# SPDX-License-Identifier: BSD-3-Clause
"""The slow voltage loop of field weakening: it lowers the flux limit where the voltage exceeds its target.

    share += k_voltage*((u_share*u_max)**2 - u_d**2 - u_q**2)      within share_min..1;  1 with ``run`` = 0
    calm   = (u_share*u_max)**2 - u_d**2 - u_q**2 >= 1/4*(u_share*u_max)**2

Resistance, dead time and a wrong map change the voltage that a flux linkage needs; ``share`` carries the difference.
Below base speed the bracket is positive, so that it returns to 1 from every state.  ``calm``: the voltage is well
within the circle, where the minimum pulse lets all legs switch.

Formats: share U(0,28), of which U(0,16) is shown; the bracket is exact, then PU.
Rounding: the bracket is floored and saturated, the increment rounded half up.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common.ratio import BITS, RATIO
from golden_model.fixed import Format, clamp, round_half_up, saturate
from golden_model.formats import BIT, KI, PU, PU_W, U_MAX
from golden_model.kernel import kernel

SHARE = Format(0, 0, 28)
SHARE_HI = SHARE.hi
DROP_SHARE = SHARE.frac_bits - BITS
DROP_E = 2 * PU.frac_bits - PU.frac_bits
DROP_STEP = PU.frac_bits + KI.frac_bits - SHARE.frac_bits


class State(NamedTuple):
    share: int = SHARE_HI


@kernel
def step(state, u_max, run, u_d, u_q, u_share, k_voltage, share_min):
    radius = (u_share * u_max) >> BITS
    left = saturate((radius * radius - u_d * u_d - u_q * u_q) >> DROP_E, PU_W)
    calm = 1 if left >= (radius * radius) >> (DROP_E + 2) else 0
    share = clamp(state.share + round_half_up(k_voltage * left, DROP_STEP), share_min << DROP_SHARE, SHARE_HI)
    if not run:
        share = SHARE_HI
    return State(share), (share >> DROP_SHARE, calm)


def reference(v, state):
    radius = v["u_share"] * v["u_max"]
    left = min(max(radius**2 - v["u_d"] ** 2 - v["u_q"] ** 2, PU.lo * PU.lsb), PU.hi * PU.lsb)
    share = min(max(state.share * SHARE.lsb + v["k_voltage"] * left, v["share_min"]), SHARE_HI * SHARE.lsb)
    return {"share": share if v["run"] else SHARE_HI * SHARE.lsb}


def bound(v, _state):
    """Floors of the radius (times twice its size), of the bracket and of the shown bits; the rounded increment."""
    left = 2.0 * v["u_max"] * RATIO.lsb + 2.0 * PU.lsb
    return {"share": v["k_voltage"] * left + SHARE.lsb + RATIO.lsb}


def stimuli(rng, _config):
    """To both ends of share and back at gains of all sizes, stops, voltages on and beside both circles."""
    calm = {"u_max": 37000, "u_d": -9000, "u_q": 30000, "run": 1, "u_share": 64000, "k_voltage": 900}
    calm |= {"share_min": 20000}
    rows = []
    for k in range(160):
        push = {"u_d": 0, "u_q": 0} if k % 40 < 20 else {"u_d": 60000, "u_q": 60000}
        gain = KI.hi >> (k % 8)
        rows.append({**calm, **push, "k_voltage": gain, "share_min": 20000 + k, "run": int(k % 29 > 0)})
    radius = (64000 * 37000) >> 16
    for u_q in (radius, radius - 1, radius + 1, round(radius * 0.75**0.5), round(radius * 0.75**0.5) + 1):
        rows += [{**calm, "u_d": 0, "u_q": s * (u_q + e)} for s in (1, -1) for e in (-2, -1, 0, 1, 2)]
    ends = ((PU.lo, PU.lo), (PU.hi, PU.lo), (0, 0), (PU.lo, 0))
    rows += [{**calm, "u_d": d, "u_q": q, "u_max": u} for d, q in ends for u in (0, U_MAX.hi)]
    for _ in range(200):
        row = {"u_d": int(rng.integers(-60000, 60000)), "k_voltage": int(2 ** rng.uniform(0, 24))}
        rows.append({**calm, **row, "share_min": int(rng.integers(0, 65536))})
    return rows


BLOCK = Block(
    name="voltage_loop",
    folder="control",
    paper="none: docs/speed_range.md",
    step=step,
    inputs=(
        Port("u_max", U_MAX, doc="radius of the voltage circle"),
        Port("run", BIT, doc="1: the gates are switching"),
        Port("u_d", PU, doc="voltage, d axis"),
        Port("u_q", PU, doc="voltage, q axis"),
    ),
    registers=(
        Port("u_share", RATIO, doc="part of the voltage circle that the voltage loop aims at"),
        Port("k_voltage", KI, doc="gain of the voltage loop per sample"),
        Port("share_min", RATIO, doc="least part of the flux limit that the voltage loop leaves"),
    ),
    outputs=(
        Port("share", RATIO, doc="part of the flux limit that the voltage loop leaves"),
        Port("calm", BIT, doc="1: the voltage is at most 87 % of its target"),
    ),
    state=State(),
    latency=13,
    interval=13,
    constants={"DROP_E": DROP_E, "DROP_STEP": DROP_STEP},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
