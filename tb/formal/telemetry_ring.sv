// SPDX-License-Identifier: BSD-3-Clause
// What the ring owes to who reads it after its end, around the converted entity telemetry_ring and through its ports
// alone: every row that entered whole, once, in order, and as many as were asked for.  Rows are counted modulo the ring
// and up to its size, so that the property has no bound in time.

module formal_top (
    input        clk,
    input        rst,
    input        row_valid,
    input        word,
    input        ring_arm,
    input        ring_stop,
    input [15:0] ring_address
);
  localparam ROWS = `RING_ROWS;
  localparam WORDS = `ROW_WORDS;
  localparam DEPTH = ROWS * WORDS;

  wire ring_recording, ring_ended, ring_full;
  wire [15:0] ring_next;
  wire [31:0] ring_data;
  (* anyconst *) wire [1:0] after;

`ifdef LEMMAS
  wire [4:0] spy_index;
  wire [$clog2(DEPTH)-1:0] spy_write_at;
  wire [11:0] spy_left;
  wire [31:0] spy_word_1;
  wire [32*2**$clog2(DEPTH)-1:0] spy_ram;
  wire spy_waiting, spy_live, spy_hit, spy_ended, spy_wrapped, spy_full;
  wire spy_inside, spy_valid_1, spy_final_1, spy_stop_1, spy_end_2;
`endif

  telemetry_ring dut (
`ifdef LEMMAS
      .spy_index(spy_index),
      .spy_write_at(spy_write_at),
      .spy_left(spy_left),
      .spy_word_1(spy_word_1),
      .spy_ram(spy_ram),
      .spy_waiting(spy_waiting),
      .spy_live(spy_live),
      .spy_hit(spy_hit),
      .spy_ended(spy_ended),
      .spy_wrapped(spy_wrapped),
      .spy_full(spy_full),
      .spy_inside(spy_inside),
      .spy_valid_1(spy_valid_1),
      .spy_final_1(spy_final_1),
      .spy_stop_1(spy_stop_1),
      .spy_end_2(spy_end_2),
`endif
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
      .ring_after({10'd0, after}),
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

  // Rows: WORDS words with gaps as the writer likes, two clocks or more between two rows
  reg [1:0] index, rest;
  wire first = row_valid && index == 0;
  wire final_word = row_valid && index == WORDS - 1;
  always @(posedge clk) begin
    if (row_valid) index <= final_word ? 0 : index + 1;
    if (final_word) rest <= 2;
    else if (rest != 0) rest <= rest - 1;
    if (rst) {index, rest} <= 0;
  end
  always @* if (rest != 0 || rst) assume (!row_valid);

  // A row counts if the ring recorded at its first word and nobody armed it again since
  reg during, stopped;
  reg [1:0] where;  // the next row's place, in rows
  reg [1:0] held;  // rows, up to the ring's size
  reg [2:0] since;  // rows that ended since the stop, up to seven
  wire counts = index == 0 ? ring_recording : during;
  wire whole = final_word && counts;
  always @(posedge clk) begin
    if (first) during <= ring_recording;
    if (final_word) during <= 0;
    if (whole) where <= where == ROWS - 1 ? 0 : where + 1;
    if (whole && held != ROWS) held <= held + 1;
    if (whole && (stopped || ring_stop) && since != 7) since <= since + 1;
    if (ring_stop) stopped <= 1;
    if (rst || ring_arm) {during, where, held, since, stopped} <= 0;
  end
  always @* if (!ring_recording || !(during || held != 0)) assume (!ring_stop);
  always @* if (rst) assume (!ring_arm);

  // One word, whichever the solver marks, where its row is, and how many rows have ended since, its own included
  (* anyseq *) wire pick;
  reg marked, value, over;
  reg [1:0] place, slot;
  reg [2:0] age;
  wire mark = row_valid && counts && pick && !marked;
  always @(posedge clk) begin
    if (mark) {marked, value, place, slot, age} <= {1'b1, word, index, where, 2'd0, final_word};
    if (marked && whole && age != ROWS + 1) age <= age + 1;
    if (marked && row_valid && counts && where == slot && index == place) over <= 1;
    if (rst || ring_arm) {marked, over} <= 0;
  end

  reg [15:0] address;
  reg was_ended;
  always @(posedge clk) {address, was_ended} <= {ring_address, ring_ended};

  always @(posedge clk) if (begun) begin
    if (ring_ended) begin
      assert (stopped && since == 1 + after);
      assert (ring_next == where * WORDS);
      assert (!was_ended || ring_full == (held == ROWS));
    end
    if (was_ended && ring_ended && marked && age <= ROWS && address == slot * WORDS + place)
      assert (ring_data == {31'd0, value});
    cover (was_ended && ring_full && marked && age == ROWS && over == 0 && since == 2);
    cover (ring_ended && !ring_full && held == 1);
  end

`ifdef LEMMAS
  // The stages of the ring behind what enters
  reg v_1, f_1, c_1, s_1, stopped_1, marked_1;
  reg [1:0] i_1, held_1, held_2;
  reg [2:0] since_1, since_2;
  always @(posedge clk) begin
    {v_1, f_1, i_1, s_1} <= {row_valid, final_word, index, ring_stop};
    c_1 <= row_valid && counts;
    {stopped_1, marked_1, held_1, held_2, since_1, since_2} <= {stopped, marked, held, held_1, since, since_1};
    if (ring_arm) {c_1, stopped_1, marked_1, held_1, held_2, since_1, since_2} <= 0;
    if (rst) {v_1, f_1, c_1, s_1, i_1, stopped_1, marked_1, held_1, held_2, since_1, since_2} <= 0;
  end

  wire [7:0] next = (where * WORDS + (during ? index : 0) + DEPTH - c_1) % DEPTH;
  wire [7:0] at = slot * WORDS + place;
  always @(posedge clk) if (begun) begin
    assert (index < WORDS && rest <= 2 && where < ROWS && held <= ROWS);
    assert (spy_index == index && spy_valid_1 == v_1 && spy_stop_1 == s_1);
    if (v_1) assert (spy_final_1 == f_1 && f_1 == (i_1 == WORDS - 1) && spy_word_1[31:1] == 0);
    if (!v_1) assert (!f_1 && !c_1);
    if (v_1 && !f_1) assert (index == i_1 + 1);
    assert ((rest == 2) == f_1 && (rest == 1) == spy_end_2);
    if (rest != 0) assert (index == 0);
    assert (spy_inside == (v_1 ? i_1 != 0 : index != 0));

    assert (spy_waiting + spy_live + spy_ended <= 1);
    if (during) assert (spy_live && index != 0);
    if (index != 0 && !during) assert (!spy_live);
    if (v_1) assert (c_1 == spy_live);
    if (spy_waiting) assert (where == 0 && held == 0 && !during && !stopped && !marked);
    if (!spy_waiting && !spy_live && !spy_ended) assert (held == 0 && !during && !stopped && !marked);
    assert (spy_write_at == next);
    if (held < ROWS) assert (where == held);
    assert (spy_wrapped == (held_1 == ROWS) && spy_full == (held_2 == ROWS));

    assert (spy_hit == stopped_1);
    if (stopped && !stopped_1) assert (spy_stop_1 && spy_live);
    if (spy_stop_1 && spy_live) assert (stopped);
    if (!stopped) assert (since == 0);
    if (spy_live && spy_hit) assert (since_2 <= after && spy_left == after - since_2);
    if (spy_ended) assert (spy_hit && since_2 == 1 + after);
    if (held_1 != held) assert (f_1);

    if (marked && !marked_1) assert (v_1 && c_1 && spy_word_1[0] == value && spy_write_at == at);
    if (marked_1) assert (marked);
    if (marked_1 && !over) assert (spy_ram[32*at+:32] == {31'd0, value});
    if (marked && age == 0) assert (during && index > place && where == slot);
    if (marked && age <= ROWS) assert (where == (slot + age) % ROWS);
    if (over) assert (age > ROWS || (age == ROWS && during && index > place));
    if (over) assert (marked);
    if (marked) assert (slot < ROWS && place < WORDS && age <= ROWS + 1);
  end
`endif
endmodule
