// SPDX-License-Identifier: BSD-3-Clause
// multiply_add against its equation: the operands of three clocks ago, in numbers wide enough for every sum.

module formal_top (
    input clk,
    input signed [`A_W-1:0] a,
    input signed [`B_W-1:0] b,
    input signed [`C_W-1:0] c
);
  wire signed [`Y_W-1:0] y;
  wire limited;
  multiply_add_tb dut (.clk(clk), .a(a), .b(b), .c(c), .y(y), .limited(limited));

  reg signed [`A_W-1:0] a_1, a_2, a_3;
  reg signed [`B_W-1:0] b_1, b_2, b_3;
  reg signed [`C_W-1:0] c_1, c_2, c_3;
  reg [1:0] age = 0;
  always @(posedge clk) begin
    {a_3, a_2, a_1} <= {a_2, a_1, a};
    {b_3, b_2, b_1} <= {b_2, b_1, b};
    {c_3, c_2, c_1} <= {c_2, c_1, c};
    age <= age == 3 ? 3 : age + 1;
  end

  localparam signed [19:0] HALF = `DROP == 0 ? 0 : 1 << (`DROP - 1);
  localparam signed [19:0] TOP = (1 << (`Y_W - 1)) - 1;
  wire signed [19:0] product = a_3 * b_3;
  wire signed [19:0] rounded = (product + HALF) >>> `DROP;
  wire signed [19:0] exact = `MINUS ? c_3 - rounded : c_3 + rounded;
  wire signed [19:0] wanted = exact > TOP ? TOP : exact < -TOP - 1 ? -TOP - 1 : exact;

  always @(posedge clk) if (age == 3) begin
    assert (y == wanted);
    assert (limited == (wanted != exact));
    cover (limited && y > 0);
    cover (limited && y < 0);
    cover (!limited && product[`DROP-1:0] == HALF);
  end
endmodule
