# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the current references: the circle of current_limit, the regulator within its limit, braking."""

from __future__ import annotations

import re

from scripts.prove.proof import Fault, Proof, committed

LIMIT = "control/current_limit.vhd"
SPEED = "control/speed_pi.vhd"
REGENERATION = "control/regeneration_limit.vhd"


def products(verilog: str) -> tuple[str, ...]:
    """The multipliers of a converted entity."""
    return tuple(m for m in re.findall(r"^module (\w+)", verilog, re.MULTILINE) if m.startswith("multiply_add"))


PROOFS = (
    Proof(
        name="current_circle",
        says="i_d**2 + i_q_max**2 <= i_max**2, i_q_max the largest that fits, i_d the nearest to its reference",
        entity="current_limit",
        harness=committed("current_limit.sv"),
        faults=(
            Fault("i_q_max one too large", LIMIT, "signed(resize(state.i_q_max, WIDTH));",
                  "signed(resize(state.i_q_max, WIDTH)) + 1;"),
            Fault("i_d not limited below", LIMIT, "elsif above_1(WIDTH) = '1' then", "elsif false then"),
            Fault("a step of the root missing", LIMIT, "count = WIDTH - 2 then", "count = WIDTH - 3 then"),
        ),
        method="bmc",
        depth=20,
        generics={"WIDTH": 4},
        assumed="references of 4 bits; two samples, from reset; they do not depend on each other",
        search_depth=20,
        patience=240,
    ),
    Proof(
        name="current_q_within",
        says="i_q_ref is within +-i_q_max in speed mode and in torque mode, whatever is asked for",
        entity="speed_pi",
        harness=committed("speed_pi.sv"),
        faults=(
            Fault("torque mode not limited", SPEED, "        i_q_ref       <= wanted;",
                  "        i_q_ref       <= i_q_ext when speed_mode = '0' else wanted;"),
        ),
        method="induction",
        depth=3,
        assumed="nothing; the products may have any value",
        cut=products,
    ),
    Proof(
        name="regeneration_brakes_less",
        says="the bus voltage changes no current that drives; one that brakes keeps its direction and does not grow",
        entity="regeneration_limit",
        harness=committed("regeneration_limit.sv"),
        faults=(
            Fault("driving limited as well", REGENERATION,
                  "(i_q_asked(PU_W - 1) xor omega_me(PU_W - 1)) and (or omega_me)", "or omega_me"),
            Fault("the limit in place of the current", REGENERATION,
                  "regen_limited <= past_0;\n        if past_0 = '1' then",
                  "regen_limited <= past_0;\n        if braking_0 = '1' and i_q_asked < 0 then"
                  "\n          i_q_ref <= -signed('0' & state.most);\n        elsif past_0 = '1' then"),
        ),
        method="induction",
        depth=3,
        search_depth=24,
    ),
)  # fmt: skip
