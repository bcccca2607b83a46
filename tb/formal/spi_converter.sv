// SPDX-License-Identifier: BSD-3-Clause
// What the master for SPI converters promises, around the converted entity spi_converter and through its ports alone.
// The registers are constant: any value of theirs, within the bounds of the macro's property.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input       clk,
    input       rst,
    input       sample_trigger,
    input [1:0] miso,
    input       busy
);
  (* anyconst *) wire [4:0] clock_ratio;
  (* anyconst *) wire [5:0] word_bits;
  (* anyconst *) wire [4:0] skip_bits;
  (* anyconst *) wire [3:0] sample_delay;
  (* anyconst *) wire [15:0] wait_clocks;
  (* anyconst *) wire [15:0] busy_timeout;
  (* anyconst *) wire two_words, use_convst, clock_idle, second_edge, signed_code;

  wire convst, cs_n, sclk, codes_valid, frame_error, setting_refused;
  wire [11:0] code_0, code_1, code_2, code_3, code_4, code_5, code_6, code_7;

  spi_converter dut (
      .clk(clk),
      .rst(rst),
      .sample_trigger(sample_trigger),
      .miso(miso),
      .busy(busy),
      .clock_ratio(clock_ratio),
      .word_bits(word_bits),
      .skip_bits(skip_bits),
      .sample_delay(sample_delay),
      .wait_clocks(wait_clocks),
      .busy_timeout(busy_timeout),
      .two_words(two_words),
      .use_convst(use_convst),
      .clock_idle(clock_idle),
      .second_edge(second_edge),
      .signed_code(signed_code),
      .convst(convst),
      .cs_n(cs_n),
      .sclk(sclk),
      .codes_valid(codes_valid),
      .frame_error(frame_error),
      .setting_refused(setting_refused),
      .code_0(code_0),
      .code_1(code_1),
      .code_2(code_2),
      .code_3(code_3),
      .code_4(code_4),
      .code_5(code_5),
      .code_6(code_6),
      .code_7(code_7)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  reg rest, was_cs_n, was_convst, was_sclk;
  always @(posedge clk) {rest, was_cs_n, was_convst, was_sclk} <= {rst, cs_n, convst, sclk};

`ifdef PINS
  // No frame while converting; the clock rests at its idle level where there is no frame, and in the first period of one.
  always @(posedge clk) if (begun) begin
    assert (!(convst && !cs_n));
    if (!rest && cs_n && was_cs_n) assert (sclk == clock_idle);
    cover (!cs_n && sclk != clock_idle);
    cover (convst);
  end
`endif

`ifdef CONVST
  // convst lasts until BUSY is low and at least wait_clocks, at most busy_timeout; then a frame begins or it is an error.
  reg [15:0] high;  // clocks that convst has been high
  reg busy_1, busy_2;
  always @(posedge clk) begin
    {busy_2, busy_1} <= rst ? 2'b0 : {busy_1, busy};
    high <= rst || !convst ? 0 : high + 1;
  end
  wire [15:0] now = high + 1;
  reg [15:0] was_now;
  reg was_busy;
  always @(posedge clk) {was_now, was_busy} <= {now, busy_2};
  always @* assume (busy_timeout < 40);
  always @(posedge clk) if (begun && !rest) begin
    if (convst) assert (now <= (busy_timeout > 1 ? busy_timeout : 1));
    if (was_convst && !convst && !cs_n) assert (!was_busy && was_now >= wait_clocks);
    if (was_convst && !convst && cs_n) assert (frame_error);
    cover (was_convst && !convst && cs_n);
    cover (was_convst && !convst && !cs_n && was_now > 9);
  end
`endif
endmodule
