# SPDX-License-Identifier: BSD-3-Clause
"""The voltage with which regulators and decoupling would answer the ripple of over-modulation, to be taken off.

    rip_dq = park(rip_alphabeta)                             flux linkage of the ripple: estimators/voltage_ripple
    u_rip_d =  k_ripple*rip_d + omega_me*rip_q               k_ripple = kp/L, the bandwidth of the current loop
    u_rip_q = -omega_me*rip_d + k_ripple*rip_q

The ripple is part of current and flux linkage.  The proportional part answers it with -kp/L*rip, the decoupling with
j*omega_me*rip; both would act 1.5 samples late, with any phase.  u_rip cancels them and acts on nothing else.

Formats: both steps as rotate, rounded half up to PU.  |rip| < 1/4 and factors below 2: no saturation.
"""

from golden_model.block import Block, Port
from golden_model.fixed import Format
from golden_model.formats import PU, TRIG
from golden_model.kernel import kernel
from golden_model.transforms import park
from golden_model.transforms.rotate import TRIG_PORTS, on_circle

RIPPLE = Format(1, -2, 23)  # flux linkage of the ripple, a quarter of its base at most
RIP_LO, RIP_HI = -(1 << (PU.frac_bits - 2)), 1 << (PU.frac_bits - 2)
assert PU.frac_bits == TRIG.frac_bits  # so the same rotation takes per-unit factors


@kernel
def step(rip_alpha, rip_beta, cos_theta, sin_theta, omega_me, k_ripple):
    rip_d, rip_q = park.step(rip_alpha, rip_beta, cos_theta, sin_theta)
    u_rip_d, u_rip_q = park.step(rip_d, rip_q, k_ripple, omega_me)  # a rotation with these for cosine and sine
    return u_rip_d, u_rip_q


def reference(v, _state):
    c, s, w, k = v["cos_theta"], v["sin_theta"], v["omega_me"], v["k_ripple"]
    d, q = v["rip_alpha"] * c + v["rip_beta"] * s, v["rip_beta"] * c - v["rip_alpha"] * s
    return {"u_rip_d": k * d + w * q, "u_rip_q": k * q - w * d}


def bound(v, _state):
    """Half an LSB of both components of the ripple, times their factors; half an LSB of the output."""
    each = (abs(v["omega_me"]) + v["k_ripple"]) * PU.lsb / 2 + PU.lsb / 2
    return {"u_rip_d": each, "u_rip_q": each}


def stimuli(_rng, _config):
    """The largest ripple at eight angles with speed and gain at their ends; one LSB of each; none."""
    rows = []
    for c, s in ((65536, 0), (0, 65536), (-65536, 0), (0, -65536), (46341, 46341), (-46341, 46341)):
        for a, b in ((RIP_HI, RIP_HI), (RIP_LO, RIP_LO), (RIP_HI, RIP_LO), (1, -1), (-1, 0), (0, 0)):
            for w, k in ((PU.hi, PU.hi), (PU.lo, PU.hi), (PU.hi, 0), (0, PU.hi), (1 << 15, 1 << 15), (-3, 5)):
                row = {"rip_alpha": a, "rip_beta": b, "cos_theta": c, "sin_theta": s}
                rows.append({**row, "omega_me": w, "k_ripple": k})
    return rows


RIP = (
    Port("rip_alpha", PU, lo=RIP_LO, hi=RIP_HI, doc="flux linkage of the ripple, alpha"),
    Port("rip_beta", PU, lo=RIP_LO, hi=RIP_HI, doc="flux linkage of the ripple, beta"),
)

BLOCK = Block(
    name="ripple_voltage",
    folder="control",
    paper="none: docs/overmodulation.md",
    step=step,
    inputs=(*RIP, *TRIG_PORTS, Port("omega_me", PU, doc="electrical speed")),
    registers=(Port("k_ripple", PU, lo=0, doc="bandwidth of the current loop, for the ripple of over-modulation"),),
    outputs=(
        Port("u_rip_d", PU, doc="voltage against the ripple, d axis"),
        Port("u_rip_q", PU, doc="voltage against the ripple, q axis"),
    ),
    latency=10,
    interval=9,
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    possible=on_circle,
)
