-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: a table in block RAM, one word written and one read a clock; zeros after power-up.
--   word = table(read_at), as it was before this clock's write
-- Formats: unchanged.
-- Latency: 2, the RAM's register and the one behind it.  Interval: 1; no strobes, no reset.
-- Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity motor_table is
  generic (
    ADDRESS_BITS : positive;
    WIDTH        : positive
  );
  port (
    clk        : in  std_logic;
    write      : in  std_logic;
    write_at   : in  unsigned(ADDRESS_BITS - 1 downto 0);
    write_word : in  unsigned(WIDTH - 1 downto 0);
    read_at    : in  unsigned(ADDRESS_BITS - 1 downto 0);
    word       : out unsigned(WIDTH - 1 downto 0)
  );
end entity motor_table;

architecture rtl of motor_table is
  type ram_t is array (0 to 2 ** ADDRESS_BITS - 1) of unsigned(WIDTH - 1 downto 0);

  -- vsg_off signal_007
  signal memory : ram_t := (others => (others => '0'));  -- a block RAM has a content after configuration
  -- vsg_on signal_007
  signal word_1 : unsigned(WIDTH - 1 downto 0);
begin

  process (clk)
  begin
    if rising_edge(clk) then
      if write = '1' then
        memory(to_integer(write_at)) <= write_word;
      end if;
      word_1 <= memory(to_integer(read_at));
      word   <= word_1;
    end if;
  end process;

end architecture rtl;
