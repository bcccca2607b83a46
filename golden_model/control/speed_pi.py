# SPDX-License-Identifier: BSD-3-Clause
"""Speed regulator: from speed error to i_q reference, limited, with conditional integration.

    err     = omega_ref - omega_me
    u       = speed_kp*err + integral + torque_ff
    i_q_ref = limit(u, +-i_q_max)
    integral += speed_ki*err      unless u is beyond the limit and err pushes further, or regen_limited and err brakes

The limit i_q_max is what current_limit leaves beside i_d, in both modes.
Torque mode (``speed_mode`` = 0): i_q_ref is ``i_q_ext``, limited, and the integral follows it, so that
a change to speed mode with no speed error is bumpless.
``take_over``, the first sample of speed control or the first two of position control: the output is i_q_ext once
more, and the integral is what makes it so beside the proportional part, within its limit.
``regen_limited``: in the last sample the bus voltage limited the braking
current, see regeneration_limit.  ``run`` = 0: output and integral are zero.  torque_ff, of a trajectory, acts in
speed mode within the same limit; it is zero without one.

Formats: err saturated to PU; proportional part rounded half up and with torque_ff S(10,28), which holds every sum;
increment rounded half up to S(1,28), where 2**-16 * ki still counts; the integral is kept within +-i_q_max; sum exact,
rounded half up to PU.
"""

from typing import NamedTuple

from golden_model.block import Block, Port
from golden_model.fixed import Format, clamp, round_half_up, saturate
from golden_model.formats import BIT, INTEGRAL, KI, KP, PU, PU_TO_INTEGRAL, PU_W
from golden_model.kernel import kernel

PROPORTIONAL = Format(1, 10, 28)
PROPORTIONAL_W = PROPORTIONAL.width
DROP_P = PU.frac_bits + KP.frac_bits - PROPORTIONAL.frac_bits
DROP_I = PU.frac_bits + KI.frac_bits - INTEGRAL.frac_bits


class State(NamedTuple):
    integral: int = 0  # INTEGRAL


@kernel
def step(
    state, omega_ref, omega_me, i_q_ext, i_q_max, regen_limited, speed_mode, take_over, run, torque_ff, speed_kp,
    speed_ki,
):  # fmt: skip
    err = saturate(omega_ref - omega_me, PU_W)
    proportional = round_half_up(speed_kp * err, DROP_P) + (torque_ff << PU_TO_INTEGRAL)
    moved = state.integral + round_half_up(speed_ki * err, DROP_I)
    asked = round_half_up(proportional + state.integral, PU_TO_INTEGRAL) if speed_mode and not take_over else i_q_ext
    i_q_ref = clamp(asked, -i_q_max, i_q_max)
    limited = 1 if asked != i_q_ref else 0
    brakes = (err > 0 and omega_me < 0) or (err < 0 and omega_me >= 0)
    held = (asked > i_q_max and err > 0) or (asked < -i_q_max and err < 0) or (regen_limited and brakes)
    limit = i_q_max << PU_TO_INTEGRAL
    integral = i_q_ref << PU_TO_INTEGRAL
    if speed_mode:
        integral = state.integral if held else clamp(moved, -limit, limit)
    if take_over:
        integral = clamp((i_q_ext << PU_TO_INTEGRAL) - proportional, -limit, limit)
    if not run:
        integral, i_q_ref, limited = 0, 0, 0
    return State(integral), (i_q_ref, limited)


def reference(v, state):
    if not v["run"]:
        return {"i_q_ref": 0.0}
    err = PU.limit(v["omega_ref"] - v["omega_me"])
    regulated = v["speed_mode"] and not v["take_over"]
    asked = v["speed_kp"] * err + v["torque_ff"] + state.integral * INTEGRAL.lsb if regulated else v["i_q_ext"]
    return {"i_q_ref": min(max(asked, -v["i_q_max"]), v["i_q_max"])}


def bound(_v, _state):
    return {"i_q_ref": PROPORTIONAL.lsb / 2 + PU.lsb / 2}


