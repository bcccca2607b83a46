// SPDX-License-Identifier: BSD-3-Clause
// What the table's i_q promises, around the converted entity current_reference and through its ports alone.

module formal_top (
    input               clk,
    input               rst,
    input               in_valid,
    input signed [17:0] i_q_table,
    input signed [17:0] i_q_max,
    input               use_table
);
  wire out_valid;
  wire signed [17:0] i_q_circle;
  current_reference dut (
      .clk(clk),
      .rst(rst),
      .in_valid(in_valid),
      .i_q_table(i_q_table),
      .i_q_max(i_q_max),
      .use_table(use_table),
      .out_valid(out_valid),
      .i_q_circle(i_q_circle)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);
  always @* assume (!i_q_max[17]);

  reg signed [17:0] most;
  always @(posedge clk) if (in_valid) most <= i_q_max;

  // Whatever words the table holds: i_q is within the limit that current_limit gave beside i_d.
  always @(posedge clk) if (begun && out_valid) begin
    assert (i_q_circle <= most && i_q_circle >= -most);
    cover (i_q_circle == most && most > 5);
    cover (i_q_circle == -most && most > 5);
  end
endmodule
