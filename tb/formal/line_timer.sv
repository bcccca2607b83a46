// SPDX-License-Identifier: BSD-3-Clause
// What the time over whole lines promises, around the converted entity line_timer and through its ports alone.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input clk,
    input rst,
    input step_up,
    input step_down,
    input take,
    input still
);
  localparam W = `TIME_W + 2;
  wire [W-1:0] line_span, next_span;
  wire line_known, next_known;

  line_timer dut (
      .clk(clk),
      .rst(rst),
      .step_up(step_up),
      .step_down(step_down),
      .take(take),
      .still(still),
      .line_span(line_span),
      .line_known(line_known),
      .next_span(next_span),
      .next_known(next_known)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);
  always @* assume (!(step_up && step_down));

  wire edge_0 = step_up || step_down;
  reg seen, forward;
  always @(posedge clk)
    if (rst) {seen, forward} <= 0;
    else if (edge_0) {seen, forward} <= {1'b1, step_up};
  wire begins = still || (edge_0 && seen && step_up != forward);  // nothing before it belongs to this run

`ifdef KNOWN
  // A span is known only where the run in one direction is long enough to hold a whole line.
  reg [2:0] run;
  reg edge_1, rest;
  wire [2:0] before = begins ? 0 : run;
  always @(posedge clk) begin
    {edge_1, rest} <= {edge_0, rst};
    run <= rst ? 0 : edge_0 ? (before == 5 ? 5 : before + 1) : before;
  end
  always @(posedge clk) if (begun && !rest && edge_1) begin
    if (line_known) assert (run == 5);
    assert (next_known == (run >= 4));
    cover (line_known);
  end
`endif

`ifdef SPANS
  // The last twelve edges of the run: clocks since each, and whether it was before the window.
  reg [W-1:0] age[0:11];
  reg [11:0] valid, older;
  reg [W-1:0] span, following;
  reg known, next, edge_1, rest;
  wire [11:0] held = begins ? 0 : valid;
  wire [11:0] out = take ? 12'hfff : older;
  integer k;
  always @(posedge clk) begin
    {edge_1, rest} <= {edge_0, rst};
    valid <= rst ? 0 : edge_0 ? {held[10:0], 1'b1} : held;
    older <= rst ? 0 : edge_0 ? {out[10:0], 1'b0} : out;
    for (k = 0; k < 12; k = k + 1) age[k] <= (edge_0 ? (k == 0 ? 0 : age[k-1]) : age[k]) + 1;
    following <= following + 1;
    if (edge_0) begin
      known <= 0;
      for (k = 11; k > 0; k = k - 4)
        if (held[k] && out[k]) begin
          known <= 1;
          span <= age[k];
        end
      next <= held[2];
      following <= age[2] + 1;
    end
  end
  always @(posedge clk) if (begun && !rest && edge_1) begin
    assert (line_known == known && next_known == next);
    if (known) assert (line_span == span);
    if (next) assert (next_span == following);
    cover (known && next && !valid[11] && span > 6);
  end
`endif
endmodule
