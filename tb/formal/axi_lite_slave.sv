// SPDX-License-Identifier: BSD-3-Clause
// The rules of AXI4-Lite, around the converted entity axi_lite_slave and through its ports alone.
// The master may do whatever the protocol allows; the registers behind may answer in any clock with a request.
// One property at a time: the macro of its name is defined when this file is read.

module formal_top (
    input        clk,
    input        rst,
    input [11:0] awaddr,
    input        awvalid,
    input [31:0] wdata,
    input [ 3:0] wstrb,
    input        wvalid,
    input        bready,
    input [11:0] araddr,
    input        arvalid,
    input        rready,
    input        answer,
    input [ 1:0] response,
    input [31:0] read_data
);
  wire awready, wready, bvalid, arready, rvalid, request, write;
  wire [ 1:0] bresp;
  wire [ 1:0] rresp;
  wire [31:0] rdata;
  wire [11:0] address;
  wire [31:0] write_data;
  wire [ 3:0] strobe;

  axi_lite_slave dut (
      .clk(clk),
      .rst(rst),
      .s_axi_awaddr(awaddr),
      .s_axi_awvalid(awvalid),
      .s_axi_awready(awready),
      .s_axi_wdata(wdata),
      .s_axi_wstrb(wstrb),
      .s_axi_wvalid(wvalid),
      .s_axi_wready(wready),
      .s_axi_bresp(bresp),
      .s_axi_bvalid(bvalid),
      .s_axi_bready(bready),
      .s_axi_araddr(araddr),
      .s_axi_arvalid(arvalid),
      .s_axi_arready(arready),
      .s_axi_rdata(rdata),
      .s_axi_rresp(rresp),
      .s_axi_rvalid(rvalid),
      .s_axi_rready(rready),
      .request(request),
      .write(write),
      .address(address),
      .write_data(write_data),
      .strobe(strobe),
      .answer(answer),
      .response(response),
      .read_data(read_data)
  );

  reg begun = 0;
  always @(posedge clk) begun <= 1;
  always @* if (!begun) assume (rst);

  // The clock before; `rest` is high after a reset, which ends every promise.
  reg rest;
  reg was_awvalid, was_awready, was_wvalid, was_wready, was_bvalid, was_bready;
  reg was_arvalid, was_arready, was_rvalid, was_rready, was_request, was_answer, was_write;
  reg [11:0] was_awaddr, was_araddr, was_address;
  reg [31:0] was_wdata, was_rdata, was_write_data, was_read_data;
  reg [3:0] was_wstrb, was_strobe;
  reg [1:0] was_bresp, was_rresp, was_response;
  always @(posedge clk) begin
    rest <= rst;
    {was_awvalid, was_awready, was_awaddr} <= {awvalid, awready, awaddr};
    {was_wvalid, was_wready, was_wdata, was_wstrb} <= {wvalid, wready, wdata, wstrb};
    {was_bvalid, was_bready, was_bresp} <= {bvalid, bready, bresp};
    {was_arvalid, was_arready, was_araddr} <= {arvalid, arready, araddr};
    {was_rvalid, was_rready, was_rdata, was_rresp} <= {rvalid, rready, rdata, rresp};
    {was_request, was_answer, was_write, was_address} <= {request, answer, write, address};
    {was_write_data, was_strobe, was_response, was_read_data} <= {write_data, strobe, response, read_data};
  end

  // The master's side of the contract: valid and payload stay until ready.
  always @* if (begun && !rest) begin
    if (was_awvalid && !was_awready) assume (awvalid && awaddr == was_awaddr);
    if (was_wvalid && !was_wready) assume (wvalid && wdata == was_wdata && wstrb == was_wstrb);
    if (was_arvalid && !was_arready) assume (arvalid && araddr == was_araddr);
  end

  // What is owed to the master: a request taken and not answered yet, by the handshakes on the bus.
  reg owe_b, owe_r;
  reg owed_w;  // write data taken and not answered yet
  always @(posedge clk) begin
    if (awvalid && awready) owe_b <= 1;
    if (bvalid && bready) owe_b <= 0;
    if (wvalid && wready) owed_w <= 1;
    if (bvalid && bready) owed_w <= 0;
    if (arvalid && arready) owe_r <= 1;
    if (rvalid && rready) owe_r <= 0;
    if (rst) {owe_b, owed_w, owe_r} <= 0;
  end

