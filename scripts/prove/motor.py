# SPDX-License-Identifier: BSD-3-Clause
"""Properties of the motor of the FPGA: sums that fit, legs within their rails, friction that only brakes."""

from __future__ import annotations

from collections.abc import Callable

from scripts.prove.pipeline import ports
from scripts.prove.proof import Fault, Proof

INVERTER, LEGS, SHAFT = (f"motor/motor_{name}.vhd" for name in ("inverter", "legs", "shaft"))

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

RAILS = """\
  // flight[k]: a sample went in k + 1 clocks ago; loaded: its voltages of leg a are there
  reg [8:0] flight;
  reg loaded = 0;
  always @(posedge clk) flight <= rst ? 0 : {flight, in_valid};
  always @(posedge clk) loaded <= !rst && (loaded || flight[5]);
  wire signed [25:0] bus = $signed(u_dc), switch = $signed({1'b0, v_switch}), diode = $signed({1'b0, v_diode});
  wire signed [25:0] top = $signed(high_a), bottom = $signed(low_a), free = $signed(off_a);
  always @* assume (bus >= 0 && bus + diode < 8388608);
  always @(posedge clk) if (begun) assume ($stable({u_dc, v_switch, v_diode}));

  always @(posedge clk) if (begun && loaded) begin
    // What a device loses is between nothing and its drop, whichever way the current flows.
    assert (bus - switch <= top && top <= bus + diode);
    assert (-diode <= bottom && bottom <= switch);
    assert (-diode <= free && free <= bus + diode);
    // Both devices see the same direction of the current.
    assert (!(bottom > 0 && top < bus) && !(bottom < 0 && top > bus));
    cover (top > bus && bottom > 0);
    cover (free == -diode && diode != 0 && bottom < 0);
  end
`ifdef LEMMAS
  reg [1:0] age = 0;  // clocks that the pipeline has had, up to 3
  always @(posedge clk) age <= !begun ? 0 : &age ? age : age + 1;
  wire signed [25:0] top_6 = $signed(spy_high_6), bottom_6 = $signed(spy_low_6), free_6 = $signed(spy_off_6);
  always @(posedge clk) if (begun) begin
    assert (spy_valid[8:0] == {flight[0], flight[1], flight[2], flight[3], flight[4], flight[5], flight[6], flight[7],
                               flight[8]});
    assert (age >= (flight[8:2] != 0 ? 3 : flight[1] ? 2 : flight[0]) && (age == 3 || !loaded));
    if (age >= 2) begin
      assert (spy_with_high_5 <= (spy_minus_5 ? v_diode : v_switch));
      assert (spy_with_low_5 <= (spy_minus_5 ? v_switch : v_diode));
      assert (-diode <= $signed(spy_off_5) && $signed(spy_off_5) <= bus + diode);
    end
    if (age == 3) begin
      assert (bus - switch <= top_6 && top_6 <= bus + diode && -diode <= bottom_6 && bottom_6 <= switch);
      assert (-diode <= free_6 && free_6 <= bus + diode);
      assert (!(bottom_6 > 0 && top_6 < bus) && !(bottom_6 < 0 && top_6 > bus));
    end
  end
`endif
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
        name="motor_rails",
        says="each voltage of a leg is that of its rail up to the drop of the device that conducts",
        entity="motor_legs",
        harness=around("motor_legs", RAILS),
        faults=(
            Fault("the diode's drop at a transistor", LEGS, "with_high_5 <= least(magnitude(x_4), v_switch);",
                  "with_high_5 <= least(magnitude(x_4), v_diode);"),
            Fault("a free leg below its rail", LEGS, "clamp(free_4, -diode_v,", "clamp(free_4, shift_left(-diode_v, 1),"),
            Fault("a lower device that drives", LEGS, "V_W), not minus_5);", "V_W), minus_5);"),
        ),
        method="pdr",
        depth=12,
        spies=("valid", "minus_5", "with_high_5", "with_low_5", "off_5", "high_6", "low_6", "off_6"),
        free=("x_3",),
        assumed="bus and drops constant, their sum below the format's end; stiffness times current may be anything",
        search_depth=24,
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
)  # fmt: skip