def stimuli(rng, _config):
    """Saturation in both directions with recovery, torque mode, stop and restart; gains of every size; limits."""
    regs = {
        "speed_kp": 5 << 16,
        "speed_ki": 1 << 20,
        "i_q_max": 30000,
        "speed_mode": 1,
        "run": 1,
        "i_q_ext": 12345,
        "regen_limited": 0,
    }
    rows = []
    for target in (131071, 100, -131072, 0):
        rows += [{"omega_ref": target, "omega_me": w, **regs} for w in (0, 1000, target, target - 1, target + 1)]
    rows = [r for r in rows if -131072 <= r["omega_me"] <= 131071] * 2
    rows += [{**rows[0], "speed_mode": 0}, rows[0], {**rows[0], "run": 0}, rows[0]]
    for _ in range(24):  # the integral moves inside its limits, reaches them and comes back
        kp, ki, most = (int(2 ** rng.uniform(*span)) for span in ((4, 20), (4, 23), (6, 17)))
        regs = {**regs, "speed_kp": kp, "speed_ki": ki, "i_q_max": most}
        wide = 2 ** rng.uniform(2, 16)
        for k in range(24):
            err = int(rng.uniform(-1, 1) * wide) if k % 8 else int(rng.integers(-1, 2))
            rows.append({"omega_ref": err + 77, "omega_me": 77, **regs, "speed_mode": int(k != 20)})
        for k in range(16):  # braking that the bus limits, in both directions, and driving beside it
            err, omega = (int(s * rng.integers(1, 99)) for s in ((1, -1)[k % 2], (1, -1, 1, 0)[k // 2 % 4]))
            rows.append({"omega_ref": err + omega, "omega_me": omega, **regs, "regen_limited": int(k % 3 > 0)})
    still, one = {**regs, "speed_ki": 0, "speed_mode": 1}, 1 << KP.frac_bits
    for torque_ff in (1, -1, 5000, -5000, PU.hi, PU.lo):
        for err in (0, 1, -1, 4000, -4000, PU.hi, PU.lo):
            row = {**regs, "speed_mode": 1, "omega_me": 0, "omega_ref": err, "torque_ff": torque_ff}
            rows += [row, {**row, "speed_mode": 0}, {**row, "speed_kp": KP.hi}, {**row, "i_q_max": PU.hi}]
    for most in (PU.hi, 40000, 0):  # taken over with every sign of what is there and of the error, then regulated
        for i_q_ext in (0, 30000, -30000, most, -most):
            for err in (0, 1, -1, 900, -900, PU.hi, PU.lo):
                row = {**regs, "speed_mode": 1, "omega_me": 0, "omega_ref": err, "i_q_ext": i_q_ext, "i_q_max": most}
                row |= {"speed_kp": 20 << 16, "torque_ff": 333 * (most > 40000)}
                rows += [{**row, "take_over": 1}, {**row, "speed_ki": 0}, row]
    ends = [(PU.lo, PU.hi, PU.hi), (PU.hi, PU.lo, PU.hi)]  # the error at its own ends, shown by gains up to one
    ends += [(end + off, 0, 999) for off in range(-4, 5) for end in (999, -999)]  # the output at its limit
    for omega_ref, omega_me, i_q_max in ends:
        error = {**still, "omega_ref": omega_ref, "omega_me": omega_me, "i_q_max": i_q_max}
        for kp, ki in ((one, 0), (one // 2, 0), (one * 5 // 8, 0), (0, one), (0, 0)):
            rows += [{**error, "run": 0}, {**error, "speed_kp": kp, "speed_ki": ki}]
            rows += [{**error, "speed_kp": kp, "speed_ki": 0}] * 2
    return rows


def patient_stimuli(rng, _config):
    """The integral one bit beyond or below its limit, then roundings of its sum at which each of its low bits shows."""
    rows, one = [], 1 << DROP_I
    for bit in range(PU_TO_INTEGRAL):
        for sign in (1, -1):
            still = {"i_q_max": int(rng.integers(1 << 12, 1 << 16)), "run": 1, "speed_mode": 1, "speed_kp": 0}
            rows.append(still | {"speed_mode": 0, "i_q_ext": sign * PU.hi})
            for err in (sign, -sign):  # beyond, then below
                rows.append(still | {"omega_ref": err, "speed_ki": one << bit})
                for off in (-1, 0, 1, -1 << bit, 1 << bit):
                    size = max((1 << PU_TO_INTEGRAL - 1) + off, 0) << DROP_P
                    for k in (1, -1):
                        rows.append(still | {"omega_ref": k, "speed_kp": size, "speed_ki": 0})
    return rows


BLOCK = Block(
    name="speed_pi",
    folder="control",
    paper="001, section 5.3: speed regulator with limited current reference",
    step=step,
    inputs=(
        Port("omega_ref", PU, doc="speed reference"),
        Port("omega_me", PU, doc="electrical speed"),
        Port("i_q_ext", PU, doc="current reference of torque mode"),
        Port("i_q_max", PU, lo=0, doc="limit of the q axis, see current_limit"),
        Port("regen_limited", BIT, doc="1: the bus voltage limited the braking current of the last sample"),
        Port("speed_mode", BIT, doc="1: speed control, 0: torque control"),
        Port("take_over", BIT, doc="1: first sample of speed control, first two of position control, see mode_change"),
        Port("run", BIT, doc="0: output and integral zero"),
        Port("torque_ff", PU, doc="added in speed mode: torque or current of a trajectory's acceleration"),
    ),
    registers=(
        Port("speed_kp", KP, doc="proportional gain"),
        Port("speed_ki", KI, doc="integral gain times sample time"),
    ),
    outputs=(
        Port("i_q_ref", PU, doc="current reference, q axis"),
        Port("speed_limited", BIT, doc="1: output at its limit"),
    ),
    state=State(),
    latency=5,
    interval=5,
    constants={"DROP_P": DROP_P, "DROP_I": DROP_I, "PROPORTIONAL_W": PROPORTIONAL_W},
    reference=reference,
    bound=bound,
    stimuli=stimuli,
    patient_stimuli=patient_stimuli,
)
