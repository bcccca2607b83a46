# SPDX-License-Identifier: BSD-3-Clause
"""Flux linkage of the ripple that over-modulation adds: what was applied beside the voltage that was asked for.

    du    = u_applied - u of the last sample                 both act in the coming period, stator frame
    mean += (park(du) - mean)/16                             rotor frame: what stands still there is no ripple
    rip  += t_s*(du - inverse_park(mean)) - rip/8            stator frame;  zero with ``run`` or ``voltage_known`` = 0

The fundamentals of both agree (modulation/overmodulation), so du turns with the harmonics 5, 7, 11, ... of the hexagon,
six times the speed in the rotor frame.  Both time constants are short: a disturbance within the bandwidth of the
current loop must stay visible to it.  u_applied comes from the compare values, minimum pulse and rounding included.

Formats: du S(1,16), limited to 1.375 as rotate has it, likewise its rotated components; mean S(1,22), shown as PU,
rounded half up; the increment rounded half up to RIPPLE S(-2,23), where the sum saturates: |rip| < 1/4.  Decays round
half up.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.common.multiply_add import multiply_add
from golden_model.control.ripple_voltage import RIP, RIPPLE
from golden_model.estimators.winding_resistance import T_S
from golden_model.fixed import Format, clamp, round_half_up
from golden_model.formats import BIT, FLUX, PU, PU_TO_FLUX, SAMPLE_TIME, VECTOR
from golden_model.kernel import kernel
from golden_model.transforms import inverse_park, park
from golden_model.transforms.rotate import TRIG_PORTS, on_circle

MEAN = Format(1, 1, 22)
FADE_MEAN, FADE = 4, 3  # shifts: 16 and 8 samples
SHOWN = MEAN.frac_bits - PU.frac_bits
RIPPLE_W = RIPPLE.width
DROP = PU.frac_bits + SAMPLE_TIME.frac_bits - RIPPLE.frac_bits
TO_PU = RIPPLE.frac_bits - PU.frac_bits


class State(NamedTuple):
    mean_d: int = 0  # MEAN
    mean_q: int = 0
    rip_alpha: int = 0  # RIPPLE
    rip_beta: int = 0


@kernel
def step(state, inputs, regs):
    x, s, t_s = inputs, state, regs.t_s
    du_alpha = clamp(round_half_up(x.u_applied_alpha, PU_TO_FLUX) - x.u_alpha, -VECTOR, VECTOR - 1)
    du_beta = clamp(round_half_up(x.u_applied_beta, PU_TO_FLUX) - x.u_beta, -VECTOR, VECTOR - 1)
    mean_alpha, mean_beta = inverse_park.step(
        round_half_up(s.mean_d, SHOWN), round_half_up(s.mean_q, SHOWN), x.cos_theta, x.sin_theta
    )
    du_d, du_q = park.step(du_alpha, du_beta, x.cos_theta, x.sin_theta)
    left_alpha = s.rip_alpha - round_half_up(s.rip_alpha, FADE)
    left_beta = s.rip_beta - round_half_up(s.rip_beta, FADE)
    rip_alpha, _ = multiply_add(du_alpha - mean_alpha, t_s, left_alpha, DROP, RIPPLE_W)
    rip_beta, _ = multiply_add(du_beta - mean_beta, t_s, left_beta, DROP, RIPPLE_W)
    mean_d = s.mean_d + round_half_up((clamp(du_d, -VECTOR, VECTOR - 1) << SHOWN) - s.mean_d, FADE_MEAN)
    mean_q = s.mean_q + round_half_up((clamp(du_q, -VECTOR, VECTOR - 1) << SHOWN) - s.mean_q, FADE_MEAN)
    if not (x.run and x.voltage_known):
        mean_d, mean_q, rip_alpha, rip_beta = 0, 0, 0, 0
    following = State(mean_d, mean_q, rip_alpha, rip_beta)
    return following, (round_half_up(rip_alpha, TO_PU), round_half_up(rip_beta, TO_PU))


def reference(v, state):
    if not (v["run"] and v["voltage_known"]):
        return {"rip_alpha": 0.0, "rip_beta": 0.0}
    c, s = v["cos_theta"], v["sin_theta"]
    mean_d, mean_q = (round_half_up(x, SHOWN) * PU.lsb for x in (state.mean_d, state.mean_q))
    means = {"alpha": mean_d * c - mean_q * s, "beta": mean_q * c + mean_d * s}
    out = {}
    for x, old in (("alpha", state.rip_alpha), ("beta", state.rip_beta)):
        du = min(max(v[f"u_applied_{x}"] - v[f"u_{x}"], -VECTOR * PU.lsb), (VECTOR - 1) * PU.lsb)
        out[f"rip_{x}"] = RIPPLE.limit(v["t_s"] * (du - means[x]) + old * RIPPLE.lsb * (1.0 - 2.0**-FADE))
    return out


def bound(v, _state):
    """Half an LSB of the difference and of the turned mean, times t_s; of the increment, the decay and the output."""
    each = v["t_s"] * PU.lsb + RIPPLE.lsb + PU.lsb / 2
    return {"rip_alpha": each, "rip_beta": each}


def stimuli(rng, _config):
    """Ripple at both ends, turning and standing; differences beyond the limit; stops and unknown voltage."""
    rows = []
    for k in range(120):
        c, s = ((65536, 0), (0, 65536), (-46341, 46341), (60547, -25080))[k // 5 % 4]
        size = FLUX.hi if k % 40 < 12 else FLUX.lo if k % 40 < 24 else int(rng.integers(-(1 << 22), 1 << 22))
        row = {"u_applied_alpha": size, "u_applied_beta": -1 - size, "u_alpha": int(rng.integers(-40000, 40000))}
        row |= {"u_beta": int(rng.integers(-40000, 40000)), "cos_theta": c, "sin_theta": s, "t_s": 131071 >> (k % 3)}
        rows.append({**row, "run": int(k % 31 != 30), "voltage_known": int(k % 37 != 36)})
    calm = {"u_alpha": 0, "u_beta": 0, "cos_theta": 65536, "sin_theta": 0, "t_s": 100000, "run": 1, "voltage_known": 1}
    for size in (1 << 20, 63, 64, -64, -65, 0):
        rows += [{**calm, "u_applied_alpha": size, "u_applied_beta": -size}] * 12
    return rows


INPUTS = (
    Port("u_applied_alpha", FLUX, doc="voltage of the coming period, alpha"),
    Port("u_applied_beta", FLUX, doc="voltage of the coming period, beta"),
    Port("voltage_known", BIT, doc="0: gates off or bus reading lost"),
    Port("u_alpha", PU, lo=-VECTOR, hi=VECTOR - 1, doc="voltage of the last sample, alpha"),
    Port("u_beta", PU, lo=-VECTOR, hi=VECTOR - 1, doc="voltage of the last sample, beta"),
    *TRIG_PORTS,
    Port("run", BIT, doc="1: the gates are switching"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
Registers = namedtuple("Registers", [T_S.name])

BLOCK = Block(
    name="voltage_ripple",
    folder="estimators",
    paper="none: docs/overmodulation.md",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=(T_S,),
    outputs=RIP,
    state=State(),
    latency=11,
    interval=11,
    atomic=True,
    constants={
        "VECTOR": VECTOR,
        "MEAN_W": MEAN.width,
        "FADE_MEAN": FADE_MEAN,
        "FADE": FADE,
        "SHOWN": SHOWN,
        "RIPPLE_W": RIPPLE_W,
        "DROP": DROP,
        "TO_PU": TO_PU,
    },
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    possible=on_circle,
)
