# SPDX-License-Identifier: BSD-3-Clause
"""The references of a mode that begins: where the mode before ended, from there by limited steps to what is asked for.

    u_x_now = to u_x_ext by u_step at most                in voltage mode
            = u_x - u_comp_x                              else: the voltage that the motor has got
    i_d_now = i_d in voltage mode, else to i_d_source by i_step at most
    i_q_now = i_q_made                                    in voltage mode: what flows, or the estimated torque
            = to i_q_ext by i_step at most                in torque mode, while it holds
            = torque_ref                                  else: what the speed regulator gave
    omega_now = to omega_ref by omega_step at most        in speed mode, while it holds
              = omega_me                                  else: the speed that is there
    hold_d  = 1 in voltage mode and after it, until i_d_source is within i_step
    hold_q  = 1 outside of torque mode and in it, until i_q_ext is within i_step
    hold_omega = 1 outside of speed mode and in it, until omega_ref is within omega_step
    u_rest_x = u_x - u_dec_x - u_comp_x                   what is left to a current regulator at this voltage

All act on the next sample, beside everything else; i_d_now, i_q_now and omega_now only while they hold, so a mode that
has begun has its references as without this block.  ``run`` = 0: all references are zero and nothing holds.

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
    i_d_now: int = 0
    i_q_now: int = 0
    hold_d: int = 0
    hold_q: int = 0
    omega_now: int = 0
    hold_omega: int = 0


@kernel
def moved(target, now, most):
    """``now`` moved to ``target`` by ``most`` at most."""
    return clamp(target, now - most, now + most)


@kernel
def step(state, inputs, regs):
    x, r, s = inputs, regs, state
    free_d, free_q = x.u_d - x.u_comp_d, x.u_q - x.u_comp_q
    u_d_now, u_q_now = saturate(free_d, PU_W), saturate(free_q, PU_W)
    i_d_now, i_q_now = moved(x.i_d_source, s.i_d_now, r.i_step), moved(x.i_q_ext, s.i_q_now, r.i_step)
    hold_d = 1 if s.hold_d and i_d_now != x.i_d_source else 0
    hold_q = 1 if s.hold_q and i_q_now != x.i_q_ext else 0
    if x.by_voltage:
        u_d_now, u_q_now = moved(r.u_d_ext, s.u_d_now, r.u_step), moved(r.u_q_ext, s.u_q_now, r.u_step)
        i_d_now, i_q_now, hold_d, hold_q = x.i_d, x.i_q_made, 1, 1
    elif x.regulates:
        i_q_now, hold_q = x.torque_ref, 1
    elif not s.hold_q:
        i_q_now = x.torque_ref
    omega_now, hold_omega = x.omega_me, 1
    if x.by_speed:
        omega_now = moved(x.omega_ref, s.omega_now, r.omega_step)
        hold_omega = 1 if s.hold_omega and omega_now != x.omega_ref else 0
    if not x.run:
        u_d_now, u_q_now, i_d_now, i_q_now, hold_d, hold_q, omega_now, hold_omega = 0, 0, 0, 0, 0, 0, 0, 0
    rest_d, rest_q = saturate(free_d - x.u_dec_d, PU_W), saturate(free_q - x.u_dec_q, PU_W)
    now = State(u_d_now, u_q_now, i_d_now, i_q_now, hold_d, hold_q, omega_now, hold_omega)
    return now, (u_d_now, u_q_now, i_d_now, i_q_now, hold_d, hold_q, omega_now, hold_omega, rest_d, rest_q)


def reference(v, state):
    def towards(target, now, most):
        return now * PU.lsb + min(max(target - now * PU.lsb, -most), most)

    free = {x: v[f"u_{x}"] - v[f"u_comp_{x}"] for x in "dq"}
    rest = {f"u_rest_{x}": _within_pu(free[x] - v[f"u_dec_{x}"]) for x in "dq"}
    if not v["run"]:
        return rest | dict.fromkeys(("u_d_now", "u_q_now", "i_d_now", "i_q_now", "omega_now"), 0.0)
    rest["omega_now"] = towards(v["omega_ref"], state.omega_now, v["omega_step"]) if v["by_speed"] else v["omega_me"]
    if v["by_voltage"]:
        u_now = {f"u_{x}_now": towards(v[f"u_{x}_ext"], getattr(state, f"u_{x}_now"), v["u_step"]) for x in "dq"}
        return rest | u_now | {"i_d_now": v["i_d"], "i_q_now": v["i_q_made"]}
    holds = state.hold_q and not v["regulates"]
    i_now = {
        "i_d_now": towards(v["i_d_source"], state.i_d_now, v["i_step"]),
        "i_q_now": towards(v["i_q_ext"], state.i_q_now, v["i_step"]) if holds else v["torque_ref"],
    }
    return rest | {f"u_{x}_now": _within_pu(free[x]) for x in "dq"} | i_now


def _within_pu(x):
    return min(max(x, PU.lo * PU.lsb), PU.hi * PU.lsb)


def bound(_v, _state):
    return dict.fromkeys((p.name for p in OUTPUTS if p.fmt is PU), 0.0)  # sums and limits only: exact


def stimuli(rng, _config):
    """Both ends of every sum; targets within a step, at it and beyond it, in and after each mode; a stop."""
    rows = []
    for end in (PU.hi, PU.lo):
        for other in (PU.hi, PU.lo, 0):
            row = {f"u_{x}": end for x in "dq"} | {f"u_comp_{x}": other for x in "dq"}
            row |= {"run": 1, "u_step": 1, "i_step": 1, "omega_step": 1}
            rows += [row | {f"u_dec_{x}": dec for x in "dq"} for dec in (0, PU.hi, PU.lo)]
    for by_voltage, regulates in ((1, 0), (0, 0), (0, 1), (1, 1)):
        for most in (1, 777, PU.hi):
            for start in (0, 12345, PU.hi, PU.lo):
                base = {"u_d": start, "u_q": start, "torque_ref": start, "i_q_made": start, "i_d": start}
                base |= {"u_step": most, "i_step": most, "omega_step": most, "run": 1}
                for off in (-most - 1, -most, -most + 1, 0, most - 1, most, most + 1):
                    target = clamp(start + off, PU.lo, PU.hi)
                    aim = {"u_d_ext": target, "u_q_ext": -1 - target, "i_q_ext": target, "i_d_source": target}
                    after = base | aim | {"by_voltage": by_voltage, "regulates": regulates, "torque_ref": 4321}
                    aim |= {"omega_ref": target, "omega_me": start}
                    after |= {"by_speed": regulates, "omega_ref": target}
                    rows += [base | {"by_voltage": 1, "omega_me": start}, after, base | aim]
                    rows += [base | {"regulates": 1}, after, after, base | aim | {"by_speed": 1}]
    return rows + [rows[-1] | {"run": 0}, rows[-1], *({**rows[-1], "i_q_ext": int(rng.integers(99))},) * 3]


INPUTS = (
    Port("u_d", PU, doc="voltage, d axis"),
    Port("u_q", PU, doc="voltage, q axis"),
    Port("u_dec_d", PU, doc="rotational voltage, d axis"),
    Port("u_dec_q", PU, doc="rotational voltage, q axis"),
    Port("u_comp_d", PU, doc="compensation voltage, d axis"),
    Port("u_comp_q", PU, doc="compensation voltage, q axis"),
    Port("i_d", PU, doc="current, d axis"),
    Port("i_q_made", PU, doc="what flows: the current of the q axis, with the torque table the estimated torque"),
    Port("i_d_source", PU, doc="current reference of the host or of the torque table, d axis"),
    Port("i_q_ext", PU, doc="current reference of torque mode"),
    Port("torque_ref", PU, doc="output of the speed regulator"),
    Port("omega_me", PU, doc="measured electrical speed"),
    Port("omega_ref", PU, doc="speed reference of the host"),
    Port("by_voltage", BIT, doc="1: the voltage is the host's"),
    Port("by_speed", BIT, doc="1: speed mode"),
    Port("regulates", BIT, doc="1: the speed regulator acts"),
    Port("run", BIT, doc="1: the gates are switching"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("u_d_ext", PU, doc="voltage of voltage mode, d axis"),
    Port("u_q_ext", PU, doc="voltage of voltage mode, q axis"),
    Port("u_step", PU, lo=1, doc="largest change of a voltage of voltage mode per sample"),
    Port("i_step", PU, lo=1, doc="largest change of a current reference per sample after a change of modes"),
    Port("omega_step", PU, lo=1, doc="largest change of the speed reference per sample after a change of modes"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])
OUTPUTS = (
    Port("u_d_now", PU, doc="voltage of voltage mode for the next sample, d axis"),
    Port("u_q_now", PU, doc="voltage of voltage mode for the next sample, q axis"),
    Port("i_d_now", PU, doc="current reference for the next sample, d axis"),
    Port("i_q_now", PU, doc="reference of torque mode for the next sample"),
    Port("hold_d", BIT, doc="1: i_d_now is in force"),
    Port("hold_q", BIT, doc="1: i_q_now is in force"),
    Port("omega_now", PU, doc="speed reference for the next sample"),
    Port("hold_omega", BIT, doc="1: omega_now is in force"),
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
    latency=7,
    interval=7,
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
