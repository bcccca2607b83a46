# SPDX-License-Identifier: BSD-3-Clause
"""The references of torque and voltage mode, which begin where the mode before ended.

    u_x_now = to u_x_ext by u_step at most               in voltage mode
            = u_x - u_comp_x                              else: the voltage that the motor has got
    i_q_now = to i_q_ext by i_step at most                in torque mode
            = i_q_made                                    in voltage mode: what flows, or the estimated torque
            = torque_ref                                  in speed and position mode: what the regulator asks for
    u_rest_x = u_x - u_dec_x - u_comp_x                   what is left to a current regulator at this voltage

All act on the next sample, beside everything else.  ``run`` = 0: i_q_now and u_x_now are zero, so both modes start from
zero.

Formats: PU; sums exact, saturated to PU, twice the largest voltage of the limiter.  Nothing is rounded.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import clamp, saturate
from golden_model.formats import BIT, PU, PU_W
from golden_model.kernel import kernel


class State(NamedTuple):
    u_d_now: int = 0  # PU
    u_q_now: int = 0
    i_q_now: int = 0


@kernel
def step(state, inputs, regs):
    x, r = inputs, regs
    free_d, free_q = x.u_d - x.u_comp_d, x.u_q - x.u_comp_q
    u_d_now, u_q_now = saturate(free_d, PU_W), saturate(free_q, PU_W)
    i_q_now = x.torque_ref
    if x.by_voltage:
        u_d_now = clamp(r.u_d_ext, state.u_d_now - r.u_step, state.u_d_now + r.u_step)
        u_q_now = clamp(r.u_q_ext, state.u_q_now - r.u_step, state.u_q_now + r.u_step)
        i_q_now = x.i_q_made
    elif not x.regulates:
        i_q_now = clamp(x.i_q_ext, state.i_q_now - r.i_step, state.i_q_now + r.i_step)
    if not x.run:
        u_d_now, u_q_now, i_q_now = 0, 0, 0
    rest_d, rest_q = saturate(free_d - x.u_dec_d, PU_W), saturate(free_q - x.u_dec_q, PU_W)
    return State(u_d_now, u_q_now, i_q_now), (u_d_now, u_q_now, i_q_now, rest_d, rest_q)


def reference(v, state):
    free = {x: v[f"u_{x}"] - v[f"u_comp_{x}"] for x in "dq"}
    now = {x: getattr(state, f"u_{x}_now") * PU.lsb for x in "dq"}
    out = {f"u_rest_{x}": PU.limit(free[x] - v[f"u_dec_{x}"]) for x in "dq"}

    def moved(target, last, step):
        return min(max(target, last - step), last + step)

    for x in "dq":
        u = moved(v[f"u_{x}_ext"], now[x], v["u_step"]) if v["by_voltage"] else PU.limit(free[x])
        out[f"u_{x}_now"] = u if v["run"] else 0.0
    i_q = moved(v["i_q_ext"], state.i_q_now * PU.lsb, v["i_step"])
    i_q = v["i_q_made"] if v["by_voltage"] else v["torque_ref"] if v["regulates"] else i_q
    return out | {"i_q_now": i_q if v["run"] else 0.0}


def bound(_v, _state):
    return dict.fromkeys((p.name for p in OUTPUTS), 0.0)


def stimuli(rng, _config):
    """Both ends of every sum; targets within a step, at it and beyond it, in each mode; a stop."""
    rows = []
    for end in (PU.hi, PU.lo):
        for other in (PU.hi, PU.lo, 0):
            row = {f"u_{x}": end for x in "dq"} | {f"u_comp_{x}": other for x in "dq"}
            rows += [row | {f"u_dec_{x}": dec for x in "dq"} | {"run": 1} for dec in (0, PU.hi, PU.lo)]
    for by_voltage, regulates in ((1, 0), (0, 0), (0, 1), (1, 1)):
        for step_ in (0, 1, 777, PU.hi):
            for start in (0, 12345, PU.hi, PU.lo):
                base = {"u_d": start, "u_q": start, "torque_ref": start, "i_q_made": start - 1 if start > 0 else 5}
                base |= {"u_step": step_, "i_step": step_, "run": 1, "regulates": regulates}
                for off in (-step_ - 1, -step_, -step_ + 1, 0, step_ - 1, step_, step_ + 1):
                    target = clamp(start + off, PU.lo, PU.hi)
                    aim = {"u_d_ext": target, "u_q_ext": -1 - target, "i_q_ext": target}
                    rows += [base | {"regulates": 1}, base | aim | {"by_voltage": by_voltage}]
    return rows + [rows[-1] | {"run": 0}, rows[-1], *({**rows[-1], "i_q_ext": int(rng.integers(99))},) * 3]


INPUTS = (
    Port("u_d", PU, doc="voltage, d axis"),
    Port("u_q", PU, doc="voltage, q axis"),
    Port("u_dec_d", PU, doc="rotational voltage, d axis"),
    Port("u_dec_q", PU, doc="rotational voltage, q axis"),
    Port("u_comp_d", PU, doc="compensation voltage, d axis"),
    Port("u_comp_q", PU, doc="compensation voltage, q axis"),
    Port("i_q_ext", PU, doc="current reference of torque mode"),
    Port("i_q_made", PU, doc="what flows: the current of the q axis, with the torque table the estimated torque"),
    Port("torque_ref", PU, doc="output of the speed regulator"),
    Port("by_voltage", BIT, doc="1: the voltage is the host's"),
    Port("regulates", BIT, doc="1: the speed regulator acts"),
    Port("run", BIT, doc="1: the gates are switching"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("u_d_ext", PU, doc="voltage of voltage mode, d axis"),
    Port("u_q_ext", PU, doc="voltage of voltage mode, q axis"),
    Port("u_step", PU, lo=0, doc="largest change of a voltage of voltage mode per sample"),
    Port("i_step", PU, lo=0, doc="largest change of the reference of torque mode per sample"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])
OUTPUTS = (
    Port("u_d_now", PU, doc="voltage of voltage mode for the next sample, d axis"),
    Port("u_q_now", PU, doc="voltage of voltage mode for the next sample, q axis"),
    Port("i_q_now", PU, doc="reference of torque mode for the next sample"),
    Port("u_rest_d", PU, doc="voltage left to the current regulator, d axis"),
    Port("u_rest_q", PU, doc="voltage left to the current regulator, q axis"),
)

BLOCK = Block(
    name="mode_references",
    folder="control",
    paper="none: docs/modes.md",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=OUTPUTS,
    state=State(),
    latency=3,
    interval=4,
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
