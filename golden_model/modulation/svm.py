# SPDX-License-Identifier: BSD-3-Clause
"""Symmetrical space-vector modulation: stator voltage to three duties, without a divider.

    x = u_alpha/u_dc,  y = sqrt(3)/2*u_beta/u_dc          by inverse and inverse_beta of u_dc_processing
    legs a = x,  b = -x/2 + y,  c = -x/2 - y
    duty = 1/2 + leg + mid(a,b,c)/2                       half the middle leg centres the three pulses

a + b + c = 0, so the zero-sequence voltage -(max + min)/2 of the symmetrical pattern is half the middle
leg.  Formats: products 33 fraction bits, rounded half up to S(1,17); legs and sum exact; duty rounded half up, then
clamped to 0..1: a voltage beyond the hexagon becomes its nearest point.
Range: the voltage is below two bus voltages, so x and y need no limiter.  voltage_limit allows less than one: k_u_max
is below 1, and the circle's radius and the inverses come from the same sample's u_dc.  With OVERMODULATION = 1 the
inverses have a gain below 8 (modulation/overmodulation), x and y are S(3,17).
"""

import math

from golden_model.block import Block, Port
from golden_model.fixed import Format, clamp, round_half_up
from golden_model.formats import DUTY, DUTY_ONE, PU
from golden_model.io.u_dc_processing import INVERSE
from golden_model.kernel import kernel

SCALED = Format(1, 1, 17)
SCALED_W = SCALED.width
DROP_SCALED = PU.frac_bits + INVERSE.frac_bits - SCALED.frac_bits
SUM_FRAC = SCALED.frac_bits + 2
HALF = 1 << (SUM_FRAC - 1)
DROP_DUTY = SUM_FRAC - DUTY.frac_bits


@kernel
def step(u_alpha, u_beta, inverse, inverse_beta, _overmodulation=0):
    prod_x = u_alpha * inverse
    prod_y = u_beta * inverse_beta
    x = round_half_up(prod_x, DROP_SCALED)
    y = round_half_up(prod_y, DROP_SCALED)
    leg_a = 2 * x
    leg_b = 2 * y - x
    leg_c = -2 * y - x
    a_ge_b = 3 * x >= 2 * y
    a_ge_c = 3 * x >= -2 * y
    b_ge_c = y >= 0
    if a_ge_b != a_ge_c:
        mid = leg_a
    elif a_ge_b == b_ge_c:
        mid = leg_b
    else:
        mid = leg_c
    duty_a = clamp(round_half_up(HALF + 2 * leg_a + mid, DROP_DUTY), 0, DUTY_ONE)
    duty_b = clamp(round_half_up(HALF + 2 * leg_b + mid, DROP_DUTY), 0, DUTY_ONE)
    duty_c = clamp(round_half_up(HALF + 2 * leg_c + mid, DROP_DUTY), 0, DUTY_ONE)
    return duty_a, duty_b, duty_c


def reference(v, _state):
    x = v["u_alpha"] * v["inverse"]
    y = v["u_beta"] * v["inverse_beta"]
    legs = (x, y - x / 2, -y - x / 2)
    zero = -(max(legs) + min(legs)) / 2
    return {f"duty_{k}": min(max(0.5 + leg + zero, 0.0), 1.0) for k, leg in zip("abc", legs, strict=True)}


def bound(_v, _state):
    """x and y within half an LSB each move a duty by at most 1.5 of it; then the duty's own rounding."""
    return {f"duty_{k}": 1.5 * SCALED.lsb + DUTY.lsb / 2 for k in "abc"}


def below_two(v, config):
    """``v`` with the voltage limited to less than two bus voltages, to eight with over-modulation."""
    out = dict(v)
    for u, inverse in (("u_alpha", "inverse"), ("u_beta", "inverse_beta")):
        most = (((SCALED.hi << 2 * config["OVERMODULATION"]) << DROP_SCALED) - 1) // max(v[inverse], 1)
        out[u] = min(max(v[u], -most), most)
    return out


def stimuli(rng, _config):
    """Zero vector at every bus voltage; every sector border and corner, inside and beyond the hexagon."""
    rows = [
        {"u_alpha": 0, "u_beta": 0, "inverse": m << n, "inverse_beta": (m * 7 // 8) << n}
        for m in (65536, 131071)
        for n in range(6)
    ]
    for radius in (1, 1000, 20000, 37837, 43690, 65536, 131071):
        for k in range(24):
            a, b = radius * math.cos(k * math.pi / 12), radius * math.sin(k * math.pi / 12)
            rows += [
                {"u_alpha": round(a) + da, "u_beta": round(b), "inverse": 131071, "inverse_beta": 113511}
                for da in (-1, 0, 1)
                if abs(round(a) + da) <= PU.hi
            ]
    for inverse in (300000, 600000, 1000000):  # far beyond the hexagon
        bus = {"inverse": inverse, "inverse_beta": inverse * 7 // 8}
        rows += [{"u_alpha": round(6e4 * math.cos(k)), "u_beta": round(6e4 * math.sin(k)), **bus} for k in range(12)]
    # The border of over-modulation to the LSB, at any angle.
    for _ in range(60):
        angle, low, high = rng.uniform(0, 2 * math.pi), 0, 60000
        while high - low > 1:
            middle = (low + high) // 2
            duties = step(*at_radius(middle, angle).values())
            low, high = (low, middle) if {0, DUTY_ONE} & set(duties) else (middle, high)
        rows += [at_radius(low + more, angle) for more in (0, 1, 2, 3)]
    return rows


def at_radius(radius, angle):
    """A voltage at the lowest bus voltage."""
    a, b = round(radius * math.cos(angle)), round(radius * math.sin(angle))
    return {"u_alpha": a, "u_beta": b, "inverse": 131071, "inverse_beta": 113511}


BLOCK = Block(
    name="svm",
    folder="modulation",
    paper="001, section 5.2, SVM with U_dc = 2**n/m",
    step=step,
    inputs=(
        Port("u_alpha", PU, doc="voltage, alpha"),
        Port("u_beta", PU, doc="voltage, beta"),
        Port("inverse", INVERSE, doc="1/u_dc"),
        Port("inverse_beta", INVERSE, doc="sqrt(3)/2/u_dc"),
    ),
    outputs=tuple(Port(f"duty_{k}", DUTY, hi=DUTY_ONE, doc=f"duty, leg {k}") for k in "abc"),
    latency=5,
    constants={"DROP_SCALED": DROP_SCALED, "SCALED_W": SCALED_W, "HALF": HALF, "DROP_DUTY": DROP_DUTY},
    configs=({"OVERMODULATION": 0}, {"OVERMODULATION": 1}),
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    possible=below_two,
)
