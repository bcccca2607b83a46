// SPDX-License-Identifier: BSD-3-Clause
// What the filter of a pin promises, around the converted entity input_filter and through its ports alone.

module formal_top (
    input clk,
    input rst,
    input pin
);
  (* anyconst *) wire [9:0] held;
  always @* assume (held < 12);
  wire level, settled;

  input_filter dut (
      .clk(clk),
      .rst(rst),
      .pin(pin),
      .filter_clocks(held),
      .level(level),
      .settled(settled)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // Clocks that the pin has had its level, as it was two clocks ago when the filter sees it.
  reg [3:0] same_0, same_1, same_2;
  reg pin_1, pin_2, pin_3, rest, was_level, was_settled;
  always @(posedge clk) begin
    same_0 <= rst ? 0 : pin != pin_1 ? 1 : &same_0 ? same_0 : same_0 + 1;
    {same_2, same_1} <= {same_1, same_0};
    {pin_3, pin_2, pin_1} <= {pin_2, pin_1, pin};
    {rest, was_level, was_settled} <= {rst, level, settled};
  end

  // A level is accepted only after the pin has had it for filter_clocks + 1 clocks; settled stays.
  always @(posedge clk) if (begun && !rest) begin
    if (was_settled && level != was_level) assert (same_2 > held && level == pin_3);
    if (was_settled) assert (settled);
    cover (was_settled && level != was_level && held > 3);
  end
endmodule
