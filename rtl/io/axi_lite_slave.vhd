-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the handshake of an AXI4-Lite slave, one request at a time; the logic behind it decides about the request.
--
--   address (and data) -> request, held until answer -> response, held until the master accepts it
--
-- A write is accepted when both its address and its data are valid.  A pending response blocks requests of its own
-- direction, so that pending reads and writes alternate: neither starves the other.
-- Every output to the bus comes from a register; valid and payload stay until ready.
-- answer may come in any clock with request = '1', but it must come: the bus waits until then.
-- Formats: those of AXI4-Lite, 32 bits of data.  The read data of a refused read are zero, given by the logic behind.
-- Latency: request one clock after the handshake, response one clock after answer.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity axi_lite_slave is
  generic (
    ADDRESS_BITS : positive := 12
  );
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    s_axi_awaddr  : in  std_logic_vector(ADDRESS_BITS - 1 downto 0);
    s_axi_awvalid : in  std_logic;
    s_axi_awready : out std_logic;
    s_axi_wdata   : in  std_logic_vector(31 downto 0);
    s_axi_wstrb   : in  std_logic_vector(3 downto 0);
    s_axi_wvalid  : in  std_logic;
    s_axi_wready  : out std_logic;
    s_axi_bresp   : out std_logic_vector(1 downto 0);
    s_axi_bvalid  : out std_logic;
    s_axi_bready  : in  std_logic;
    s_axi_araddr  : in  std_logic_vector(ADDRESS_BITS - 1 downto 0);
    s_axi_arvalid : in  std_logic;
    s_axi_arready : out std_logic;
    s_axi_rdata   : out std_logic_vector(31 downto 0);
    s_axi_rresp   : out std_logic_vector(1 downto 0);
    s_axi_rvalid  : out std_logic;
    s_axi_rready  : in  std_logic;
    request       : out std_logic;  -- 1: a request; the four signals below are valid until answer
    write         : out std_logic;  -- 1: write, 0: read
    address       : out unsigned(ADDRESS_BITS - 1 downto 0);
    write_data    : out std_logic_vector(31 downto 0);
    strobe        : out std_logic_vector(3 downto 0);
    answer        : in  std_logic;  -- 1: the request is done; the two signals below are valid
    response      : in  std_logic_vector(1 downto 0);
    read_data     : in  std_logic_vector(31 downto 0)
  );
end entity axi_lite_slave;

architecture rtl of axi_lite_slave is
  -- State, one-hot: exactly one of four registers is 1, because all other logic depends on it
  signal idle       : std_logic;
  signal take_write : std_logic;
  signal take_read  : std_logic;
  signal answering  : std_logic;

  signal b_valid    : std_logic;
  signal r_valid    : std_logic;
  signal writing    : std_logic;
  signal want_write : std_logic;
  signal want_read  : std_logic;
  signal answered   : std_logic;
begin
  want_write <= s_axi_awvalid and s_axi_wvalid and not b_valid;
  want_read  <= s_axi_arvalid and not r_valid;
  answered   <= answering and answer;

  process (clk)
  begin
    if rising_edge(clk) then
      -- Ready is 1 only in the single clock in which the master's valid is already 1
      take_write <= idle and want_write;
      take_read  <= idle and want_read and not want_write;
      answering  <= take_write or take_read or (answering and not answer);
      idle       <= (idle and not (want_write or want_read)) or answered;

      if take_write = '1' then
        writing    <= '1';
        address    <= unsigned(s_axi_awaddr);
        write_data <= s_axi_wdata;
        strobe     <= s_axi_wstrb;
      end if;
      if take_read = '1' then
        writing <= '0';
        address <= unsigned(s_axi_araddr);
      end if;

      b_valid <= (answered and writing) or (b_valid and not s_axi_bready);
      r_valid <= (answered and not writing) or (r_valid and not s_axi_rready);

      -- The response register is free, because otherwise the request would not have been accepted.  It is loaded in
      -- every clock until the answer, because answer arrives late and must not be in its enable
      if answering = '1' and writing = '1' then
        s_axi_bresp <= response;
      end if;
      if answering = '1' and writing = '0' then
        s_axi_rresp <= response;
        s_axi_rdata <= read_data;
      end if;

      if rst = '1' then
        idle       <= '1';
        address    <= (others => '0');
        take_write <= '0';
        take_read  <= '0';
        answering  <= '0';
        b_valid    <= '0';
        r_valid    <= '0';
      end if;
    end if;
  end process;

  request       <= answering;
  write         <= writing;
  s_axi_awready <= take_write;
  s_axi_wready  <= take_write;
  s_axi_arready <= take_read;
  s_axi_bvalid  <= b_valid;
  s_axi_rvalid  <= r_valid;

end architecture rtl;
