# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the encoder inputs: filter, decoder, counter within a turn."""

from __future__ import annotations

from scripts.prove.proof import Fault, Proof, committed

FILTER = "common/input_filter.vhd"
DECODER = "encoders/quadrature_decoder.vhd"
COUNTER = "encoders/turn_counter.vhd"


def proof(name: str, says: str, entity: str, macros: tuple[str, ...], *faults: Fault, **more) -> Proof:
    return Proof(
        name=f"encoder_{name}",
        says=says,
        entity=entity,
        harness=committed(f"{entity}.sv"),
        faults=faults,
        macros=macros,
        **more,
    )


PROOFS = (
    proof(
        "filter",
        "a level is accepted only after the pin has had it for filter_clocks + 1 clocks",
        "input_filter",
        (),
        Fault("a clock too early", FILTER, "state.elapsed >= filter_clocks", "state.elapsed + 1 >= filter_clocks"),
        Fault("a break does not count", FILTER, "      state.elapsed <= (others => '0');\n      if (counting",
              "      if (counting"),
        method="pdr",
        assumed="filter_clocks below 12 and constant",
        search_depth=40,
    ),
    proof(
        "legal",
        "if A and B never change together, no transition is illegal, and each change is one step",
        "quadrature_decoder",
        ("LEGAL",),
        Fault("phases in binary order", DECODER, "b & (a xor b)", "b & a"),
        Fault("first phase is a step", DECODER, "(state.seen and settled) = '1'", "settled = '1'"),
        assumed="A and B do not change at the same clock while settled",
    ),
    proof(
        "steps",
        "A leads B forward; A and B together are illegal and no step; forward is the direction of the last step",
        "quadrature_decoder",
        ("STEPS",),
        Fault("both together are a step", DECODER, "step_dn_0 <= '1' when change = 3",
              "step_dn_0 <= '1' when change >= 2"),
        Fault("direction not kept", DECODER, "step_up_0 or (state.forward and not step_dn_0)",
              "step_up_0 or state.forward"),
    ),
    proof(
        "count_range",
        "the count is below counts at every clock, whatever steps and corrections come",
        "turn_counter",
        ("RANGE",),
        Fault("a turn has one count more", COUNTER, "resize(state.count, 19) = state.counts - 1",
              "resize(state.count, 19) = state.counts"),
        Fault("new setting keeps the count", COUNTER, "        state.count   <= (others => '0');\n        state.code ",
              "        state.code "),
        assumed="counts, code_step and code_rest possible and constant",
        search_depth=30,
    ),
    proof(
        "count_no_jump",
        "the count moves by one at most: by a step, which is never lost, or by a correction at a sample or on the way",
        "turn_counter",
        ("NO_JUMP",),
        Fault("correction at every clock", COUNTER, "(sample or state.moving) and not stepped and", "not stepped and"),
        Fault("sample hides a step", COUNTER, "up      <= step_up or (mend",
              "up      <= (step_up and not sample) or (mend"),
        assumed="counts, code_step and code_rest possible and constant",
    ),
)  # fmt: skip
