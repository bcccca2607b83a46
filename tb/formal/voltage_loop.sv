// SPDX-License-Identifier: BSD-3-Clause
// What the voltage loop promises of its share, around the converted entity voltage_loop.  The product k_voltage*left may
// have any value at any clock; the harness sees it and the whole share, and starts from any share.

module formal_top (
    input               clk,
    input               rst,
    input               in_valid,
    input        [15:0] u_max,
    input               run,
    input signed [17:0] u_d,
    input signed [17:0] u_q,
    input        [15:0] u_share,
    input        [23:0] k_voltage,
    input        [15:0] share_min
);
  wire out_valid, calm;
  wire [15:0] share;
  wire signed [42:0] seen_p;
  wire [27:0] seen_state;
  voltage_loop dut (
      .clk(clk),
      .rst(rst),
      .in_valid(in_valid),
      .u_max(u_max),
      .run(run),
      .u_d(u_d),
      .u_q(u_q),
      .u_share(u_share),
      .k_voltage(k_voltage),
      .share_min(share_min),
      .out_valid(out_valid),
      .share(share),
      .calm(calm),
      .seen_p(seen_p),
      .seen_state(seen_state)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // n: clocks since a sample went in, 0 without one
  reg [3:0] n = 0;
  always @(posedge clk) n <= rst ? 0 : in_valid ? 1 : n == 13 || n == 0 ? 0 : n + 1;
  always @* if (in_valid) assume (n == 0 || n == 13);
  always @(posedge clk) if (begun && n != 0) assume ($stable({run, share_min}));

  // The share before the sample, and the rounded step that its product asks for
  reg [27:0] before;
  reg signed [42:0] product;
  always @(posedge clk) if (n == 11) {before, product} <= {seen_state, seen_p};
  wire signed [43:0] moves = (product + 44'sd2048) >>> 12;
  wire [27:0] least = {share_min, 12'd0};
  wire valid_state = before >= least || !run;

  always @(posedge clk) if (begun && !rst && n == 13) begin
    assert (share == seen_state[27:12]);
    if (!run) assert (&seen_state);
    else begin
      assert (seen_state >= least);
      // It is released from every state: a positive step raises the share or finds it at 1, and none lowers it.
      if (moves > 0) assert (seen_state > before || &seen_state);
      if (moves >= 0 && before >= least) assert (seen_state >= before);
      // It weakens from every state: a negative step lowers the share or finds it at its least.
      if (moves < 0 && before >= least) assert (seen_state < before || seen_state == least);
    end
    cover (run && moves > 0 && !(&seen_state));
    cover (run && moves > 0 && (&seen_state) && before == least);
    cover (run && seen_state == least && before > least);
  end
endmodule
