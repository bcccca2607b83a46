// SPDX-License-Identifier: BSD-3-Clause
// The rules of AXI4-Stream and what a queue owes, around the converted entity packet_fifo and through its ports alone.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input                clk,
    input                rst,
    input                in_valid,
    input [`WIDTH - 1:0] in_data,
    input                in_last,
    input                out_ready
);
  wire out_valid, out_last, room;
  wire [`WIDTH - 1:0] out_data;

  packet_fifo dut (
      .clk(clk),
      .rst(rst),
      .in_valid(in_valid),
      .in_data(in_data),
      .in_last(in_last),
      .out_ready(out_ready),
      .out_valid(out_valid),
      .out_data(out_data),
      .out_last(out_last),
      .room(room)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

`ifdef STABLE
  reg rest, was_valid, was_ready, was_last;
  reg [`WIDTH - 1:0] was_data;
  always @(posedge clk) {rest, was_valid, was_ready, was_last, was_data} <= {rst, out_valid, out_ready, out_last, out_data};
  always @(posedge clk) if (begun && !rest) begin
    if (was_valid && !was_ready) assert (out_valid && out_last == was_last && out_data == was_data);
    cover (was_valid && !was_ready && in_valid);
    cover (was_valid && was_ready && out_valid);
  end
`endif

`ifdef WHOLE
  // The writer begins a packet where there is room and writes its words when it likes, one after the other.
  reg [2:0] left;
  always @(posedge clk) begin
    if (in_valid) left <= left == 0 ? `PACKET - 1 : left - 1;
    if (rst) left <= 0;
  end
  always @* if (begun && in_valid && left == 0) assume (room);
  always @* if (rst) assume (!in_valid);

  // One word, whichever the solver marks: with how many before it the queue took it, and how many it has given since.
  (* anyseq *) wire pick;
  reg marked, gone;
  reg [`WIDTH:0] word;
  reg [3:0] inside, ahead;
  wire taken = out_valid && out_ready;
  always @(posedge clk) begin
    inside <= inside + in_valid - taken;
    if (in_valid && pick && !marked) begin
      marked <= 1;
      word   <= {in_last, in_data};
      ahead  <= inside - taken;
    end else if (marked && !gone && taken) begin
      ahead <= ahead - 1;
      gone  <= ahead == 0;
    end
    if (rst) {marked, gone, inside, ahead} <= 0;
  end

  always @(posedge clk) if (begun) begin
    if (marked && !gone && ahead == 0 && out_valid) assert ({out_last, out_data} == word);
    if (taken) assert (inside != 0);
    assert (inside <= (1 << `DEPTH_BITS) + 2);  // two registers behind the RAM
    cover (gone && inside == 5);
    cover (marked && !gone && ahead == 6);
  end
`endif
endmodule
