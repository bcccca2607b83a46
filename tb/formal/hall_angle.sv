// SPDX-License-Identifier: BSD-3-Clause
// What the angle between Hall edges promises, around the converted entity hall_angle.

module formal_top (
    input        clk,
    input        rst,
    input        step_up,
    input        step_down,
    input        skipped,
    input [17:0] theta_hall,
    input        sample
);
  localparam signed [25:0] HALF = 26'sd1398101;  // a twelfth of a turn with six bits more
  wire [17:0] theta;
`ifdef LEMMAS
  wire [4:0] spy_clock;
  wire signed [23:0] spy_part, spy_place;
  wire [17:0] spy_begin_at, spy_middle;
  wire spy_seen;
`endif

  hall_angle dut (
`ifdef LEMMAS
      .spy_clock(spy_clock),
      .spy_part(spy_part),
      .spy_place(spy_place),
      .spy_begin_at(spy_begin_at),
      .spy_middle(spy_middle),
      .spy_seen(spy_seen),
`endif
      .clk(clk),
      .rst(rst),
      .step_up(step_up),
      .step_down(step_down),
      .skipped(skipped),
      .theta_hall(theta_hall),
      .sample(sample),
      .theta(theta)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // The sample that is worked on, the middle of its sector, and whether an edge came since a skipped sector.
  reg [4:0] busy;
  reg [17:0] hall_1, middle;
  reg seen, seen_then, done;
  always @(posedge clk) begin
    hall_1 <= rst ? 0 : theta_hall;
    seen <= !rst && !skipped && (seen || step_up || step_down);
    done <= !rst && busy == 17;
    if (rst) busy <= 0;
    else if (busy == 0 && sample) begin
      busy <= 1;
      middle <= hall_1;
      seen_then <= seen;
    end else if (busy != 0) busy <= busy == 17 ? 0 : busy + 1;
  end

  // Never outside the sector, a twelfth of a turn on either side of its middle; the middle where no edge is known.
  wire signed [17:0] away = theta - middle;
  always @(posedge clk) if (begun && done && busy == 0) begin
    assert (away <= 18'sd21845 && away >= -18'sd21845);
    if (!seen_then) assert (away == 0);
    cover (away > 18'sd5000);
    cover (away < -18'sd5000);
  end

`ifdef LEMMAS
  wire signed [25:0] part = spy_part, place = spy_place;
  always @(posedge clk) if (begun) begin
    assert (spy_clock == busy && spy_middle == hall_1 && spy_seen == seen);
    if (busy != 0) begin
      assert (spy_begin_at == middle);
      assert (part >= 0 && place >= -HALF && place + 2 * part <= HALF);
      if (!seen_then) assert (part == 0 && place == 0);
    end
  end
`endif
endmodule
