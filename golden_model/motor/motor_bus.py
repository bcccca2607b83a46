# SPDX-License-Identifier: BSD-3-Clause
"""The bus of the inverter: a capacitor with what the legs take, a source with resistance and a brake resistor.

    u += k_source*(u_source - u) - inv_c*charge - k_brake*u       once a step
    rectifier = 1: the source takes nothing back;  brake = 1: the resistor is on
    inv_c = 0 or start: u = u_source, without a capacitor or with one that is charged

k_source and k_brake are a step's share of their time constants R C.  An explicit step of Euler is stable for any
values of their formats, which end at a 64th.  The three products go through one multiplier, one after the other.
Formats: u S(1,40), from zero to 2, the output and what is multiplied are cut to S(1,22); charge S(8,16);
inv_c U(-12,36), k_source and k_brake U(-6,30).  Products are rounded half up to 40 bits; u saturates at both ends.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, clamp, round_half_up
from golden_model.formats import BIT, MOTOR_CHARGE, MOTOR_VOLTAGE
from golden_model.kernel import kernel

BUS = Format(1, 1, 40)
INV_C, SHARE = Format(0, -12, 36), Format(0, -6, 30)
BUS_HI = BUS.hi
DROP = SHARE.frac_bits + MOTOR_VOLTAGE.frac_bits - BUS.frac_bits  # and of the charge
DROP_U = BUS.frac_bits - MOTOR_VOLTAGE.frac_bits
assert INV_C.frac_bits + MOTOR_CHARGE.frac_bits - BUS.frac_bits == DROP


class State(NamedTuple):
    u: int = 0


@kernel
def step(state, charge, u_source, brake, start, inv_c, k_source, k_brake, rectifier):
    u = state.u >> DROP_U
    fed = 0 if rectifier and u_source < u else u_source - u
    rest = state.u + round_half_up(fed * k_source, DROP) - round_half_up(charge * inv_c, DROP)
    if brake:
        rest = rest - round_half_up(u * k_brake, DROP)
    following = clamp(rest, 0, BUS_HI)
    if inv_c == 0 or start:
        following = u_source << DROP_U
    return State(following), (following >> DROP_U,)


def reference(v, state):
    u = state.u * BUS.lsb
    if v["inv_c"] == 0.0 or v["start"]:
        return {"u_dc": v["u_source"]}
    fed = v["u_source"] - u
    blocked = v["rectifier"] and (state.u >> DROP_U) * MOTOR_VOLTAGE.lsb > v["u_source"]
    after = u + (0.0 if blocked else fed * v["k_source"]) - v["inv_c"] * v["charge"]
    after -= v["k_brake"] * u if v["brake"] else 0.0
    return {"u_dc": min(max(after, 0.0), BUS.hi * BUS.lsb)}


def bound(v, _state):
    """The cut voltage in two products, three roundings, the cut of the output."""
    return {"u_dc": (v["k_source"] + v["k_brake"]) * MOTOR_VOLTAGE.lsb + 1.5 * BUS.lsb + MOTOR_VOLTAGE.lsb}


def stimuli(_rng, _config):
    """Up to both ends and back, the rectifier just conducting, each share alone, without a capacitor in between."""
    none = {"charge": 0, "u_source": 0, "brake": 0, "start": 0, "inv_c": 1, "k_source": 0, "k_brake": 0, "rectifier": 0}
    volt = 1 << MOTOR_VOLTAGE.frac_bits
    rows = []
    for rectifier in (0, 1):
        at = none | {"rectifier": rectifier}
        for u in (volt, MOTOR_VOLTAGE.hi, 0):
            rows.append(at | {"inv_c": 0, "u_source": u})
            for off in (-1, 0, 1):
                source = min(max(u + off, 0), MOTOR_VOLTAGE.hi)
                rows += [at | {"u_source": source, "k_source": SHARE.hi}] * 4
            for charge in (1, -1, 1 << 16, -(1 << 16), MOTOR_CHARGE.hi, MOTOR_CHARGE.lo):
                for inv_c in (1, 3 << 10, INV_C.hi):
                    rows += [at | {"charge": charge, "inv_c": inv_c}] * 2
            for k_brake in (1, 12345, SHARE.hi):
                rows += [at | {"brake": 1, "k_brake": k_brake, "u_source": u, "k_source": SHARE.hi >> 3}] * 3
                rows.append(at | {"k_brake": k_brake})
    for bit in range(24):  # each bit of a share, with a voltage that shows it
        rows.append(none | {"start": 1, "u_source": volt + volt // 3})
        rows += [none | {"brake": 1, "k_brake": 1 << bit}, none | {"k_source": 1 << bit, "u_source": 2}]
        rows += [
            none | {"inv_c": 1 << bit, "charge": MOTOR_CHARGE.lo >> 3},
            none | {"charge": 1 << bit, "inv_c": 1 << 20},
        ]
    for charge in (MOTOR_CHARGE.lo, MOTOR_CHARGE.hi):  # into the limits, and back by what the output hides
        rows += [none | {"charge": charge, "inv_c": INV_C.hi}] * 60
        rows += [none | {"charge": 1 if charge < 0 else -1, "inv_c": 1 << DROP}] * 2
    return rows


REGISTERS = (
    Port("inv_c", INV_C, doc="voltage per charge: one over the capacitance; 0: the bus is the source"),
    Port("k_source", SHARE, doc="share of the difference to the source that flows in a step"),
    Port("k_brake", SHARE, doc="share of the voltage that the brake resistor takes in a step"),
    Port("rectifier", BIT, doc="1: the source takes nothing back"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="motor_bus",
    folder="motor",
    paper="docs/hil.md: bus",
    step=step,
    inputs=(
        Port("charge", MOTOR_CHARGE, doc="charge that the legs took in the last step"),
        Port("u_source", MOTOR_VOLTAGE, lo=0, doc="voltage of the source"),
        Port("brake", BIT, doc="1: the brake resistor is on"),
        Port("start", BIT, doc="1: the capacitor is charged"),
    ),
    registers=REGISTERS,
    outputs=(Port("u_dc", MOTOR_VOLTAGE, lo=0, doc="bus voltage"),),
    state=State(),
    latency=8,
    interval=8,
    constants={"DROP": DROP, "DROP_U": DROP_U},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
