// SPDX-License-Identifier: BSD-3-Clause
// What the speed regulator promises of its output, around the converted entity speed_pi and through its ports alone.
// The products are cut off: any value may come from there at any clock.

module formal_top (
    input               clk,
    input               rst,
    input               in_valid,
    input signed [17:0] omega_ref,
    input signed [17:0] omega_me,
    input signed [17:0] i_q_ext,
    input signed [17:0] i_q_max,
    input               regen_limited,
    input               speed_mode,
    input               take_over,
    input               run,
    input signed [17:0] torque_ff,
    input        [23:0] speed_kp,
    input        [23:0] speed_ki
);
  wire out_valid, speed_limited;
  wire signed [17:0] i_q_ref;

  speed_pi dut (
      .clk(clk),
      .rst(rst),
      .in_valid(in_valid),
      .omega_ref(omega_ref),
      .omega_me(omega_me),
      .i_q_ext(i_q_ext),
      .i_q_max(i_q_max),
      .regen_limited(regen_limited),
      .speed_mode(speed_mode),
      .take_over(take_over),
      .run(run),
      .torque_ff(torque_ff),
      .speed_kp(speed_kp),
      .speed_ki(speed_ki),
      .out_valid(out_valid),
      .i_q_ref(i_q_ref),
      .speed_limited(speed_limited)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);
  always @* assume (!i_q_max[17]);

  reg signed [17:0] was_max;
  always @(posedge clk) was_max <= i_q_max;

  // Whatever is asked for, in speed mode and in torque mode: the output is within the limit of its clock.
  always @(posedge clk) if (begun && out_valid) begin
    assert (i_q_ref <= was_max && i_q_ref >= -was_max);
    cover (speed_limited && i_q_ref < -5);
    cover (speed_limited && i_q_ref > 5);
  end
endmodule
