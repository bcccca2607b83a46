// SPDX-License-Identifier: BSD-3-Clause
// still_check, a sample every nine clocks: what a code must not have done that is told to stand.
module formal_top (
    input clk,
    input rst,
    input in_valid,
    input [15:0] code_theta,
    input [17:0] omega_me,
    input run,
    input position_restart,
    input [16:0] still_turn,
    input [19:0] slow_turn
);
  wire out_valid, stands;
  wire [16:0] omega_was;

  still_check dut (.clk(clk), .rst(rst), .in_valid(in_valid), .code_theta(code_theta), .omega_me(omega_me), .run(run),
                   .position_restart(position_restart), .still_turn(still_turn), .slow_turn(slow_turn),
                   .out_valid(out_valid), .stands(stands), .omega_was(omega_was));

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // n: clocks since a sample went in
  reg [3:0] n = 0;
  always @(posedge clk) n <= rst || n == 8 ? 0 : n + 1;
  always @* assume (n <= 8);
  always @* assume (in_valid == (n == 0));
  always @(posedge clk) if (begun) begin
    assume (!rst);
    assume ($stable(still_turn) && $stable(slow_turn));
    if (n != 0) assume ($stable({code_theta, omega_me, run, position_restart}));
  end

  always @(posedge clk) if (begun && out_valid) begin
    // The gates switch, the check is on, and nothing began anew
    if (stands) assert (run && still_turn != 0 && !position_restart);
    cover (stands);
  end
endmodule
