# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the motor of the FPGA: sums that fit, friction that only brakes."""

from __future__ import annotations

from collections.abc import Callable

from scripts.prove.pipeline import ports
from scripts.prove.proof import Fault, Proof

INVERTER, SHAFT, FILTER = "motor/motor_inverter.vhd", "motor/motor_shaft.vhd", "motor/motor_filter.vhd"

# The voltages of leg a as the entity takes them, summed in 34 bits
SUM = """\
  reg signed [23:0] high, low, off;
  reg h, l, t;
  reg signed [33:0] wide, last;
  reg [5:0] n = 0;  // clocks in the sum
  wire signed [23:0] u = h ? high : l ? low : off;
  always @(posedge clk) begin
    if (tick) {high, low, off} <= {high_a, low_a, off_a};
    {h, l, t} <= {gate_high[0], gate_low[0], tick};
    n <= t ? 1 : n + 1;
    wide <= t ? u : wide + u;
    if (t) last <= wide;
    if (rst) {high, low, off, h, l, t, wide, last, n} <= 0;
  end
  always @* assume (n < 31 || t);

  always @(posedge clk) if (begun) begin
    assert ($signed(leg_a) == last);
    cover (last > 34'sd200000000);
`ifdef LEMMAS
    assert ({spy_tick_1, spy_gate_high_1[0], spy_gate_low_1[0]} == {t, h, l});
    assert (spy_sum[86:58] == wide[28:0] && n <= 31);
    assert (spy_high[71:48] == high && spy_low[71:48] == low && spy_off[71:48] == off);
    assert (wide <= 34'sd8388608 * $signed({1'b0, n}) && wide >= -34'sd8388608 * $signed({1'b0, n}));
`endif
  end
"""

BRAKES = """\
  reg [3:0] n = 0;  // clocks since a sample went in, 0 without one
  reg seen = 0;
  reg signed [24:0] last = 0;  // speed before this sample
  always @(posedge clk) begin
    n <= rst ? 0 : in_valid ? 1 : n == 13 || n == 0 ? 0 : n + 1;
    if (rst) seen <= 0;
    else if (n == 13) seen <= 1;
    if (in_valid) last <= $signed(omega_m);
  end
  always @* if (in_valid) assume (n == 0 || n == 13);
  always @* assume (!hold && coulomb != 0);

  always @(posedge clk) if (begun && seen && n == 13) begin
    assert (!(last > 0 && $signed(omega_m) < 0) && !(last < 0 && $signed(omega_m) > 0));
    cover (last > 0 && $signed(omega_m) == 0);
  end
`ifdef LEMMAS
  wire signed [43:0] omega = spy_omega_10;
  integer k;
  always @(posedge clk) if (begun) begin
    for (k = 1; k <= 13; k = k + 1) assert (spy_valid[13 - k] == (n == k));
    if ((seen && n != 10 && n != 11 && n != 12) || n == 13) assert ($signed(omega_m) == omega >>> 19);
    if (seen && n != 0 && n != 13) assert ($signed(omega_m) == last);
    if (seen && n >= 10 && n <= 12) assert (!(last > 0 && omega < 0) && !(last < 0 && omega > 0));
  end
`endif
"""

# A phase on its way through the ring, with the current that entered beside it
BETWEEN = """\
  reg [3:0] n = 0;  // clocks since a sample went in, 0 without one
  wire [3:0] now = in_valid ? 0 : n;
  reg signed [24:0] i_1, i_2, i_3, d_2;
  reg signed [40:0] y_3, rest_3;
  reg added = 0, turned = 0, cleared = 1;
  wire signed [17:0] i = now == 1 ? i_b : now == 2 ? i_c : i_a;
  wire signed [23:0] old = y_3[40:17], new = seen_y_3[40:17];
  always @(posedge clk) begin
    n <= rst ? 0 : in_valid ? 1 : n == 7 || n == 0 ? 0 : n + 1;
    {i_1, i_2, i_3} <= {{i[17], i, 6'b0}, i_1, i_2};
    d_2 <= seen_d_1;
    y_3 <= seen_y_2;
    rest_3 <= seen_y_3;
    turned <= now <= 5 && (in_valid || n != 0);
    cleared <= rst;
    added <= !rst && n >= 2 && n <= 4;
  end
  always @* if (in_valid) assume (n == 0 || n == 7);
  reg signed [43:0] least, most;
  always @* begin
    most = (44'sd131072 * d_2) - d_2;  // the largest k
    least = 0;
    if (d_2 < 0) {least, most} = {most, 44'sd0};
    assume ($signed(seen_prod_2) >= least && $signed(seen_prod_2) <= most);
  end

  always @(posedge clk) if (begun && !added && !cleared) assert ($signed(seen_y_3) == (turned ? y_3 : rest_3));
  always @(posedge clk) if (begun && added) begin
    assert (old > i_3 || (new >= old && new <= i_3));
    assert (old < i_3 || ($signed(seen_y_3) <= y_3 && new >= i_3));
    cover (new > old && new < i_3);
  end
`ifdef LEMMAS
  integer k;
  always @(posedge clk) if (begun) begin
    for (k = 1; k <= 7; k = k + 1) assert (spy_valid[7 - k] == (n == k));
    if (n >= 1 && n <= 3) assert ($signed(seen_d_1) == i_1 - $signed(spy_y_1[40:17]));
    if (n >= 2 && n <= 4) assert (d_2 == i_2 - $signed(seen_y_2[40:17]));
  end
`endif
"""