`ifdef STABLE
  // Valid stays until ready, and what it carries stays with it.
  always @(posedge clk) if (begun && !rest) begin
    if (was_bvalid && !was_bready) assert (bvalid && bresp == was_bresp);
    if (was_rvalid && !was_rready) assert (rvalid && rdata == was_rdata && rresp == was_rresp);
    cover (was_bvalid && !was_bready && was_rvalid && !was_rready);
  end
`endif

`ifdef ONE_ANSWER
  // An answer only to a request, one for each; address and data of a write are taken together.
  always @(posedge clk) if (begun) begin
    if (bvalid) assert (owe_b && owed_w);
    if (rvalid) assert (owe_r);
    if (awvalid && awready) assert (!owe_b);
    if (wvalid && wready) assert (!owed_w);
    if (arvalid && arready) assert (!owe_r);
    assert (owe_b == owed_w);
    cover (bvalid && bready && rvalid && rready);
    cover (arvalid && arready && bvalid);
  end
`endif

`ifdef REQUEST
  // A request comes of a handshake and carries what was shaken; it stays until its answer, which the bus then gets.
  always @(posedge clk) if (begun && !rest) begin
    if (request && !was_request) begin
      if (write) assert (was_awvalid && was_awready && was_wvalid && was_wready);
      if (write) assert (address == was_awaddr && write_data == was_wdata && strobe == was_wstrb);
      if (!write) assert (was_arvalid && was_arready && address == was_araddr);
    end
    if (was_request && !was_answer) assert (request && write == was_write && address == was_address);
    if (was_request && !was_answer && write) assert (write_data == was_write_data && strobe == was_strobe);
    if (was_request && was_answer) assert (!request);
    if (was_request && was_answer && was_write) assert (bvalid && bresp == was_response);
    if (was_request && was_answer && !was_write) begin
      assert (rvalid && rresp == was_response);
      assert (rdata == was_read_data);
    end
    if (bvalid && !was_bvalid) assert (was_request && was_answer && was_write);
    if (rvalid && !was_rvalid) assert (was_request && was_answer && !was_write);
    cover (request && was_request && write && !answer);
    cover (rvalid && rresp != 0);
  end
`endif

`ifdef PROGRESS
  // Nobody starves: with answers within 6 clocks and responses of its own direction taken at once, a request is taken
  // within 18 clocks, whatever the other direction does.  `writes` is either direction.
  (* anyconst *) wire writes;
  reg [2:0] slow;
  reg [4:0] aw_wait, ar_wait;
  always @(posedge clk) begin
    slow    <= request && !answer ? slow + 1 : 0;
    aw_wait <= awvalid && wvalid && !awready ? aw_wait + 1 : 0;
    ar_wait <= arvalid && !arready ? ar_wait + 1 : 0;
    if (rst) {slow, aw_wait, ar_wait} <= 0;
  end
  always @* if (begun) assume (writes ? bready : rready);
  always @* if (begun && slow == 5) assume (answer);
  always @(posedge clk) if (begun) begin
    assert ((writes ? aw_wait : ar_wait) < 18);
    cover (writes && aw_wait == 6);
    cover (!writes && ar_wait == 6 && bvalid);
  end
`endif

`ifdef IN_RESET
  // Nothing is valid, ready or asked for after a reset.
  always @(posedge clk) if (begun && rest) begin
    assert (!bvalid && !rvalid && !awready && !wready && !arready && !request);
    cover (was_request);
    cover (was_bvalid && was_rvalid);
  end
`endif
endmodule
