# SPDX-License-Identifier: BSD-3-Clause
"""The fluxes in the rotor frame, the currents of a linear machine, and the place of these in the map of the saturation.

    lambda_d = lambda_alpha*cos + lambda_beta*sin,  lambda_q = lambda_beta*cos - lambda_alpha*sin
    x_d = (lambda_d - psi_m - wave_d)*inv_l_d,  x_q = (lambda_q - wave_q)*inv_l_q
    turn_d = lambda_d + slope_q,  turn_q = lambda_q - slope_d        fluxes that make torque with i_q and -i_d
    row + f_d = 32*x_d + 31.5,  column + f_q = 32*x_q + 31.5        limited to the map's 64 x 64 points

Formats: fluxes FLUX, cos and sin S(0,17), wave S(-2,19), slope PU, inv_l U(9,16), x S(1,22), f U(0,17).
Rotation rounded half up to FLUX, x half up to 22 fraction bits; all sums saturate; f is exact.
"""

from collections import namedtuple

from golden_model.block import Block, Port
from golden_model.common.sum_of_products import difference_of_products, sum_of_products
from golden_model.fixed import Format, clamp, round_sat, saturate
from golden_model.formats import FLUX, FLUX_W, MOTOR_TRIG, MOTOR_WAVE, PU
from golden_model.kernel import kernel

X = Format(1, 1, 22)
INVERSE_L = Format(0, 9, 16)
PLACE = Format(0, 0, 17)
CELL = Format(0, 6, 0)
X_W = X.width
DROP = MOTOR_TRIG.frac_bits
DROP_X = FLUX.frac_bits + INVERSE_L.frac_bits - X.frac_bits
F_BITS = X.frac_bits - 5  # of the place between two points of the map, which are a 32nd apart
WAVE_SHIFT = FLUX.frac_bits - MOTOR_WAVE.frac_bits
SLOPE_SHIFT = FLUX.frac_bits - PU.frac_bits
CENTRE = 63 << (F_BITS - 1)  # 31.5 points
LAST = (63 << F_BITS) - 1
LOW_BITS = 8  # of inv_l, for the second multiplier


@kernel
def step(inputs, regs):
    x, r = inputs, regs
    lambda_d = sum_of_products(x.lambda_beta, x.sin_theta, x.lambda_alpha, x.cos_theta, DROP, FLUX_W)
    lambda_q = difference_of_products(x.lambda_alpha, x.sin_theta, x.lambda_beta, x.cos_theta, DROP, FLUX_W)
    of_d = saturate(lambda_d - r.psi_m - (x.wave_d << WAVE_SHIFT), FLUX_W)
    of_q = saturate(lambda_q - (x.wave_q << WAVE_SHIFT), FLUX_W)
    x_d, x_q = round_sat(of_d * r.inv_l_d, DROP_X, X_W), round_sat(of_q * r.inv_l_q, DROP_X, X_W)
    place_d, place_q = clamp(x_d + CENTRE, 0, LAST), clamp(x_q + CENTRE, 0, LAST)
    inside = (1 << F_BITS) - 1
    return (
        x_d,
        x_q,
        place_d >> F_BITS,
        place_q >> F_BITS,
        place_d & inside,
        place_q & inside,
        saturate(lambda_d + (x.slope_q << SLOPE_SHIFT), FLUX_W),
        saturate(lambda_q - (x.slope_d << SLOPE_SHIFT), FLUX_W),
        x.cos_theta,
        x.sin_theta,
    )


def place(x):
    """Place in the map of a current, in points."""
    return min(max(32 * x + 31.5, 0.0), 63 - PLACE.lsb)


def reference(v, _state):
    c, s = v["cos_theta"], v["sin_theta"]
    lambda_d = FLUX.limit(v["lambda_alpha"] * c + v["lambda_beta"] * s)
    lambda_q = FLUX.limit(v["lambda_beta"] * c - v["lambda_alpha"] * s)
    x_d = X.limit(FLUX.limit(lambda_d - v["psi_m"] - v["wave_d"]) * v["inv_l_d"])
    x_q = X.limit(FLUX.limit(lambda_q - v["wave_q"]) * v["inv_l_q"])
    return {
        "x_d": x_d,
        "x_q": x_q,
        "turn_d": FLUX.limit(lambda_d + v["slope_q"]),
        "turn_q": FLUX.limit(lambda_q - v["slope_d"]),
        "cos_held": c,
        "sin_held": s,
        "f_d": place(x_d) % 1,
        "f_q": place(x_q) % 1,
    }


