# SPDX-License-Identifier: BSD-3-Clause
"""Whether encoder and motor agree: the EMF that the voltage shows against the one that angle and speed promise.

    e_d  = u_d - u_comp_d - r_s*i_d - emf_l*(i_d - mean_d) + omega_me*model_q      what is left of the voltage
    e_q  = u_q - u_comp_q - r_s*i_q - emf_l*(i_q - mean_q) - omega_me*model_d
    mean += (i - mean)/8 after each sample, so emf_l = L/(8*T_s) makes L*di/dt of the difference
    most = emf_min + emf_i*|i| + emf_w*|omega_me|            what the drive's data may be wrong by
    over = |e| > most

In steady state nothing is left.  With an encoder that stands while the motor turns the EMF is left; with one that
turns while the motor stands, or with a wrong angle, the promise.  ``encoder_lost`` when ``emf_samples`` more samples
were over than not; a step of the current lasts shorter.  ``emf_samples`` = 0 or ``run`` = 0: nothing is
counted.
|x| of a vector is the larger component and half the smaller one, up to 12 % more than its length.

Formats: fluxes S(1,23), model saturated; products cut (floor) to 2**-16; |x| of a component is the one's complement
where it is negative; |i| saturates at 2, the difference at 1, mean is cut from three bits below.  The counter
saturates.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.estimators.flux_models import DROP_MODEL, MODEL_FLUX, MODEL_MAX
from golden_model.fixed import Format, length, saturate
from golden_model.formats import BIT, FLUX, FLUX_W, PU, PU_W, RESISTANCE
from golden_model.kernel import kernel

EMF_MIN = Format(0, 1, 16)
EMF_L = Format(0, 2, 22)
EMF_I = Format(0, 0, 23)
EMF_W = Format(0, 1, 23)
SAMPLES = Format(0, 12, 0)
SAMPLES_HI, PU_HI = SAMPLES.hi, PU.hi
DROP = FLUX.frac_bits  # of a product, from 39 fraction bits to 16
HALF_R = RESISTANCE.frac_bits - FLUX.frac_bits
MEAN = 3  # 2**MEAN samples


class State(NamedTuple):
    sum_d: int = 0  # 2**MEAN times the mean
    sum_q: int = 0
    count: int = 0


@kernel
def step(state, inputs, regs):
    x, r = inputs, regs
    r_s = r.r_s >> HALF_R
    flux_d, flux_q = saturate(x.model_d >> DROP_MODEL, FLUX_W), saturate(x.model_q >> DROP_MODEL, FLUX_W)
    mean_d, mean_q = state.sum_d >> MEAN, state.sum_q >> MEAN
    change_d, change_q = saturate(2 * (x.i_d - mean_d), PU_W), saturate(2 * (x.i_q - mean_q), PU_W)
    e_d = x.u_d - x.u_comp_d - ((x.i_d * r_s) >> DROP) + ((x.omega_me * flux_q) >> DROP)
    e_d -= (change_d * r.emf_l) >> DROP
    e_q = x.u_q - x.u_comp_q - ((x.i_q * r_s) >> DROP) - ((x.omega_me * flux_d) >> DROP)
    e_q -= (change_q * r.emf_l) >> DROP
    current = min(length(x.i_d, x.i_q), PU_HI)
    speed = x.omega_me if x.omega_me >= 0 else -1 - x.omega_me
    most = r.emf_min + ((current * r.emf_i) >> DROP) + ((speed * r.emf_w) >> DROP)
    over = length(e_d, e_q) > most
    count = min(state.count + 1, SAMPLES_HI) if over else max(state.count - 1, 0)
    if not x.run or r.emf_samples == 0:
        count = 0
    following = State(state.sum_d + x.i_d - mean_d, state.sum_q + x.i_q - mean_q, count)
    return following, (1 if count > 0 and count >= r.emf_samples else 0,)


def stimuli(rng, _config):
    """Each term alone at its limit and beside it, with both signs; everything at its end; counts up, down, stopped."""
    usual = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"run": 1, "emf_samples": 1}
    rows = []
    for size in (0, 1, 999, 40000, PU.hi):
        for off in (-1, 0, 1):
            for name in ("u_d", "u_q", "u_comp_d", "u_comp_q"):
                for sign in (1, -1):
                    value = max(PU.lo, min(PU.hi, sign * size - (sign < 0)))
                    rows.append(usual | {name: value, "emf_min": max(0, min(size + off, EMF_MIN.hi))})
    ends = {p.name: (p.low, p.high) for p in BLOCK.inputs + BLOCK.registers if p.name not in ("run", "emf_samples")}
    for k in range(160):
        rows.append(usual | {n: int(rng.choice(v)) for n, v in ends.items()} | {"emf_samples": int(rng.integers(1, 4))})
        drawn = {n: int(rng.integers(lo >> k % 9, (hi >> k % 9) + 1)) for n, (lo, hi) in ends.items()}
        rows.append(usual | drawn | {"emf_samples": 1})
    for size in (*(1 << bit for bit in range(17)), PU.hi):  # a step of the current, and what is left of it
        for emf_l in (1 << 20, EMF_L.hi, 1 << int(rng.integers(24))):
            row = usual | {
                "i_d": size,
                "i_q": -size - 1,
                "emf_l": emf_l,
                "emf_min": min(size * emf_l >> 22, EMF_MIN.hi),
            }
            rows += [row] * 12 + [usual] * 9
    for _ in range(400):  # a voltage that balances the rest but for the limit, or a few LSB
        row = usual | {n: int(rng.integers(PU.lo >> 2, PU.hi >> 2)) for n in ("i_d", "i_q", "omega_me")}
        row |= {n: int(rng.integers(-(1 << 36), 1 << 36)) for n in ("model_d", "model_q")}
        row |= {"r_s": int(rng.integers(RESISTANCE.hi)) >> 1, "emf_i": int(rng.integers(EMF_I.hi)) >> 2}
        row |= {"emf_w": int(rng.integers(EMF_W.hi)) >> 3, "emf_min": int(rng.integers(500))}
        w, i_d, i_q = row["omega_me"], row["i_d"], row["i_q"]
        r_s = row["r_s"] >> HALF_R
        u_d = ((i_d * r_s) >> DROP) - ((w * (row["model_q"] >> DROP_MODEL)) >> DROP)
        u_q = ((i_q * r_s) >> DROP) + ((w * (row["model_d"] >> DROP_MODEL)) >> DROP)
        most = row["emf_min"] + ((length(i_d, i_q) * row["emf_i"]) >> DROP)
        most += (((w if w >= 0 else -1 - w) * row["emf_w"]) >> DROP) + int(rng.integers(-1, 3))
        axis = rng.integers(2)
        row |= {"u_d": u_d + most * (1 - axis), "u_q": u_q + most * axis}
        rows.append({n: max(PU.lo, min(PU.hi, int(v))) if n[0] == "u" else int(v) for n, v in row.items()})
    for wanted in (0, 1, 2, 3, 9):
        for over, clocks in ((1, 11), (0, 4), (1, 3), (0, 30), (1, wanted + 1)):
            rows += [usual | {"u_d": 100 * over, "emf_samples": wanted}] * clocks
        rows += [usual | {"u_d": 100, "emf_samples": wanted, "run": 0}, usual | {"emf_samples": wanted}]
    return rows


def patient_stimuli(_rng, _config):
    """Counts at each bit of the counter, and past its end."""
    usual = {p.name: 0 for p in BLOCK.inputs + BLOCK.registers} | {"run": 1, "u_q": -100}
    rows = []
    for bit in range(SAMPLES.width):
        rows += [usual | {"emf_samples": 1 << bit}] * ((1 << bit) + 1) + [usual | {"run": 0}]
    return (
        rows + [usual | {"emf_samples": SAMPLES_HI}] * (SAMPLES_HI + 2) + [usual | {"u_q": 0, "emf_samples": 4094}] * 3
    )


INPUTS = (
    Port("u_d", PU, doc="voltage, d axis"),
    Port("u_q", PU, doc="voltage, q axis"),
    Port("u_comp_d", PU, doc="compensation voltage, d axis"),
    Port("u_comp_q", PU, doc="compensation voltage, q axis"),
    Port("i_d", PU, doc="current, d axis"),
    Port("i_q", PU, doc="current, q axis"),
    Port("model_d", MODEL_FLUX, -MODEL_MAX, MODEL_MAX, "flux linkage of the current model, d axis"),
    Port("model_q", MODEL_FLUX, -MODEL_MAX, MODEL_MAX, "flux linkage of the current model, q axis"),
    Port("omega_me", PU, doc="electrical speed"),
    Port("run", BIT, doc="1: gates are switching"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("r_s", RESISTANCE, doc="winding resistance"),
    Port("emf_min", EMF_MIN, doc="voltage that the EMF may be wrong by at rest without current"),
    Port("emf_l", EMF_L, doc="inductance over eight samples"),
    Port("emf_i", EMF_I, doc="the same for each current"),
    Port("emf_w", EMF_W, doc="the same for each electrical speed"),
    Port("emf_samples", SAMPLES, doc="samples with a wrong EMF, more than right ones, that are a lost encoder; 0: off"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="emf_check",
    folder="io",
    paper="none: protection and diagnosis of the drive",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(Port("encoder_lost", BIT, doc="1: encoder and EMF contradict each other"),),
    state=State(),
    latency=13,
    interval=13,
    constants={"DROP": DROP, "HALF_R": HALF_R, "MEAN": MEAN},
    reference=None,
    bound=None,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
