# SPDX-License-Identifier: BSD-3-Clause
"""Position over several turns, and the position regulator over the speed loop.

    position(k)    = position(k-1) + wrap(code(k) - code(k-1))        modulo 2**14 turns
    position_error = position_ref - position, the shorter way, limited to half a turn
    e              = 0 where ``at_rest`` and |position_error| <= position_band, else position_error
    omega_asked    = limit(position_kp*e + omega_ff, +-omega_most)

Without ``position_mode`` omega_asked is omega_ref, regulated as ``speed_mode`` says; the position is counted all the
same.  The first sample after reset is within its turn: position is the code.  A sample with ``position_restart`` has no
predecessor and does not move the position.  The dead band ends the search for a position between two counts, which
Coulomb friction and the integral of the speed regulator would keep up for ever.

Formats: position S(13,18) turns, wraps; position_error S(-1,18), saturated; the proportional part is rounded half up to
the 28 fraction bits of omega_ff and added exactly; the sum is rounded half up to PU and kept within +-omega_most.
"""

from collections import namedtuple
from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, clamp, round_half_up, saturate, wrap_s
from golden_model.formats import BIT, INTEGRAL, KP, PU, PU_TO_INTEGRAL, TURN_W
from golden_model.io.position import code_format
from golden_model.kernel import kernel

POSITION = Format(1, 13, 18)  # turns of the shaft
POSITION_W = POSITION.width
ERROR = Format(1, -1, 18)
ERROR_W = ERROR.width
SUM_W = Format(1, 9, 28).width
DROP_P = ERROR.frac_bits + KP.frac_bits - INTEGRAL.frac_bits


class State(NamedTuple):
    code: int = 0
    seen: int = 0
    position: int = 0  # POSITION


@kernel
def step(state, inputs, regs, position_bits):
    x, r = inputs, regs
    aligned = x.code_theta << (TURN_W - position_bits)
    mech = -aligned if r.reverse else aligned
    delta = wrap_s(mech - state.code, TURN_W)
    if r.position_restart:
        delta = 0
    position = wrap_s(state.position + delta, POSITION_W)
    if not state.seen:
        position = mech & ((1 << TURN_W) - 1)
    error = saturate(wrap_s(x.position_ref - position, POSITION_W), ERROR_W)
    used = 0 if x.at_rest and -r.position_band <= error <= r.position_band else error
    asked = round_half_up(x.omega_ff + round_half_up(r.position_kp * used, DROP_P), PU_TO_INTEGRAL)
    omega_asked = clamp(asked, -r.omega_most, r.omega_most) if r.position_mode else x.omega_ref
    regulates = 1 if r.position_mode or x.speed_mode else 0
    return State(mech, 1, position), (position, error, omega_asked, regulates)


def _exact(v, state):
    """Position of a sample in turns, and its error."""
    mech = -v["code_theta"] if v["reverse"] else v["code_theta"]
    position = mech % 1.0
    if state.seen:
        delta = (mech - state.code / 2**TURN_W + 0.5) % 1.0 - 0.5
        position = state.position * POSITION.lsb + (0.0 if v["position_restart"] else delta)
    position = (position + 8192.0) % 16384.0 - 8192.0
    return position, ERROR.limit((v["position_ref"] - position + 8192.0) % 16384.0 - 8192.0)


def reference(v, state):
    position, error = _exact(v, state)
    regulates = float(bool(v["position_mode"] or v["speed_mode"]))
    used = 0.0 if v["at_rest"] and abs(error) <= v["position_band"] else error
    asked = v["position_kp"] * used + v["omega_ff"]
    omega = min(max(asked, -v["omega_most"]), v["omega_most"]) if v["position_mode"] else v["omega_ref"]
    return {"shaft_position": position, "position_error": error, "omega_asked": omega, "regulates": regulates}


def bound(_v, _state):
    """Rounding of the proportional part and of the sum."""
    return {
        "shaft_position": 0.0,
        "position_error": 0.0,
        "omega_asked": INTEGRAL.lsb / 2 + PU.lsb / 2,
        "regulates": 0.0,
    }