def bound(v, state):
    """The rotation's rounding times 1/L, and that of x; so close to a border f may belong to the next cell."""
    turn, exact = FLUX.lsb / 2, reference(v, state)
    off = {axis: turn * v[f"inv_l_{axis}"] + X.lsb / 2 for axis in "dq"}
    within = {axis: min(1.0, 32 * off[axis]) for axis in "dq"}
    at = {axis: exact[f"f_{axis}"] for axis in "dq"}
    return {
        "x_d": off["d"],
        "x_q": off["q"],
        **dict.fromkeys(("turn_d", "turn_q"), turn),
        **dict.fromkeys(("cos_held", "sin_held"), 0.0),
        **{f"f_{axis}": within[axis] if within[axis] < at[axis] < 1 - within[axis] else 1.0 for axis in "dq"},
    }


def stimuli(_rng, _config):
    """Both axes at the borders of the map and of its cells, by every sign; every sum at its limit."""
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"cos_theta": MOTOR_TRIG.hi}
    rows = []
    one = 1 << INVERSE_L.frac_bits
    for cell in (0, 1, 31, 32, 62, 63, 64):
        for off in (-2, 0, 2):
            flux = ((2 * cell - 63) << 17) + off  # x in half cells of 1/32, at FLUX's scale
            for axis in ("alpha", "beta"):
                rows.append(still | {f"lambda_{axis}": flux, "inv_l_d": one, "inv_l_q": one})
    for lo in (FLUX.lo, FLUX.hi):
        for trig in (MOTOR_TRIG.lo, MOTOR_TRIG.hi, 92681, -92681):
            row = {"lambda_alpha": lo, "lambda_beta": -lo - 1, "cos_theta": trig, "sin_theta": 92681}
            for psi in (FLUX.lo, FLUX.hi):
                for wave in (MOTOR_WAVE.lo, MOTOR_WAVE.hi):
                    for inverse in (INVERSE_L.hi, 255, 256):
                        ends = {"psi_m": psi, "wave_d": wave, "wave_q": -wave - 1, "slope_d": PU.lo, "slope_q": PU.hi}
                        rows.append(still | row | ends | {"inv_l_d": inverse, "inv_l_q": inverse})
    return rows


INPUTS = (
    Port("lambda_alpha", FLUX, doc="flux linkage, alpha"),
    Port("lambda_beta", FLUX, doc="flux linkage, beta"),
    Port("cos_theta", MOTOR_TRIG, doc="cosine of the electrical angle"),
    Port("sin_theta", MOTOR_TRIG, doc="sine of the electrical angle"),
    Port("wave_d", MOTOR_WAVE, doc="harmonic flux, d axis"),
    Port("wave_q", MOTOR_WAVE, doc="harmonic flux, q axis"),
    Port("slope_d", PU, doc="slope of wave_d per electrical radian"),
    Port("slope_q", PU, doc="slope of wave_q per electrical radian"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("psi_m", FLUX, doc="flux linkage of the magnets"),
    Port("inv_l_d", INVERSE_L, doc="1/L_d: current per flux"),
    Port("inv_l_q", INVERSE_L, doc="1/L_q: current per flux"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="motor_unsaturated",
    folder="motor",
    paper="docs/hil.md: currents from fluxes",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("x_d", X, doc="current without saturation, d axis"),
        Port("x_q", X, doc="current without saturation, q axis"),
        Port("row", CELL, hi=62, doc="cell of the map, d axis"),
        Port("column", CELL, hi=62, doc="cell of the map, q axis"),
        Port("f_d", PLACE, doc="place in the cell, d axis"),
        Port("f_q", PLACE, doc="place in the cell, q axis"),
        Port("turn_d", FLUX, doc="flux that makes torque with i_q"),
        Port("turn_q", FLUX, doc="flux that makes torque with -i_d"),
        Port("cos_held", MOTOR_TRIG, doc="cos_theta of this step"),
        Port("sin_held", MOTOR_TRIG, doc="sin_theta of this step"),
    ),
    latency=10,
    interval=10,
    constants={
        "DROP": DROP,
        "DROP_X": DROP_X,
        "LOW_BITS": LOW_BITS,
        "WAVE_SHIFT": WAVE_SHIFT,
        "SLOPE_SHIFT": SLOPE_SHIFT,
        "F_BITS": F_BITS,
        "CENTRE": CENTRE,
        "LAST": LAST,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
