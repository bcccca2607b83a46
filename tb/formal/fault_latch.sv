// SPDX-License-Identifier: BSD-3-Clause
// What the memory of faults promises, around the converted entity fault_latch and through its ports alone.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input       clk,
    input       rst,
    input       trip,
    input [5:0] sample_faults,
    input       sample_late,
    input       sample_early,
    input [2:0] motion_faults,
    input       open_load,
    input       current_offset,
    input       host_lost,
    input       encoder_lost,
    input       enable,
    input       clear_trip,
    input [15:0] fault_ignore
);
  wire [15:0] fault_flags, first_fault;
  wire fault_stop, gate_clear;

  fault_latch dut (
      .clk(clk),
      .rst(rst),
      .trip(trip),
      .sample_faults(sample_faults),
      .sample_late(sample_late),
      .sample_early(sample_early),
      .motion_faults(motion_faults),
      .open_load(open_load),
      .current_offset(current_offset),
      .host_lost(host_lost),
      .encoder_lost(encoder_lost),
      .enable(enable),
      .clear_trip(clear_trip),
      .fault_ignore(fault_ignore),
      .fault_flags(fault_flags),
      .first_fault(first_fault),
      .fault_stop(fault_stop),
      .gate_clear(gate_clear)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // Bit 7 is trip, which needs no enable and cannot be ignored; bit 8 is a rejected sample, which never trips.
  localparam [15:0] CAUSES = 16'hfe7f;
  wire [15:0] cause = {encoder_lost, host_lost, current_offset, open_load, motion_faults, 2'b00, sample_late, sample_faults};
  reg rest, was_trip, was_enable, was_clear, was_stop;
  reg [15:0] was_cause, was_ignore, was_flags, was_first;
  always @(posedge clk) begin
    {rest, was_trip, was_enable, was_clear, was_stop} <= {rst, trip, enable, clear_trip, fault_stop};
    {was_cause, was_ignore} <= {cause, fault_ignore};
    {was_flags, was_first} <= {fault_flags, first_fault};
  end

  // Clocks since trip has become 1: 0 in the clock after, 31 and more are the same
  reg [4:0] age = 31;
  always @(posedge clk)
    if (rst) age <= 31;
    else if (trip && (rest || !was_trip)) age <= 0;
    else if (age != 31) age <= age + 1;

`ifdef STOP
  // A cause that is not ignored stops in the next clock, with its flag; without clear_trip nothing is forgotten.
  always @(posedge clk) if (begun && !rest) begin
    if (was_trip) assert (fault_stop && fault_flags[7]);
    if (was_enable && (was_cause & ~was_ignore) != 0) assert (fault_stop);
    if (was_enable) assert ((was_cause & ~fault_flags) == 0);
    if (!was_clear) assert ((was_flags & ~fault_flags) == 0);
    if (!was_clear && was_stop && (was_ignore & fault_flags & CAUSES) == 0 && (fault_flags & CAUSES) != 0)
      assert (fault_stop);
    if (was_clear && was_trip) assert (fault_stop);
    if (fault_flags == 16'h0100) assert (!fault_stop);
    cover (fault_stop && !was_trip);
    cover (was_stop && !fault_stop);
  end
`endif

`ifdef CLEAR
  // A trip beats a clear: for 16 clocks after trip has become 1 nothing that is written to clear_trip lets the gates on again.
  always @(posedge clk) if (begun && !rest) begin
    if (age <= 16) assert (fault_stop && !gate_clear && fault_flags[7]);
    cover (age == 17 && was_clear && !fault_stop);
  end
`endif

`ifdef FIRST
  // The first fault that stopped is reported until no fault stops any more.
  always @(posedge clk) if (begun && !rest) begin
    if (was_stop) assert (first_fault == was_first);
    if (fault_stop && !was_stop) assert (first_fault != 0);
    cover (was_stop && first_fault != fault_flags);
  end
`endif
endmodule
