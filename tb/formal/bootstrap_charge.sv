// SPDX-License-Identifier: BSD-3-Clause
// What the charging of the bootstrap capacitors promises, around the converted entity bootstrap_charge and through its
// ports alone.  One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input       clk,
    input       rst,
    input       gates_on,
    input       period,
    input [9:0] any_samples
);
`ifdef EXACT
  (* anyconst *) wire [9:0] charge_samples;
  always @* assume (charge_samples < 12);
`else
  wire [9:0] charge_samples = any_samples;
`endif
  wire charging, charged;

  bootstrap_charge dut (
      .clk(clk),
      .rst(rst),
      .gates_on(gates_on),
      .period(period),
      .charge_samples(charge_samples),
      .charging(charging),
      .charged(charged)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  reg rest, was_on;
  reg [9:0] samples;
  always @(posedge clk) {rest, was_on, samples} <= {rst, gates_on, charge_samples};

`ifdef EXACT
  // Sample times since the gates went on, up to one more than are asked for.
  reg [3:0] seen;
  always @(posedge clk)
    if (rst || !gates_on) seen <= 0;
    else if (period && seen <= charge_samples) seen <= seen + 1;
  always @(posedge clk) if (begun && !rest) begin
    assert (charging == (seen < samples));
    assert (charged == (seen > samples || samples == 0));
    cover (charged && samples > 3);
  end
`endif

`ifdef STAYS
  // Not both; no charge from one sample to the next while the drive runs, whatever is written.
  reg was_charged, was_set;
  always @(posedge clk) {was_charged, was_set} <= {charged, |samples};
  always @(posedge clk) if (begun && !rest) begin
    assert (!(charging && charged));
    if (was_charged && was_set && was_on) assert (charged);
    if (!was_on && |samples) assert (!charged);
    cover (was_charged && was_set && was_on && samples > 20);
  end
`endif
endmodule
