# SPDX-License-Identifier: BSD-3-Clause
"""The flux linkage that bus voltage and speed allow, as a part of that of the torque table's last row.

    flux_part = share*u_max*k_flux/|omega_me|            1 from the last row's flux linkage on

The voltage circle without the resistance is a circle of the flux linkage of radius u_max/|omega_me|; ``share`` comes
from the voltage loop.  Bus voltage and speed act at once, the loop carries what the map of the motor lacks.

Formats: share U(0,16); share*u_max U(0,REACH_BITS), its product with k_flux as PU; flux_part U(0,16).
Rounding: all floored.
"""

from golden_model.block import Block, Port
from golden_model.common import ratio
from golden_model.common.ratio import BITS, RATIO
from golden_model.formats import KP, PU, U_MAX
from golden_model.kernel import kernel

REACH_BITS = 17  # fraction of share*u_max
DROP_REACH = REACH_BITS + KP.frac_bits - PU.frac_bits
DROP_SHARE = 2 * BITS - REACH_BITS
DIVIDEND_W = REACH_BITS + KP.width - DROP_REACH
PRODUCTS = 4  # clocks of both products


@kernel
def step(omega_me, u_max, share, k_flux):
    reach = (share * u_max) >> DROP_SHARE
    flux_part, _ = ratio.step((reach * k_flux) >> DROP_REACH, abs(omega_me), DIVIDEND_W)
    return (flux_part,)


def reference(v, _state):
    reach, speed = v["share"] * v["u_max"] * v["k_flux"], abs(v["omega_me"])
    return {"flux_part": RATIO.hi * RATIO.lsb if reach >= speed else reach / speed}


def bound(v, _state):
    """Floors of the product and of the dividend over the speed, and that of the ratio."""
    speed = max(abs(v["omega_me"]), PU.lsb)
    return {"flux_part": (2.0**-REACH_BITS * v["k_flux"] + PU.lsb) / speed + RATIO.lsb}


def stimuli(rng, _config):
    """Zero speed and both ends, flux limits of 1 and one LSB beside it, all sizes of flux limit."""
    calm = {"u_max": 37000, "share": RATIO.hi, "k_flux": 3 << KP.frac_bits}
    rows = [{**calm, "omega_me": omega} for omega in (0, 1, -1, PU.hi, PU.lo, 110998, 110999, -111000, 111001)]
    rows += [{**calm, "omega_me": 60000, "share": share} for share in (0, 1, 1 << 15, RATIO.hi)]
    rows += [{**calm, "omega_me": omega, "u_max": U_MAX.hi, "k_flux": KP.hi} for omega in (0, PU.lo, PU.hi)]
    for _ in range(200):
        omega = int(rng.integers(-131072, 131072))
        rows.append({**calm, "omega_me": omega, "k_flux": int(2 ** rng.uniform(8, 21))})
    return rows


BLOCK = Block(
    name="flux_limit",
    folder="control",
    paper="none: docs/speed_range.md",
    step=step,
    inputs=(
        Port("omega_me", PU, doc="electrical speed"),
        Port("u_max", U_MAX, doc="radius of the voltage circle"),
        Port("share", RATIO, doc="part of the flux limit that the voltage loop leaves"),
    ),
    registers=(Port("k_flux", KP, doc="1 over the flux linkage of the table's last row"),),
    outputs=(Port("flux_part", RATIO, doc="flux limit, of the flux linkage of the table's last row"),),
    latency=PRODUCTS + ratio.BLOCK.latency,
    interval=PRODUCTS + ratio.BLOCK.interval,
    constants={"REACH_BITS": REACH_BITS, "DROP_REACH": DROP_REACH, "DIVIDEND_W": DIVIDEND_W},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
