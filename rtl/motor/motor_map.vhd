-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the four points of a cell of the map in one clock, from four tables by the parity of row and column.
-- Formats: a word is a point, d in its upper half; 64 x 64 points.
-- Latency: 3.  Interval: 1; no strobes, no reset.
-- Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity motor_map is
  port (
    clk          : in  std_logic;
    row          : in  unsigned(5 downto 0);
    column       : in  unsigned(5 downto 0);
    table_write  : in  std_logic;
    table_select : in  unsigned(1 downto 0);
    table_at     : in  unsigned(11 downto 0);
    table_word   : in  unsigned(35 downto 0);
    point_00     : out unsigned(35 downto 0);
    point_01     : out unsigned(35 downto 0);
    point_10     : out unsigned(35 downto 0);
    point_11     : out unsigned(35 downto 0)
  );
end entity motor_map;

architecture rtl of motor_map is
  type words_t is array (0 to 3) of unsigned(35 downto 0);

  signal words_2 : words_t;
  signal odd_1   : unsigned(1 downto 0);
  signal odd_2   : unsigned(1 downto 0);
begin

  -- Table k has the rows whose parity is bit 1 of k and the columns whose parity is bit 0

  quarters : for k in 0 to 3 generate
    constant PARITY  : unsigned(1 downto 0) := to_unsigned(k, 2);
    signal   read_at : unsigned(9 downto 0);
    signal   mine    : std_logic;
    signal   rows    : unsigned(6 downto 0);
    signal   columns : unsigned(6 downto 0);
  begin
    -- Of the cell's two rows that of this parity: an even one is the next if the cell begins with an odd one
    rows    <= resize(row, 7) + 1 when PARITY(1) = '0' else resize(row, 7);
    columns <= resize(column, 7) + 1 when PARITY(0) = '0' else resize(column, 7);
    read_at <= rows(5 downto 1) & columns(5 downto 1);
    mine    <= table_write when table_select = 0 and table_at(6) = PARITY(1) and table_at(0) = PARITY(0) else '0';

    points : entity work.motor_table
      generic map (ADDRESS_BITS => 10, WIDTH => 36)
      port map (
        clk => clk, write => mine, write_at => table_at(11 downto 7) & table_at(5 downto 1), write_word => table_word,
        read_at => read_at, word => words_2(k)
      );

  end generate quarters;

  process (clk)
  begin
    if rising_edge(clk) then
      odd_1 <= row(0) & column(0);
      odd_2 <= odd_1;

      -- Stage 3: each point from the table of its parity
      point_00 <= words_2(to_integer(odd_2));
      point_01 <= words_2(to_integer(odd_2 xor "01"));
      point_10 <= words_2(to_integer(odd_2 xor "10"));
      point_11 <= words_2(to_integer(odd_2 xor "11"));
    end if;
  end process;

end architecture rtl;