def stimuli(rng, config):
    """Turns in both directions, errors at both ends and around the dead band, limits, modes, restarts."""
    size, turn = 1 << config["POSITION_BITS"], 1 << TURN_W
    calm = {"position_kp": 3 << 16, "position_band": 4, "omega_most": 60000, "position_mode": 1, "omega_ref": -777}
    rows, code = [], 0
    for speed in (0, 1, -1, size // 9, -size // 9, size // 2 - 1, size // 2, size // 2 + 1):
        for k in range(14):
            code = (code + speed) % size
            moving = {**calm, "code_theta": code, "reverse": int(k > 11), "position_restart": int(k == 9)}
            rows.append({**moving, "position_ref": int(rng.integers(-turn, turn)), "speed_mode": k & 1})
    here = code * turn // size
    for sign in (1, -1):
        for off in (0, 1, 3, 4, 5, turn // 2 - 1, turn // 2, turn // 2 + 1, 1 << 31):
            for rest in (0, 1):
                row = {**calm, "code_theta": code, "at_rest": rest, "position_restart": 1}
                rows.append({**row, "position_ref": wrap_s(here + sign * off, POSITION_W)})
    for _ in range(150):
        code = int(rng.integers(size))
        row = {**calm, "code_theta": code, "position_ref": int(rng.integers(-turn, turn)) >> int(rng.integers(18))}
        row |= {"position_kp": int(2 ** rng.uniform(0, 24)), "omega_most": int(2 ** rng.uniform(0, 17))}
        row |= {"omega_ff": int(rng.integers(INTEGRAL.lo, INTEGRAL.hi)) >> int(rng.integers(12))}
        rows.append(row | {"position_mode": int(rng.integers(4) > 0), "position_band": int(rng.integers(65536))})
    return rows


INPUTS = (
    Port("code_theta", Format(0, 0, 16), doc="position code, one mechanical turn"),
    Port("position_ref", POSITION, doc="reference of the trajectory for this sample, turns of the shaft"),
    Port("omega_ff", INTEGRAL, doc="speed of the trajectory"),
    Port("at_rest", BIT, doc="1: the trajectory stands, the dead band acts"),
    Port("omega_ref", PU, doc="speed reference of the host"),
    Port("speed_mode", BIT, doc="1: speed control, 0: torque control"),
)
Inputs = namedtuple("Inputs", [p.name for p in INPUTS])
REGISTERS = (
    Port("reverse", BIT, doc="1: code counts opposite to the phase order"),
    Port("position_restart", BIT, doc="1: the code has nothing to do with the one of the sample before"),
    Port("position_mode", BIT, doc="1: position control, over speed control"),
    Port("position_kp", KP, doc="speed per turn of position error"),
    Port("position_band", Format(0, -2, 18), doc="largest position error that is left at rest"),
    Port("omega_most", PU, lo=0, doc="largest speed reference of the position regulator"),
)
Registers = namedtuple("Registers", [p.name for p in REGISTERS])

BLOCK = Block(
    name="position_control",
    folder="control",
    paper="none: docs/position.md",
    step=step,
    takes=(Inputs, Registers),
    inputs=INPUTS,
    registers=REGISTERS,
    outputs=(
        Port("shaft_position", POSITION, doc="position, turns of the shaft"),
        Port("position_error", ERROR, doc="following error, turns of the shaft"),
        Port("omega_asked", PU, doc="speed reference of the position regulator or of the host"),
        Port("regulates", BIT, doc="1: the speed regulator acts"),
    ),
    state=State(),
    latency=7,
    interval=7,
    constants={"SUM_W": SUM_W, "DROP_P": DROP_P, "POSITION_W": POSITION_W, "ERROR_W": ERROR_W},
    configs=({"POSITION_BITS": 16}, {"POSITION_BITS": 12}, {"POSITION_BITS": 18}),
    width_from={"code_theta": code_format},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
)
