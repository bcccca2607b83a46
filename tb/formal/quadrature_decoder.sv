// SPDX-License-Identifier: BSD-3-Clause
// What the decoder of A, B and Z promises, around the converted entity quadrature_decoder and through its ports alone.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input       clk,
    input       rst,
    input       a,
    input       b,
    input       z,
    input       settled,
    input       clear_faults,
    input [1:0] index_phase
);
  wire step_up, step_down, forward, index, illegal;
  wire [11:0] illegal_count;

  quadrature_decoder dut (
      .clk(clk),
      .rst(rst),
      .a(a),
      .b(b),
      .z(z),
      .settled(settled),
      .clear_faults(clear_faults),
      .index_phase(index_phase),
      .step_up(step_up),
      .step_down(step_down),
      .forward(forward),
      .index(index),
      .illegal(illegal),
      .illegal_count(illegal_count)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // The levels of the last clocks; `known`: they are settled and without a reset.
  reg a_1, b_1, a_2, b_2, known_1, known_2, rest;
  always @(posedge clk) begin
    {a_2, b_2, a_1, b_1} <= {a_1, b_1, a, b};
    {known_2, known_1, rest} <= {known_1, settled && !rst, rst};
  end
  wire known = known_1 && known_2;

`ifdef LEGAL
  // If A and B never change together, no transition is illegal, and each change is one step.
  always @* if (begun && settled && known_1) assume (!(a != a_1 && b != b_1));
  always @(posedge clk) if (begun && !rest) begin
    assert (!illegal && illegal_count == 0);
    assert ((step_up || step_down) == (known && (a_1 != a_2 || b_1 != b_2)));
    cover (step_up);
    cover (step_down && index);
  end
`endif

`ifdef STEPS
  // A leads B forward; both together are illegal and no step; a step has one direction, which forward then shows.
  wire up = (a_1 != a_2) ? (a_1 != b_1) : (a_1 == b_1);
  always @(posedge clk) if (begun && !rest) begin
    assert (!(step_up && step_down));
    assert (illegal == (known && a_1 != a_2 && b_1 != b_2));
    if (step_up) assert (forward && up && (a_1 != a_2) != (b_1 != b_2));
    if (step_down) assert (!forward && !up && (a_1 != a_2) != (b_1 != b_2));
    cover (illegal && illegal_count == 3);
  end
`endif
endmodule
