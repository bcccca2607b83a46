// SPDX-License-Identifier: BSD-3-Clause
// What the ring owes to who reads it after its end, around the converted entity telemetry_ring and through its ports
// alone: every row that entered whole, once, in order, and as many as were asked for.

module formal_top (
    input        clk,
    input        rst,
    input        row_valid,
    input        word,
    input        ring_arm,
    input        ring_stop,
    input [15:0] ring_address
);
  localparam DEPTH = `RING_ROWS * `ROW_WORDS;

  wire ring_recording, ring_ended, ring_full;
  wire [15:0] ring_next;
  wire [31:0] ring_data;
  (* anyconst *) wire after;

  telemetry_ring dut (
      .clk(clk),
      .rst(rst),
      .row_valid(row_valid),
      .row_word({31'd0, word}),
      .tripped(1'b0),
      .fault_flags(16'd0),
      .ring_arm(ring_arm),
      .ring_stop(ring_stop),
      .ring_faults(17'd0),
      .ring_word(5'd0),
      .ring_high(19'd0),
      .ring_low(19'd0),
      .ring_after({11'd0, after}),
      .ring_address(ring_address),
      .ring_recording(ring_recording),
      .ring_ended(ring_ended),
      .ring_full(ring_full),
      .ring_next(ring_next),
      .ring_data(ring_data)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);
  always @* if (begun) assume (!rst);

  // Rows: ROW_WORDS words with gaps as the writer likes, two clocks or more between two rows
  reg [1:0] index, rest;
  wire first = row_valid && index == 0;
  wire final_word = row_valid && index == `ROW_WORDS - 1;
  always @(posedge clk) begin
    if (row_valid) index <= final_word ? 0 : index + 1;
    if (final_word) rest <= 2;
    else if (rest != 0) rest <= rest - 1;
    if (rst) {index, rest} <= 0;
  end
  always @* if (rest != 0 || rst) assume (!row_valid);

  // A row counts if the ring recorded at its first word and nobody armed it again since
  reg during, stopped;
  reg [4:0] rows, rows_at_stop;
  wire counts = index == 0 ? ring_recording : during;
  always @(posedge clk) begin
    if (first) during <= ring_recording;
    if (final_word) during <= 0;
    if (final_word && counts) rows <= rows + 1;
    if (ring_stop && !stopped) {stopped, rows_at_stop} <= {1'b1, rows};
    if (rst || ring_arm) {during, rows, stopped} <= 0;
  end
  always @* if (!ring_recording || !(during || rows != 0)) assume (!ring_stop);
  always @* if (rst) assume (!ring_arm);

  // One word, whichever the solver marks, and where its row is
  (* anyseq *) wire pick;
  reg marked;
  reg value;
  reg [1:0] place;
  reg [4:0] row;
  always @(posedge clk) begin
    if (row_valid && counts && pick && !marked) {marked, value, place, row} <= {1'b1, word, index, rows};
    if (rst || ring_arm) marked <= 0;
  end

  reg [15:0] address;
  reg was_ended;
  always @(posedge clk) {address, was_ended} <= {ring_address, ring_ended};

  always @(posedge clk) if (begun) begin
    if (ring_ended) begin
      assert (stopped && rows == rows_at_stop + 1 + after);
      assert (ring_next == (rows * `ROW_WORDS) % DEPTH);
      assert (!was_ended || ring_full == (rows >= `RING_ROWS));
    end
    if (was_ended && ring_ended && marked && row + `RING_ROWS >= rows && address == (row * `ROW_WORDS + place) % DEPTH)
      assert (ring_data == {31'd0, value});
    cover (was_ended && ring_full && marked && row + `RING_ROWS == rows && row != 0);
    cover (ring_ended && !ring_full && rows == 1);
  end
endmodule
