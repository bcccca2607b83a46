// SPDX-License-Identifier: BSD-3-Clause
// What the reader of the XADC promises, around the converted entity xadc_reader and through its ports alone.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input        clk,
    input        rst,
    input        sample_trigger,
    input        busy,
    input        eoc,
    input        drdy,
    input [15:0] drp_do,
    input [ 2:0] conversions,
    input [ 2:0] channels,
    input [ 6:0] address_0,
    input [ 6:0] address_1,
    input [ 6:0] address_2,
    input [ 6:0] address_3,
    input [15:0] timeout,
    input        signed_code
);
  wire convst, den, codes_valid, frame_error;
  wire [ 6:0] daddr;
  wire [11:0] code_0, code_1, code_2, code_3;

  xadc_reader dut (
      .clk(clk),
      .rst(rst),
      .sample_trigger(sample_trigger),
      .busy(busy),
      .eoc(eoc),
      .drdy(drdy),
      .drp_do(drp_do),
      .conversions(conversions),
      .channels(channels),
      .address_0(address_0),
      .address_1(address_1),
      .address_2(address_2),
      .address_3(address_3),
      .timeout(timeout),
      .signed_code(signed_code),
      .convst(convst),
      .den(den),
      .daddr(daddr),
      .codes_valid(codes_valid),
      .frame_error(frame_error),
      .code_0(code_0),
      .code_1(code_1),
      .code_2(code_2),
      .code_3(code_3)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  reg rest;
  always @(posedge clk) rest <= rst;

`ifdef ANSWER
  // A trigger that finds no frame is answered at the latest two clocks after the time-out; nothing is said without one.
  (* anyconst *) wire [15:0] held;
  always @* assume (timeout == held && held < 40);
  reg waiting;  // for the answer to a trigger that began a frame
  reg [6:0] since;
  reg refused;  // the last clock's trigger found a frame or a conversion
  wire answered = codes_valid || (frame_error && !refused);
  wire still = waiting && !answered;
  always @(posedge clk) begin
    waiting <= !rst && (still || (sample_trigger && !busy));
    since   <= rst || !still ? 1 : since + 1;
    refused <= sample_trigger && (still || busy) && !rst;
    if (rst) since <= 0;
  end
  // A trigger during a frame may fall on the clock at which it is given up: one error for both.
  always @* assume (!(sample_trigger && still));
  always @(posedge clk) if (begun && !rest) begin
    if (still) assert (since <= held + 2);
    if (codes_valid || frame_error) assert (waiting || refused);
    assert (!(codes_valid && frame_error && !refused));
    if (refused) assert (frame_error);
    cover (codes_valid);
    cover (answered && frame_error && held > 20);
  end
`endif

`ifdef ONE_READ
  // One read at a time: den lasts a clock and does not come again until drdy, or until the next frame.
  reg reading;
  always @(posedge clk) reading <= !rst && !convst && !drdy && (den || reading);
  always @(posedge clk) if (begun && !rest) begin
    if (reading) assert (!den);
    cover (den && drdy);
    cover (reading && drdy);
  end
`endif

`ifdef TOGETHER
  reg [47:0] was_codes;
  always @(posedge clk) was_codes <= {code_0, code_1, code_2, code_3};
  always @(posedge clk) if (begun && !rest) begin
    if (!codes_valid) assert (was_codes == {code_0, code_1, code_2, code_3});
    cover (codes_valid && code_3 != was_codes[11:0]);
  end
`endif
endmodule
