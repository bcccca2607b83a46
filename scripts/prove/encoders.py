# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the encoder inputs: filter, decoder, counter within a turn, time over whole lines, Hall angle."""

from __future__ import annotations

from scripts.prove.proof import Fault, Proof, committed

FILTER = "common/input_filter.vhd"
DECODER = "encoders/quadrature_decoder.vhd"
COUNTER = "encoders/turn_counter.vhd"
HALL = "encoders/hall_angle.vhd"
LINES = "encoders/line_timer.vhd"


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
    proof(
        "line_known",
        "a span is known only where the shaft has turned a whole line in one direction since the last rest",
        "line_timer",
        ("KNOWN",),
        Fault("a reversal keeps the stamps", LINES, "known      := state.known and not (still or turned)",
              "known      := state.known and not still"),
        Fault("a rest keeps the window's stamp", LINES, "base_known := state.base_known and not (still or turned)",
              "base_known := state.base_known and not turned"),
        Fault("the next line always known", LINES, "<= known(to_integer(following))", "<= '1'"),
        method="pdr",
        generics={"TIME_W": 4},
        assumed="no step in both directions at once",
    ),
    proof(
        "line_span",
        "line_span is from the last edge of this kind before the window to this one, next_span from a line before the "
        "next one; known where the run holds them, and only there",
        "line_timer",
        ("SPANS",),
        Fault("an edge with take is of the old window", LINES, "state.fresh(to_integer(kind)) or take",
              "state.fresh(to_integer(kind))"),
        Fault("a reversal passes a new edge", LINES, "(edge and state.seen and not turned) = '0'",
              "(edge and state.seen) = '0'"),
        Fault("the line of the next edge but one", LINES, "last(to_integer(following))",
              "last(to_integer(following + 1))"),
        method="bmc",
        depth=12,
        generics={"TIME_W": 4},
        assumed="no step in both directions at once; times of 6 bits",
        patience=240,
    ),
    proof(
        "hall_within",
        "the angle is within the sector of its sample, and its middle where no edge came since a skipped sector",
        "hall_angle",
        (),
        Fault("from the middle on", HALL, "-HALF_SECTOR when within = '1' else", "HALF_SECTOR when within = '1' else"),
        Fault("a skipped sector forgotten", HALL, "        seen <= '0';\n      elsif", "        null;\n      elsif"),
        Fault("the middle of now", HALL, "theta <= begin_at +", "theta <= middle +"),
        spies=("clock", "part", "place", "begin_at", "middle", "seen"),
        search_generics={"TIME_W": 4},
        search_depth=32,
        patience=120,
    ),
)  # fmt: skip
