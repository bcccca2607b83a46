// SPDX-License-Identifier: BSD-3-Clause
// What the counter within a turn promises, around the converted entity turn_counter and through its ports alone.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input        clk,
    input        rst,
    input        step_up,
    input        step_down,
    input        sample,
    input        correct,
    input [19:0] correction,
    input        fast
);
  (* anyconst *) wire [18:0] counts;
  (* anyconst *) wire [16:0] code_step;
  (* anyconst *) wire [17:0] code_rest;
  always @* assume (counts >= 4 && counts <= 1 << 18 && {1'b0, code_rest} < counts);
  wire [15:0] code_theta;
  wire [17:0] count;
  wire [19:0] pending;
  wire moving, restarted, setting_refused;

  turn_counter dut (
      .clk(clk),
      .rst(rst),
      .step_up(step_up),
      .step_down(step_down),
      .sample(sample),
      .correct(correct),
      .correction(correction),
      .fast(fast),
      .counts(counts),
      .code_step(code_step),
      .code_rest(code_rest),
      .code_theta(code_theta),
      .count(count),
      .pending(pending),
      .moving(moving),
      .restarted(restarted),
      .setting_refused(setting_refused)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  reg rest, was_up, was_down, was_sample, was_moving, was_correct;
  reg [17:0] was_count;
  reg [19:0] was_pending;
  always @(posedge clk) begin
    {rest, was_up, was_down, was_sample} <= {rst, step_up, step_down, sample};
    {was_moving, was_correct, was_count, was_pending} <= {moving, correct, count, pending};
  end
  wire [18:0] above = was_count == counts - 1 ? 0 : was_count + 1;
  wire [18:0] below = was_count == 0 ? counts - 1 : was_count - 1;

`ifdef RANGE
  // The count is one of the turn's, and a setting that is possible is not refused.
  always @(posedge clk) if (begun && !rest) begin
    assert ({1'b0, count} < counts);
    assert (!setting_refused);
    cover ({1'b0, count} == counts - 1 && counts > 4);
  end
`endif

`ifdef NO_JUMP
  // The count moves by one at most, by a step or by a correction at a sample or on the way; a step is never lost.
  always @(posedge clk) if (begun && !rest && !restarted) begin
    if (was_up) assert (count == above[17:0]);
    else if (was_down) assert (count == below[17:0]);
    else if (!was_sample && !was_moving) assert (count == was_count);
    else assert (count == was_count || count == above[17:0] || count == below[17:0]);
    if (!was_correct && !was_up && !was_down && count == was_count) assert (pending == was_pending);
    if (!was_up && !was_down && count != was_count) assert (was_pending != 0);
    cover (!was_up && !was_down && count == below[17:0]);
    cover (was_moving && !moving);
  end
`endif
endmodule
