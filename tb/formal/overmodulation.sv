// SPDX-License-Identifier: BSD-3-Clause
// What over-modulation promises of its gain, around the converted entity overmodulation.  The square over 1/3 of that of
// the bus may have any value at any clock; the harness sees it, beyond_8, and the word of the table that is read for it.

module formal_top (
    input               clk,
    input               rst,
    input               in_valid,
    input signed [17:0] u_d,
    input signed [17:0] u_pi_q,
    input signed [17:0] u_dec_q,
    input signed [17:0] u_comp_q,
    input        [15:0] u_max,
    input        [21:0] inverse,
    input        [21:0] inverse_beta
);
  wire out_valid;
  wire [21:0] inverse_used, inverse_beta_used;
  wire signed [35:0] seen_beyond_8;
  wire [7:0] seen_index_9;
  overmodulation dut (
      .clk(clk),
      .rst(rst),
      .in_valid(in_valid),
      .u_d(u_d),
      .u_pi_q(u_pi_q),
      .u_dec_q(u_dec_q),
      .u_comp_q(u_comp_q),
      .u_max(u_max),
      .inverse(inverse),
      .inverse_beta(inverse_beta),
      .out_valid(out_valid),
      .inverse_used(inverse_used),
      .inverse_beta_used(inverse_beta_used),
      .seen_beyond_8(seen_beyond_8),
      .seen_index_9(seen_index_9)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // n: clocks since a sample went in, 0 without one
  reg [3:0] n = 0;
  always @(posedge clk) n <= rst ? 0 : in_valid ? 1 : n == 14 || n == 0 ? 0 : n + 1;
  always @* if (in_valid) assume (n == 0 || n == 14);

  reg signed [35:0] beyond;
  always @(posedge clk) if (n == 8) beyond <= seen_beyond_8;

  always @(posedge clk) if (begun && !rst && n == 9) begin
    // Word 0, a gain of one, within the circle and nowhere else; the last beyond the table, else that of the step.
    assert ((beyond < 0) == (seen_index_9 == 0));
    if (beyond >= 36'sd145 <<< 20) assert (seen_index_9 == 8'd146);
    else if (beyond >= 0) assert (seen_index_9 == beyond[27:20] + 1);
    cover (beyond < 0);
    cover (beyond >= 0 && seen_index_9 == 8'd100);
    cover (beyond >= 36'sd1000 <<< 20);
  end
endmodule
