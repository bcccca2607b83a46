# SPDX-License-Identifier: BSD-3-Clause
"""Properties of field weakening and over-modulation: references in their circle, releases, the ends of a table."""

from __future__ import annotations

from scripts.prove.proof import Fault, Proof, committed

LOOP = "control/voltage_loop.vhd"
REFERENCE = "control/current_reference.vhd"
HEXAGON = "modulation/overmodulation.vhd"

PROOFS = (
    Proof(
        name="weakening_releases",
        says="from every share a positive step raises it or finds it at 1, a negative one lowers it or finds its least",
        entity="voltage_loop",
        harness=committed("voltage_loop.sv"),
        faults=(
            Fault("upper end wraps", LOOP, "elsif moved(MOVED_W - 1 downto SHARE_W) /= 0 then", "elsif false then"),
            Fault("lower end not held", LOOP, "elsif low(low'high) = '1' then", "elsif false then"),
            Fault("stuck at the lower end", LOOP, "elsif low(low'high) = '1' then",
                  "elsif low(low'high) = '1' or state.share(SHARE_W - 1 downto SHARE_W - 16) = share_min then"),
        ),
        depth=16,
        seen=("p", "state"),
        free=("p",),
        assumed="samples at least 13 clocks apart, run and share_min constant meanwhile; any products",
        search_depth=40,
    ),
    Proof(
        name="weakening_within",
        says="i_q of the table is within +-i_q_max, the room beside i_d in the current circle, for any table",
        entity="current_reference",
        harness=committed("current_reference.sv"),
        faults=(
            Fault("i_q of the table not limited", REFERENCE, "within(state.i_q, unsigned(i_q_max), 0);", "state.i_q;"),
        ),
    ),
    Proof(
        name="overmodulation_gain",
        says="the gain is that of the circle within it, of a step of the table beyond, of its last beyond the table",
        entity="overmodulation",
        harness=committed("overmodulation.sv"),
        faults=(
            Fault("a gain within the circle", HEXAGON, "index_9 <= 0;", "index_9 <= OVERMODULATION_STEPS;"),
            Fault("end of the table wraps", HEXAGON, "elsif step_8 >= OVERMODULATION_STEPS then", "elsif false then"),
        ),
        depth=16,
        seen=("beyond_8", "index_9"),
        free=("excess_7",),
        assumed="samples at least 14 clocks apart; any voltage and bus",
        search_depth=40,
    ),
)  # fmt: skip
