-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: a FIFO in block RAM for an AXI4-Stream: accepts one word per clock, outputs one when the sink is ready.
-- room = 1: the FIFO has space for a whole packet of PACKET words.  A writer that checks it before the first word
-- never waits and never breaks off a packet.  A word written to a full FIFO is ignored.  out_data and out_last
-- stay until out_ready.
-- Formats: unchanged.  The RAM holds 2**DEPTH_BITS words, its read register and the output register one more each:
-- a RAM's output is slow, and every output of the core comes from a register.
-- Latency: a word appears three clocks after it was written to an empty FIFO.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity packet_fifo is
  generic (
    WIDTH      : positive range 1 to 71 := 32;
    DEPTH_BITS : positive range 3 to 16 := 9;
    PACKET     : positive               := 24
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    in_data   : in  unsigned(WIDTH - 1 downto 0);
    in_last   : in  std_logic;
    out_ready : in  std_logic;
    out_valid : out std_logic;
    out_data  : out unsigned(WIDTH - 1 downto 0);
    out_last  : out std_logic;
    room      : out std_logic
  );
end entity packet_fifo;

architecture rtl of packet_fifo is
  constant DEPTH : positive := 2 ** DEPTH_BITS;

  type ram_t is array (0 to DEPTH - 1) of unsigned(WIDTH downto 0);

  signal ram : ram_t;

  -- yosys: a word is never read in the clock that writes it, so no bypass logic is needed
  attribute no_rw_check : boolean;
  attribute no_rw_check of ram : signal is true;

  -- State
  signal used       : unsigned(DEPTH_BITS downto 0);  -- words in the RAM
  signal some       : std_logic;  -- used /= 0; registered, because the RAM's whole output path depends on it
  signal fits       : std_logic;  -- used <= DEPTH - PACKET; registered for the same reason
  signal write_at   : unsigned(DEPTH_BITS - 1 downto 0);
  signal read_at    : unsigned(DEPTH_BITS - 1 downto 0);
  signal read_valid : std_logic;
  signal read_word  : unsigned(WIDTH downto 0);
  signal shown      : std_logic;
  signal out_word   : unsigned(WIDTH downto 0);

  signal take  : std_logic;
  signal fetch : std_logic;
  signal move  : std_logic;
begin
  take  <= in_valid and not used(DEPTH_BITS);
  move  <= read_valid and (out_ready or not shown);
  fetch <= some and (out_ready or not read_valid or not shown);

  process (clk)
  begin
    if rising_edge(clk) then
      -- The RAM's write port, and its read port with its own register; never the same word in the same clock
      if take = '1' then
        ram(to_integer(write_at)) <= in_last & in_data;
        write_at                  <= write_at + 1;
      end if;
      if fetch = '1' then
        read_word <= ram(to_integer(read_at));
        read_at   <= read_at + 1;
      end if;
      read_valid <= fetch or (read_valid and not move);

      -- The output register
      if move = '1' then
        out_word <= read_word;
      end if;
      shown <= move or (shown and not out_ready);

      -- +1, or -1 as all ones
      if take /= fetch then
        used <= used + unsigned(signed'(DEPTH_BITS - 1 downto 0 => fetch) & '1');
      end if;
      some <= take or (some and not fetch);
      if used > 1 then
        some <= '1';
      end if;
      fits <= '0';
      if used < DEPTH - PACKET or (used = DEPTH - PACKET and (fetch or not take) = '1') or
         (used = DEPTH - PACKET + 1 and (fetch and not take) = '1') then
        fits <= '1';
      end if;

      if rst = '1' then
        used       <= (others => '0');
        some       <= '0';
        fits       <= '1';
        write_at   <= (others => '0');
        read_at    <= (others => '0');
        read_valid <= '0';
        shown      <= '0';
      end if;
    end if;
  end process;

  out_valid <= shown;
  out_data  <= out_word(WIDTH - 1 downto 0);
  out_last  <= out_word(WIDTH);
  room      <= fits;

end architecture rtl;
