# SPDX-License-Identifier: BSD-3-Clause
"""Temperatures of winding and magnets, and what they change: phase resistances and magnet flux.

    T_w += h*(1 + f_w)*sum(i_a^2 + i_b^2 + i_c^2) + k_w*(T_a - T_w)      once a window of 2**WINDOW_BITS steps
    T_m += k_m*(T_w - T_m)
    f_w = tcr_w*(T_w - t_ref);  f_m = tcr_m*(T_m - t_ref)
    hot: r_x + r_x*f_w;  psi_m - psi_m*f_m              start: T_w = T_m = T_a

The squares of three currents and one further product a step go through one multiplier; step n of a window, of the
first ten, makes product n (`product`).  The bits of the sum that are not multiplied stay in it for the next window.
Formats: temperatures S(9,38), S(9,7) where multiplied, S(9,6) outside, in degrees Celsius; h U(-12,36), k U(-10,31),
tcr U(-7,24), f S(1,16), the sum U(15,32), multiplied U(15,2).  All is cut; temperatures, f and what is hot
saturate.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.estimators.winding_resistance import CELSIUS
from golden_model.fixed import Format, saturate, saturate_u
from golden_model.formats import BIT, FLUX, PU
from golden_model.kernel import kernel
from golden_model.motor.motor_flux import DROP_R

HEATING, SHARE, TCR = Format(0, -12, 36), Format(0, -10, 31), Format(0, -7, 24)
TEMPERATURE, SEEN, FACTOR = Format(1, 9, 38), Format(1, 9, 7), Format(1, 1, 16)
WINDOW_BITS = 11
PRODUCTS = 10
T_W, F_W, R_W, H_W, PSI_W = TEMPERATURE.width, FACTOR.width, DROP_R.width, HEATING.width, FLUX.width
DROP_SEEN = TEMPERATURE.frac_bits - SEEN.frac_bits
DROP_OUT = TEMPERATURE.frac_bits - CELSIUS.frac_bits
DROP_SUM = 2 * PU.frac_bits - 2
DROP_F = TCR.frac_bits + SEEN.frac_bits - FACTOR.frac_bits
DROP_HOT = FACTOR.frac_bits
REST = (1 << DROP_SUM) - 1
assert HEATING.frac_bits + 2 == SHARE.frac_bits + SEEN.frac_bits == TEMPERATURE.frac_bits


class State(NamedTuple):
    winding: int = 0
    magnet: int = 0
    total: int = 0  # of the squares
    count: int = 0
    f: int = 0
    more_a: int = 0  # what the temperature adds
    more_b: int = 0
    more_c: int = 0
    more_h: int = 0
    less_psi: int = 0


@kernel
def product(s, r):
    """The state after the product of a step."""
    n = s.count
    winding, magnet, total, f = s.winding, s.magnet, s.total, s.f
    more_a, more_b, more_c, more_h, less_psi = s.more_a, s.more_b, s.more_c, s.more_h, s.less_psi
    seen_w, seen_m, reference_c = winding >> DROP_SEEN, magnet >> DROP_SEEN, r.t_ref << 1
    if n == 0:
        winding = saturate(winding + saturate_u(r.heating + more_h, H_W) * (total >> DROP_SUM), T_W)
        total &= REST
    elif n == 1:
        winding = saturate(winding + r.k_winding * ((r.ambient << 1) - seen_w), T_W)
    elif n == 2:
        magnet = saturate(magnet + r.k_magnet * (seen_w - seen_m), T_W)
    elif n == 3:
        f = saturate(r.tcr_winding * (seen_w - reference_c) >> DROP_F, F_W)
    elif n == 4:
        more_a = r.r_a * f >> DROP_HOT
    elif n == 5:
        more_b = r.r_b * f >> DROP_HOT
    elif n == 6:
        more_c = r.r_c * f >> DROP_HOT
    elif n == 7:
        more_h = r.heating * f >> DROP_HOT
    elif n == 8:
        f = saturate(r.tcr_magnet * (seen_m - reference_c) >> DROP_F, F_W)
    elif n == 9:
        less_psi = r.psi_m * f >> DROP_HOT
    return State(winding, magnet, total, n, f, more_a, more_b, more_c, more_h, less_psi)


@kernel
def hot(s, r):
    """(r_a, r_b, r_c, psi_m) at the temperatures."""
    return (
        saturate_u(r.r_a + s.more_a, R_W),
        saturate_u(r.r_b + s.more_b, R_W),
        saturate_u(r.r_c + s.more_c, R_W),
        saturate(r.psi_m - s.less_psi, PSI_W),
    )


@kernel
def step(state, inputs, regs, window_bits):
    x, r = inputs, regs
    s = product(state, r)
    winding, magnet = s.winding, s.magnet
    total = s.total + x.i_a * x.i_a + x.i_b * x.i_b + x.i_c * x.i_c
    if x.start:
        winding = magnet = r.ambient << DROP_OUT
        total = 0
    count = (s.count + 1) & ((1 << window_bits) - 1)
    s = State(winding, magnet, total, count, s.f, s.more_a, s.more_b, s.more_c, s.more_h, s.less_psi)
    r_a, r_b, r_c, psi_m = hot(s, r)
    return s, (r_a, r_b, r_c, psi_m, winding >> DROP_OUT, magnet >> DROP_OUT)


def reference(v, state):
    """From what the state holds: the products of this step in real numbers."""
    n, s, lsb = state.count, state, TEMPERATURE.lsb
    winding, magnet, total = s.winding * lsb, s.magnet * lsb, s.total * PU.lsb**2
    at_r, at_h, at_psi = DROP_R.lsb, HEATING.lsb, FLUX.lsb
    more = {"a": s.more_a * at_r, "b": s.more_b * at_r, "c": s.more_c * at_r}
    less, f = s.less_psi * at_psi, s.f * FACTOR.lsb
    if n == 0:
        most = HEATING.hi * at_h
        winding += min(max(v["heating"] + s.more_h * at_h, 0.0), most) * total
    elif n == 1:
        winding += v["k_winding"] * (v["ambient"] - winding)
    elif n == 2:
        magnet += v["k_magnet"] * (winding - magnet)
    elif 4 <= n <= 6:
        x = "abc"[n - 4]
        more[x] = v[f"r_{x}"] * f
    elif n == 9:
        less = v["psi_m"] * f
    if v["start"]:
        winding = magnet = v["ambient"]
    top = DROP_R.hi * at_r
    result = {f"hot_{x}": min(max(v[f"r_{x}"] + more[x], 0.0), top) for x in "abc"}
    result["hot_psi"] = FLUX.limit(v["psi_m"] - less)
    limit = TEMPERATURE.hi * lsb
    return result | {
        "temp_winding": min(max(winding, -512.0), limit),
        "temp_magnet": min(max(magnet, -512.0), limit),
    }


def bound(v, _state):
    """The cuts: of a product, of the sum and the difference that are multiplied, of the output."""
    share = max(v["k_winding"], v["k_magnet"])
    degree = CELSIUS.lsb + 2 * share * SEEN.lsb + HEATING.hi * HEATING.lsb / 4
    bounds = {f"hot_{x}": DROP_R.lsb for x in "abc"} | {"hot_psi": FLUX.lsb}
    return bounds | {"temp_winding": degree, "temp_magnet": degree}


def stimuli(_rng, config):
    """Whole windows: from cold to beyond both ends of every value, each bit of the factors, a start in between."""
    window = 1 << min(config["WINDOW_BITS"], 4)
    still = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers}
    most = {p.name: p.high for p in REGISTERS}
    full = {f"i_{x}": PU.lo for x in "abc"}
    rows = []

    def windows(count, **changes):
        rows.extend([still | changes] * (count * window))

    for ambient in (CELSIUS.hi, CELSIUS.lo, 20 << 6, 0, -1):
        for t_ref in (20 << 6, CELSIUS.lo, CELSIUS.hi):
            rows.append(still | {"ambient": ambient, "start": 1})
            windows(1, **most | full | {"ambient": ambient, "t_ref": t_ref})
            windows(2, **most | {"ambient": -1 - ambient, "t_ref": t_ref, "psi_m": FLUX.lo, "k_winding": 1 << 20})
    for bit in range(24):
        warm = {"ambient": 300 << 6, "t_ref": 0, "psi_m": 1 << bit, "r_a": 1 << bit, "r_b": 3 << bit >> 1}
        warm |= {"r_c": 5 << bit >> 2, "heating": 1 << bit, "i_a": 40000, "i_b": -1234, "i_c": (1 << bit) >> 7}
        shares = {"k_winding": (1 << bit) & SHARE.hi, "k_magnet": (2 << bit) & SHARE.hi}
        rates = {"tcr_winding": (1 << bit) & TCR.hi or 65000, "tcr_magnet": (2 << bit) & TCR.hi or 16000}
        rows.append(still | warm | {"start": 1})
        windows(2, **warm | shares | rates)
    for sign in (1, -1):  # a small difference, whose rest is its cut
        rows.append(still | {"ambient": 100, "start": 1})
        windows(8, ambient=100 + sign, k_winding=SHARE.hi, k_magnet=SHARE.hi)
    return rows


def patient_stimuli(rng, config):
    """Windows of any values that no limit hides: a factor within its range, of either sign and any size.

    Then many windows without a start, in which what an output does not show adds up.
    """
    window, rows, one = 1 << min(config["WINDOW_BITS"], 5), [], 1 << TCR.frac_bits
    for k in range(200):
        row = {p.name: int(rng.integers(p.high + 1)) >> int(rng.integers(1, 4)) for p in REGISTERS}
        row |= {"ambient": int(rng.integers(CELSIUS.lo, CELSIUS.hi + 1)) >> k % 3, "psi_m": int(rng.integers(FLUX.hi))}
        apart = int(rng.choice((-1, 1))) * int(rng.integers(1, 400 << CELSIUS.frac_bits)) >> k % 7
        row["t_ref"] = min(max(row["ambient"] + apart, CELSIUS.lo), CELSIUS.hi)
        most = one * (1 << CELSIUS.frac_bits) // max(abs(apart), 1)  # a factor of one
        for name in ("tcr_winding", "tcr_magnet"):
            row[name] = min(int(rng.integers(most + 1)), TCR.hi)
        rows.append(row | {"start": 1})
        for _ in range(3 * window):
            rows.append(row | {f"i_{x}": int(rng.integers(PU.lo, PU.hi + 1)) >> k % 5 for x in "abc"})
    for sign in (1, -1, 1, -1):
        row = {p.name: int(rng.integers(p.high // 2)) for p in REGISTERS}
        row |= {
            "ambient": sign * 100 << CELSIUS.frac_bits,
            "t_ref": 0,
            "tcr_winding": one // 250,
            "tcr_magnet": one // 250,
        }
        rows.append(row | {"start": 1})
        for _ in range(300 * window):
            rows.append(row | {f"i_{x}": int(rng.integers(PU.lo, PU.hi + 1)) for x in "abc"})
    return rows


INPUTS = (
    *(Port(f"i_{x}", PU, doc=f"current of phase {x}") for x in "abc"),
    Port("start", BIT, doc="1: all is as warm as the ambient"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
OWN = (
    Port("ambient", CELSIUS, doc="ambient temperature, and that of winding and magnets at the start"),
    Port("t_ref", CELSIUS, doc="temperature at which motor_r_a to motor_r_c and motor_psi_m hold"),
    Port("heating", HEATING, doc="warming of the winding per square of the currents, at t_ref"),
    Port("k_winding", SHARE, doc="share of the difference to the ambient that the winding loses in a window"),
    Port("k_magnet", SHARE, doc="share of the difference to the winding that the magnets follow in a window"),
    Port("tcr_winding", TCR, doc="what the resistances gain per degree, relative; 0: no temperature"),
    Port("tcr_magnet", TCR, doc="what the magnet flux loses per degree, relative; 0: no temperature"),
)
REGISTERS = (*(Port(f"r_{x}", DROP_R, doc=f"resistance of phase {x}") for x in "abc"), Port("psi_m", FLUX), *OWN)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])
Own = namedtuple("Own", [p.name for p in OWN])

BLOCK = Block(
    name="motor_heat",
    folder="motor",
    paper="docs/hil.md: temperatures",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        *(Port(f"hot_{x}", DROP_R, doc=f"resistance of phase {x}, hot") for x in "abc"),
        Port("hot_psi", FLUX, doc="magnet flux, hot"),
        Port("temp_winding", CELSIUS, doc="temperature of the winding"),
        Port("temp_magnet", CELSIUS, doc="temperature of the magnets"),
    ),
    state=State(),
    latency=6,
    interval=6,
    configs=({"WINDOW_BITS": 4}, {"WINDOW_BITS": 5}),
    constants={
        "DROP_SEEN": DROP_SEEN, "DROP_OUT": DROP_OUT, "DROP_SUM": DROP_SUM, "DROP_F": DROP_F, "DROP_HOT": DROP_HOT,
        "WINDOW_BITS": WINDOW_BITS, "PRODUCTS": PRODUCTS,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)  # fmt: skip