def around(entity: str, body: str) -> Callable[[str], str]:
    """The harness of an entity: its inputs are free, a reset comes first."""

    def harness(verilog: str) -> str:
        found = ports(verilog, entity)
        own = [row for row in found if not row[2].startswith("spy_")]
        inputs = ",\n".join(f"    input {width} {name}" for direction, width, name in own if direction == "input")
        wires = "\n".join(f"  wire {width} {name};" for direction, width, name in found if direction == "output")
        wired = ", ".join(f".{name}({name})" for _, _, name in found)
        return f"""\
// Made from the ports of {entity}.
module formal_top (
{inputs}
);
{wires}
  {entity} dut ({wired});

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

{body}endmodule
"""

    return harness


PROOFS = (
    Proof(
        name="motor_sum_fits",
        says="the voltage of a leg, summed over the clocks of a step, is exact: no sum wraps",
        entity="motor_inverter",
        harness=around("motor_inverter", SUM),
        faults=(
            Fault("a sum that goes on", INVERTER, "          base   := (others => '0');\n", "          null;\n"),
            Fault("voltages that change within a step", INVERTER, "      if tick = '1' then\n        high <=",
                  "      if true then\n        high <="),
        ),
        depth=2,
        spies=("tick_1", "gate_high_1", "gate_low_1", "sum", "high", "low", "off"),
        assumed="steps of up to 31 clocks, any voltages and gates",
        search_depth=12,
        covers=False,  # the search reaches sums of both signs
    ),
    Proof(
        name="motor_friction",
        says="Coulomb friction never turns the shaft back: a speed that changes its sign is zero for a step",
        entity="motor_shaft",
        harness=around("motor_shaft", BRAKES),
        faults=(
            Fault("friction that turns back", SHAFT, "stops_9 <= (or coulomb) and", "stops_9 <= '0' and"),
            Fault("only one direction stops", SHAFT, "and (omega_10(omega_10'high) xor omega_9(omega_9'high));",
                  "and (omega_10(omega_10'high) and not omega_9(omega_9'high));"),
        ),
        depth=2,
        spies=("valid", "omega_10"),
        free=("sum_8",),
        assumed="samples at least 13 clocks apart, coulomb not 0, hold = 0; the products may have any value",
        search_depth=44,
    ),
    Proof(
        name="motor_filter_between",
        says="a filtered current lies between what it was and the current: it never swings over, nothing wraps",
        entity="motor_filter",
        harness=around("motor_filter", BETWEEN),
        faults=(
            Fault("another phase's current", FILTER, "i_b when valid(1) = '1'", "i_c when valid(1) = '1'"),
            Fault("added a turn early", FILTER, "if (or valid(2 to 4)) = '1' then", "if (or valid(1 to 3)) = '1' then"),
            Fault("the difference of another phase", FILTER, "MOTOR_FILTER_LIFT) - y_3(", "MOTOR_FILTER_LIFT) - y_2("),
        ),
        depth=4,
        spies=("valid", "y_1"),
        seen=("prod_2", "d_1", "y_2", "y_3"),
        free=("prod_2",),
        assumed="samples at least 7 clocks apart; any product between 0 and that of the largest k",
        search_depth=24,
    ),
)  # fmt: skip
