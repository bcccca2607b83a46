// SPDX-License-Identifier: BSD-3-Clause
// interpolation against its equation: the words of three clocks ago, and the point never beyond either of them.

module formal_top (
    input clk,
    input signed [`WIDTH-1:0] a,
    input signed [`WIDTH-1:0] b,
    input [`BITS-1:0] fraction
);
  wire signed [`WIDTH-1:0] y;
  interpolation_tb dut (.clk(clk), .a(a), .b(b), .fraction(fraction), .y(y));

  reg signed [`WIDTH-1:0] a_1, a_2, a_3;
  reg signed [`WIDTH-1:0] b_1, b_2, b_3;
  reg [`BITS-1:0] f_1, f_2, f_3;
  reg [1:0] age = 0;
  always @(posedge clk) begin
    {a_3, a_2, a_1} <= {a_2, a_1, a};
    {b_3, b_2, b_1} <= {b_2, b_1, b};
    {f_3, f_2, f_1} <= {f_2, f_1, fraction};
    age <= age == 3 ? 3 : age + 1;
  end

  wire signed [19:0] part = $signed({1'b0, f_3});
  wire signed [19:0] exact = a_3 + ((part * (b_3 - a_3)) >>> `BITS);

  always @(posedge clk) if (age == 3) begin
    assert (y == exact);
    assert (a_3 <= b_3 ? a_3 <= y && y <= b_3 : b_3 <= y && y <= a_3);
    cover (a_3 == -(1 << (`WIDTH - 1)) && b_3 == (1 << (`WIDTH - 1)) - 1 && f_3 == (1 << `BITS) - 1);
    cover (b_3 < a_3 && y < a_3 && y > b_3);
  end
endmodule
