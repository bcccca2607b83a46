# SPDX-License-Identifier: BSD-3-Clause
"""The winding resistance from its temperature, paper 000 eq. (12), and the resistive flux drop of half a sample.

    r   = r_s + tcr*(temp_winding - t_0)        R = R_0 + TCR*(T_2 - T_0)
    rho = r*t_s/2, minus_rho = -rho             t_s: the sample time in per unit, T_s*omega_base

Without a valid reading (``temp_valid`` = 0, or outside t_min to t_max) r = r_s and ``temp_lost`` is 1.
flux_merge multiplies rho by a current, flux_models minus_rho: the resistive voltage drop integrated over half a sample.
Formats: temperatures S(9,6) in degrees, tcr U(-6,30); product 36 fraction bits, rounded half up to 24; r limited to
0 .. 1; rho rounded half up to 24 fraction bits, below 1/4 since t_s < 1/2.
"""

from golden_model import formats
from golden_model.block import Block, Port
from golden_model.fixed import Format, round_half_up, saturate_u
from golden_model.formats import BIT, RESISTANCE, SAMPLE_TIME
from golden_model.kernel import kernel

CELSIUS = Format(1, 9, 6)
TCR = Format(0, -6, 30)
RESISTANCE_BITS = RESISTANCE.width
DROP_TCR = CELSIUS.frac_bits + TCR.frac_bits - RESISTANCE.frac_bits
DROP_RHO = SAMPLE_TIME.frac_bits + 1


@kernel
def step(temp_winding, temp_valid, r_s, tcr, t_0, t_min, t_max, t_s):
    lost = 0 if temp_valid and t_min <= temp_winding <= t_max else 1
    warmer = 0 if lost else temp_winding - t_0
    r = saturate_u(r_s + round_half_up(tcr * warmer, DROP_TCR), RESISTANCE_BITS)
    rho = round_half_up(r * t_s, DROP_RHO)
    return r, rho, -rho, lost


def reference(v, _state):
    trusted = v["temp_valid"] and v["t_min"] <= v["temp_winding"] <= v["t_max"]
    r = v["r_s"] + (v["tcr"] * (v["temp_winding"] - v["t_0"]) if trusted else 0.0)
    r = min(max(r, 0.0), RESISTANCE.hi * RESISTANCE.lsb)
    return {"r": r, "rho": r * v["t_s"] / 2, "minus_rho": -r * v["t_s"] / 2}


def bound(v, _state):
    of_rho = RESISTANCE.lsb / 2 * (1 + v["t_s"] / 2)
    return {"r": RESISTANCE.lsb / 2, "rho": of_rho, "minus_rho": of_rho}


def stimuli(_rng, _config):
    """Temperatures at the ends of the valid range and just outside, no reading, resistances at both ends."""
    rows = []
    ends = {"t_min": -50 << 6, "t_max": 200 << 6, "t_0": 25 << 6}
    for temperature in (
        -50 << 6,
        (-50 << 6) - 1,
        200 << 6,
        (200 << 6) + 1,
        25 << 6,
        90 << 6,
        CELSIUS.lo,
        CELSIUS.hi,
    ):
        for valid in (1, 0):
            for r_s, tcr in ((641729, 2562610), (0, TCR.hi), (RESISTANCE.hi, TCR.hi)):
                rows.append({**ends, "temp_winding": temperature, "temp_valid": valid, "r_s": r_s, "tcr": tcr})
    return rows


T_S = Port("t_s", SAMPLE_TIME, doc="sample time, per unit")
R = Port("r", RESISTANCE, doc="winding resistance in use")
RHO = Port("rho", formats.RHO, doc="resistive flux drop of half a sample, per unit of current")
MINUS_RHO = Port(
    "minus_rho", formats.MINUS_RHO, hi=0, doc="minus the resistive flux drop of half a sample, per unit of current"
)

BLOCK = Block(
    name="winding_resistance",
    folder="estimators",
    paper="000, eq. (12)",
    step=step,
    inputs=(
        Port("temp_winding", CELSIUS, doc="winding temperature, degrees Celsius"),
        Port("temp_valid", BIT, doc="1: temp_winding is valid"),
    ),
    registers=(
        Port("r_s", RESISTANCE, doc="winding resistance at t_0"),
        Port("tcr", TCR, doc="change of r_s per kelvin"),
        Port("t_0", CELSIUS, doc="temperature of r_s"),
        Port("t_min", CELSIUS, doc="lowest valid temperature"),
        Port("t_max", CELSIUS, doc="highest valid temperature"),
        T_S,
    ),
    outputs=(R, RHO, MINUS_RHO, Port("temp_lost", BIT, doc="1: no valid temperature, r = r_s")),
    latency=8,
    interval=8,
    constants={"DROP_TCR": DROP_TCR, "DROP_RHO": DROP_RHO},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
