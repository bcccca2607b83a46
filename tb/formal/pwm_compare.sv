// SPDX-License-Identifier: BSD-3-Clause
// What pwm_compare promises to the gates, around the converted entity and through its ports alone.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input        clk,
    input        rst,
    input        in_valid,
    input [16:0] duty_a,
    input [16:0] duty_b,
    input [16:0] duty_c,
    input [11:0] min_pulse,
    input        double_update
);
  localparam HALF = `CARRIER_HALF;

  wire        out_valid;
  wire [15:0] compare_a;
  wire [15:0] compare_b;
  wire [15:0] compare_c;

  pwm_compare dut (
      .clk(clk),
      .rst(rst),
      .in_valid(in_valid),
      .duty_a(duty_a),
      .duty_b(duty_b),
      .duty_c(duty_c),
      .min_pulse(min_pulse),
      .double_update(double_update),
      .out_valid(out_valid),
      .compare_a(compare_a),
      .compare_b(compare_b),
      .compare_c(compare_c)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // Duties from 0 to 1; samples keep their distance; the minimum pulse is valid for gate_generation and constant
  // while a sample is on its way.
  reg [3:0] age;
  always @(posedge clk) age <= rst ? `LATENCY : in_valid ? 1 : age < `LATENCY ? age + 1 : age;
  always @* if (begun && in_valid) assume (age >= `INTERVAL);
  always @* assume (duty_a <= 65536 && duty_b <= 65536 && duty_c <= 65536);
  always @* assume (min_pulse <= HALF);

  reg [11:0] was_min_pulse;
  reg was_double;
  reg [15:0] was_a, was_b, was_c;
  reg rest;
  always @(posedge clk) begin
    rest          <= rst;
    was_min_pulse <= min_pulse;
    was_double    <= double_update;
    was_a         <= compare_a;
    was_b         <= compare_b;
    was_c         <= compare_c;
  end
  always @* if (begun && age < `LATENCY) assume (min_pulse == was_min_pulse && double_update == was_double);

  (* anyconst *) wire [1:0] leg;
  always @* assume (leg < 3);
  wire [15:0] compare = leg == 0 ? compare_a : leg == 1 ? compare_b : compare_c;

`ifdef MINIMUM
  // No pulse and no low end of a period is shorter than the minimum pulse, but for those that are not there at all; with
  // double_update no half of a pulse either.
  always @(posedge clk) if (begun && out_valid) begin
    assert (compare <= HALF);
    if (compare != 0 && compare != HALF) begin
      assert ((was_double ? compare : 2 * compare) >= was_min_pulse);
      assert (HALF - compare >= was_min_pulse);
    end
    cover (compare == HALF);
    cover (was_min_pulse > 2 && HALF - compare == was_min_pulse);
    cover (was_min_pulse > 3 && was_min_pulse[0] == 0 && 2 * compare == was_min_pulse && !was_double);
    cover (was_min_pulse > 3 && compare == was_min_pulse && was_double);
  end
`endif

`ifdef TOGETHER
  // The three values change with out_valid, all of them, and at no other clock.
  always @(posedge clk) if (begun && !rest && !out_valid) begin
    assert (compare_a == was_a && compare_b == was_b && compare_c == was_c);
    cover (compare_a != compare_b && compare_b != compare_c);
  end
`endif
endmodule
