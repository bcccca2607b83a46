-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: motor_table for the bench of the blocks, which looks for the tops of cells here.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity motor_table_tb is
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
end entity motor_table_tb;

architecture sim of motor_table_tb is
begin

  cell : entity work.motor_table
    generic map (ADDRESS_BITS => ADDRESS_BITS, WIDTH => WIDTH)
    port map (
      clk => clk, write => write, write_at => write_at, write_word => write_word, read_at => read_at, word => word
    );

end architecture sim;
