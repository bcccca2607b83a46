# SPDX-License-Identifier: BSD-3-Clause
"""The voltage commanded to the inverter for the coming period, in the stator frame.

    u_applied_alpha = (2*compare_a - compare_b - compare_c) / (3*CARRIER_HALF)       * u_dc
    u_applied_beta  = (compare_b - compare_c)               / (sqrt(3)*CARRIER_HALF) * u_dc

The compare values are those of the previous sample: the carrier loads them at this sampling instant and
they act until the next one.  They include voltage limit, over-modulation, minimum pulse and rounding to whole
clocks.  The bus voltage is the one measured now, not the one the compare values were calculated with.
``voltage_known`` = 0: the gates are off or the bus reading is lost, so the voltage is unknown.

Formats: 2**SHIFT/CARRIER_HALF is a 17-bit constant in [1, 2) derived from the generic; u_dc times it U(2,22); the
constants 1/3 and 1/sqrt(3) scale that, half up; the last product is shifted by SHIFT and rounded half up to FLUX.
Saturation: none.  Compare values are at most CARRIER_HALF, so |u_applied| <= 2/3*u_dc < 1.34.
"""

import math

from golden_model.block import Block, Const, Port
from golden_model.fixed import Format, round_half_up
from golden_model.formats import BIT, FLUX, U_DC
from golden_model.io.u_dc_processing import U_DC_MIN
from golden_model.kernel import kernel
from golden_model.modulation.pwm_compare import COUNT

K_FRAC = 16  # fraction bits of 2**SHIFT/CARRIER_HALF
SCALE = Format(0, 2, 22)
DROP_SCALE = U_DC.frac_bits + K_FRAC - SCALE.frac_bits
THIRD = Const(1 / 3, Format(0, -1, 18))
INV_SQRT3 = Const(1 / math.sqrt(3), Format(0, 0, 17))
K_THIRD, K_INV_SQRT3 = THIRD.value, INV_SQRT3.value
DROP_THIRD, DROP_INV_SQRT3 = THIRD.fmt.frac_bits, INV_SQRT3.fmt.frac_bits
TO_FLUX = FLUX.frac_bits - SCALE.frac_bits


@kernel
def carrier_shift(carrier_half):
    """Smallest n with 2**n >= carrier_half."""
    n = 0
    while (1 << n) < carrier_half:
        n += 1
    return n


@kernel
def axis(first, compare_b, compare_c, scale, coefficient, drop, drop_u):
    """(2*first - compare_b - compare_c) clocks, times scale and coefficient; for beta, first is compare_b."""
    scaled = round_half_up(scale * coefficient, drop)
    clocks = 2 * first - compare_b - compare_c
    return round_half_up(scaled * clocks, drop_u)


@kernel
def step(compare_a, compare_b, compare_c, u_dc, u_dc_at_rail, run, carrier_half):
    shift = carrier_shift(carrier_half)
    k_carrier = ((1 << (K_FRAC + shift)) + carrier_half // 2) // carrier_half
    drop_u = shift - TO_FLUX
    scale = round_half_up(u_dc * k_carrier, DROP_SCALE)
    u_alpha = axis(compare_a, compare_b, compare_c, scale, K_THIRD, DROP_THIRD, drop_u)
    u_beta = axis(compare_b, compare_b, compare_c, scale, K_INV_SQRT3, DROP_INV_SQRT3, drop_u)
    known = 1 if run and not u_dc_at_rail and u_dc >= U_DC_MIN else 0
    return u_alpha, u_beta, known


def sums(v):
    """{axis: (combination of the compare values in clocks, its constant 1/3 or 1/sqrt(3))}."""
    a, b, c = (v[f"compare_{k}"] for k in "abc")
    return {"alpha": (2 * a - b - c, 1 / 3), "beta": (b - c, 1 / math.sqrt(3))}


def reference(v, _state):
    return {
        f"u_applied_{axis}": FLUX.limit(clocks * k * v["u_dc"] / v["CARRIER_HALF"])
        for axis, (clocks, k) in sums(v).items()
    }


def bound(v, _state):
    """Errors of the carrier constant (half an LSB), of the scale, of 1/3 or 1/sqrt(3), of the scaled, of u."""
    part = 2.0 ** int(carrier_shift(v["CARRIER_HALF"]))
    scale = v["u_dc"] * part / v["CARRIER_HALF"]
    out = {}
    for (axis, (clocks, k)), const in zip(sums(v).items(), (THIRD, INV_SQRT3), strict=True):
        of_scale = v["u_dc"] * 2.0 ** -(K_FRAC + 1) + SCALE.lsb / 2
        of_scaled = k * of_scale + scale * const.fmt.lsb / 2 + SCALE.lsb
        out[f"u_applied_{axis}"] = abs(clocks) / part * of_scaled + FLUX.lsb / 2
    return out


def below_the_peak(v, config):
    """``v`` with compare values of at most CARRIER_HALF, as pwm_compare gives them."""
    return v | {k: min(v[k], config["CARRIER_HALF"]) for k in ("compare_a", "compare_b", "compare_c")}


def stimuli(rng, config):
    """Legal compare values at the ends of the carrier and between; bus at its ends; each cause of unknown voltage."""
    half = config["CARRIER_HALF"]
    rows = []
    for u_dc in (0, U_DC_MIN - 1, U_DC_MIN, 73400, U_DC.hi):
        for a, b, c in ((0, half, 0), (half, 0, half), (half, half, half), (half // 2, half // 3, 0)):
            compare = {"compare_a": a, "compare_b": b, "compare_c": c}
            rows.append({**compare, "u_dc": u_dc, "u_dc_at_rail": 0, "run": 1})
    for _ in range(40):
        compare = {f"compare_{k}": int(rng.integers(0, half + 1)) for k in "abc"}
        rows.append({**compare, "u_dc_at_rail": int(rng.integers(2)), "run": int(rng.integers(2))})
    return rows


BLOCK = Block(
    name="applied_voltage",
    folder="estimators",
    paper="001, section 2.2: u_alphabeta of eq. (5)",
    step=step,
    inputs=(
        *(Port(f"compare_{k}", COUNT, doc=f"compare value in force, leg {k}") for k in "abc"),
        Port("u_dc", U_DC, doc="bus voltage"),
        Port("u_dc_at_rail", BIT, doc="bus reading at either end"),
        Port("run", BIT, doc="1: the gates are switching"),
    ),
    outputs=(
        Port("u_applied_alpha", FLUX, doc="voltage of the coming period, alpha"),
        Port("u_applied_beta", FLUX, doc="voltage of the coming period, beta"),
        Port("voltage_known", BIT, doc="0: gates off or bus reading lost"),
    ),
    latency=11,
    interval=11,
    constants={
        "K_FRAC": K_FRAC,
        "SCALE_W": SCALE.width,
        "DROP_SCALE": DROP_SCALE,
        "THIRD": THIRD,
        "INV_SQRT3": INV_SQRT3,
        "DROP_THIRD": DROP_THIRD,
        "DROP_INV_SQRT3": DROP_INV_SQRT3,
        "TO_FLUX": TO_FLUX,
    },
    configs=tuple({"CARRIER_HALF": half} for half in (10000, 100, 32767, 13, 8)),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    possible=below_the_peak,
)
