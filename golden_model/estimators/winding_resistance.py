"""The winding's resistance, and the flux that it takes away in half a sample.

    r   = r_s
    rho = r_s*t_s/2          t_s: the sample time in per unit, T_s*omega_base

rho is what flux_merge and flux_estimate multiply by a current: half a sample's resistive drop, integrated.
Both start from the one register, so they cannot contradict each other.
Formats: product 42 fraction bits, rounded half up to U(0,24).  No overflow: r_s < 1, t_s < 1/2, rho < 1/4.
"""

from golden_model.block import Block, Port
from golden_model.fixed import round_half_up
from golden_model.formats import RESISTANCE, SAMPLE_TIME
from golden_model.kernel import kernel

DROP = SAMPLE_TIME.frac_bits + 1


@kernel
def step(r_s, t_s):
    prod = r_s * t_s
    return r_s, round_half_up(prod, DROP)


def reference(v, _state):
    return {"r": v["r_s"], "rho": v["r_s"] * v["t_s"] / 2}


def bound(_v, _state):
    return {"r": 0.0, "rho": RESISTANCE.lsb / 2}


T_S = Port("t_s", SAMPLE_TIME, doc="sample time, per unit")
R = Port("r", RESISTANCE, doc="winding resistance in use")
RHO = Port("rho", RESISTANCE, doc="flux taken away in half a sample, per unit of current")

BLOCK = Block(
    name="winding_resistance",
    folder="estimators",
    paper="001, eq. (5): the resistive drop",
    step=step,
    inputs=(),
    registers=(Port("r_s", RESISTANCE, doc="winding resistance"), T_S),
    outputs=(R, RHO),
    latency=2,
    constants={"DROP": DROP},
    reference=reference,
    bound=bound,
)
