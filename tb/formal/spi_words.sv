// SPDX-License-Identifier: BSD-3-Clause
// What the receiver of SPI words promises, around the converted entity spi_words and through its ports alone.
// The registers and the bits may change at any clock.

module formal_top (
    input       clk,
    input       rst,
    input       frame_start,
    input       bit_taken,
    input [1:0] miso,
    input [5:0] word_bits,
    input [4:0] skip_bits,
    input       two_words,
    input       signed_code
);
  wire codes_valid;
  wire [11:0] code_0, code_1, code_2, code_3, code_4, code_5, code_6, code_7;

  spi_words dut (
      .clk(clk),
      .rst(rst),
      .frame_start(frame_start),
      .bit_taken(bit_taken),
      .miso(miso),
      .word_bits(word_bits),
      .skip_bits(skip_bits),
      .two_words(two_words),
      .signed_code(signed_code),
      .codes_valid(codes_valid),
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

  reg rest, was_two_words;
  reg [95:0] was_codes;
  wire [95:0] codes = {code_0, code_1, code_2, code_3, code_4, code_5, code_6, code_7};
  always @(posedge clk) {rest, was_two_words, was_codes} <= {rst, two_words, codes};

  // The codes change together, with codes_valid and at no other clock; absent lines and words stay zero.
  always @(posedge clk) if (begun && !rest) begin
    if (!codes_valid) assert (codes == was_codes);
    assert (code_2 == 0 && code_3 == 0 && code_6 == 0 && code_7 == 0);
    if (!was_two_words && codes_valid) assert (code_4 == 0 && code_5 == 0);
    cover (codes_valid && code_0 != was_codes[95:84] && code_5 != 0);
  end
endmodule
