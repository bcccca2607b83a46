// SPDX-License-Identifier: BSD-3-Clause
// What the limit of the current promises, around the converted entity current_limit and through its ports alone.
// A sample may come at any time that is at least INTERVAL clocks after the last one; its inputs stay until then.

module formal_top (
    input                     clk,
    input                     rst,
    input                     in_valid,
    input signed [`WIDTH-1:0] i_d_ref,
    input signed [`WIDTH-1:0] i_max
);
  wire out_valid;
  wire signed [`WIDTH-1:0] i_d_limited, i_q_max;

  current_limit dut (
      .clk(clk),
      .rst(rst),
      .in_valid(in_valid),
      .i_d_ref(i_d_ref),
      .i_max(i_max),
      .out_valid(out_valid),
      .i_d_limited(i_d_limited),
      .i_q_max(i_q_max)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);
  always @* if (begun) assume (!rst);

  reg [7:0] since;  // clocks since a sample entered
  reg seen, twice;  // samples since the reset: one, two
  reg signed [`WIDTH-1:0] d, m, was_d, was_m;  // inputs of the last sample and of the one before
  initial {seen, twice} = 0;
  always @(posedge clk) begin
    since <= in_valid ? 1 : &since ? since : since + 1;
    if (rst) {seen, twice} <= 0;
    else if (in_valid) begin
      {twice, seen} <= {seen, 1'b1};
      {was_d, was_m} <= {d, m};
      {d, m} <= {i_d_ref, i_max};
    end
  end
  always @* begin
    assume (!i_max[`WIDTH-1]);
    if (rst) assume (!in_valid);
    if (seen && since < 2 * `WIDTH) assume (!in_valid && i_d_ref == d && i_max == m);
  end

  // The pair that the next sample gets: i_d as near as it may be, on the circle or inside, i_q_max the largest that fits.
  wire signed [2*`WIDTH+1:0] most = was_m * was_m;
  wire signed [2*`WIDTH+1:0] used = i_d_limited * i_d_limited + i_q_max * i_q_max;
  wire signed [2*`WIDTH+1:0] more = i_d_limited * i_d_limited + (i_q_max + 1) * (i_q_max + 1);
  always @(posedge clk) if (begun && out_valid) begin
    if (!seen || !twice) assert (i_d_limited == 0 && i_q_max == 0);
    else begin
      assert (i_q_max >= 0);
      assert (used <= most);
      assert (more > most);
      assert (i_d_limited == (was_d > was_m ? was_m : was_d < -was_m ? -was_m : was_d));
    end
    cover (twice && i_d_limited < 0 && i_q_max > 1);
    cover (twice && was_d > was_m);
  end
endmodule
