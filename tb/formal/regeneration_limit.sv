// SPDX-License-Identifier: BSD-3-Clause
// What the limit of the braking current promises, around the converted entity regeneration_limit and through its ports
// alone, for samples at any distance.

module formal_top (
    input               clk,
    input               rst,
    input               in_valid,
    input signed [17:0] i_q_asked,
    input signed [17:0] omega_me,
    input        [16:0] u_dc,
    input signed [17:0] i_max,
    input        [16:0] regen_start,
    input        [15:0] regen_slope
);
  wire out_valid, regen_limited;
  wire signed [17:0] i_q_ref;

  regeneration_limit dut (
      .clk(clk),
      .rst(rst),
      .in_valid(in_valid),
      .i_q_asked(i_q_asked),
      .omega_me(omega_me),
      .u_dc(u_dc),
      .i_max(i_max),
      .regen_start(regen_start),
      .regen_slope(regen_slope),
      .out_valid(out_valid),
      .i_q_ref(i_q_ref),
      .regen_limited(regen_limited)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);
  always @* assume (!i_max[17]);

  reg signed [17:0] asked, omega;
  always @(posedge clk) if (in_valid) {asked, omega} <= {i_q_asked, omega_me};
  wire brakes = (asked < 0 && omega > 0) || (asked > 0 && omega < 0);

  // Whatever line and bus: a current that drives is not changed, one that brakes keeps its direction and does not grow.
  always @(posedge clk) if (begun && out_valid) begin
    if (!brakes) assert (i_q_ref == asked && !regen_limited);
    assert (asked < 0 ? i_q_ref <= 0 && i_q_ref >= asked : i_q_ref >= 0 && i_q_ref <= asked);
    assert (regen_limited == (i_q_ref != asked));
    cover (regen_limited && i_q_ref < 0);
    cover (regen_limited && i_q_ref > 0);
  end
endmodule
