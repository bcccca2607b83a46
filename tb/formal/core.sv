// SPDX-License-Identifier: BSD-3-Clause
// What the whole core promises of its gates; the ports and the instance are made from the converted entity.
// What no gate depends on in these properties is cut off: any value may come from there at any clock.

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  reg was_trip, was_enable, was_on;
  reg locked;  // by a trip, until it is cleared
  wire on = gate_high != 0 || gate_low != 0;
  always @(posedge clk) begin
    was_trip   <= trip;
    was_enable <= enable;
    was_on     <= on;
    locked     <= !rst && (trip || (locked && !clear_trip));
  end

  always @(posedge clk) if (begun) begin
`ifdef NEVER_BOTH
    assert ((gate_high & gate_low) == 0);
    cover (gate_high == 5 && gate_low == 2);
`endif
`ifdef TRIP
    if (was_trip || locked) assert (!on);
    if (locked) assert (tripped);
    cover (was_trip && was_on);
    cover (locked && !trip && enable && was_enable);
`endif
`ifdef ENABLE
    if (!was_enable) assert (!on);
    cover (!was_enable && was_on);
`endif
  end
