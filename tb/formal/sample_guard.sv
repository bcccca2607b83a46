// SPDX-License-Identifier: BSD-3-Clause
// What the guard of the samples promises, around the converted entity sample_guard and through its ports alone.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input        clk,
    input        rst,
    input        sample_valid,
    input        clear_trip,
    input [19:0] watchdog
);
  wire sample_busy, sample_early, sample_late;
  wire [7:0] early_samples;

  sample_guard dut (
      .clk(clk),
      .rst(rst),
      .sample_valid(sample_valid),
      .clear_trip(clear_trip),
      .watchdog(watchdog),
      .sample_busy(sample_busy),
      .sample_early(sample_early),
      .sample_late(sample_late),
      .early_samples(early_samples)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // Clocks since a sample was let in or a reset was, as far as the counter goes.
  wire entered = sample_valid && !sample_busy;
  reg [5:0] since;
  reg seen;  // a sample was let in since the reset
  reg rest, was_valid, was_busy;
  reg [7:0] was_early;
  always @(posedge clk) begin
    since <= entered || rst ? 1 : &since ? since : since + 1;
    seen  <= !rst && (seen || entered);
    {rest, was_valid, was_busy, was_early} <= {rst, sample_valid, sample_busy, early_samples};
  end

`ifdef DISTANCE
  // For any strobes, samples enter at least INTERVAL clocks apart; a rejected one is reported.
  always @(posedge clk) if (begun) begin
    if (entered && seen) assert (since >= `INTERVAL);
    if (!rest) assert (sample_early == (was_valid && was_busy));
    cover (entered && seen && since == `INTERVAL);
  end
`endif

`ifdef WATCHDOG
  // Without a sample for `watchdog` clocks, which is small here and stays, late is up two clocks after at the latest.
  always @* assume (watchdog == held && held < 40);
  (* anyconst *) wire [19:0] held;
  always @(posedge clk) if (begun && !rest) begin
    if (since > held + 2) assert (sample_late);
    if (since == 1) assert (!sample_late);
    cover (seen && sample_late && held > 8);
  end
`endif
endmodule
