// SPDX-License-Identifier: BSD-3-Clause
// sum_of_products against its equation: the operands of three clocks ago, in numbers wide enough for every sum.

module formal_top (
    input clk,
    input signed [`A_W-1:0] a,
    input signed [`B_W-1:0] b,
    input minus,
    input signed [`C_W-1:0] c,
    input signed [`D_W-1:0] d
);
  wire signed [`Y_W-1:0] y;
  sum_of_products_tb dut (.clk(clk), .a(a), .b(b), .minus(minus), .c(c), .d(d), .y(y));

  reg signed [`A_W-1:0] a_1, a_2, a_3;
  reg signed [`B_W-1:0] b_1, b_2, b_3;
  reg signed [`C_W-1:0] c_1, c_2, c_3;
  reg signed [`D_W-1:0] d_1, d_2, d_3;
  reg minus_1, minus_2, minus_3;
  reg [1:0] age = 0;
  always @(posedge clk) begin
    {a_3, a_2, a_1} <= {a_2, a_1, a};
    {b_3, b_2, b_1} <= {b_2, b_1, b};
    {c_3, c_2, c_1} <= {c_2, c_1, c};
    {d_3, d_2, d_1} <= {d_2, d_1, d};
    {minus_3, minus_2, minus_1} <= {minus_2, minus_1, minus};
    age <= age == 3 ? 3 : age + 1;
  end

  localparam signed [19:0] HALF = 1 << (`DROP - 1);
  localparam signed [19:0] TOP = (1 << (`Y_W - 1)) - 1;
  wire signed [19:0] ab = a_3 * b_3;
  wire signed [19:0] cd = c_3 * d_3;
  wire signed [19:0] exact = ((minus_3 ? cd - ab : cd + ab) + HALF) >>> `DROP;
  wire signed [19:0] wanted = exact > TOP ? TOP : exact < -TOP - 1 ? -TOP - 1 : exact;

  always @(posedge clk) if (age == 3) begin
    assert (y == wanted);
    cover (minus_3 && wanted != exact);
    cover (!minus_3 && wanted != exact);
  end
endmodule
