-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: interpolation with ports of given widths, for the bench of the blocks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity interpolation_tb is
  generic (
    WIDTH : positive;
    BITS  : positive
  );
  port (
    clk      : in  std_logic;
    a        : in  signed(WIDTH - 1 downto 0);
    b        : in  signed(WIDTH - 1 downto 0);
    fraction : in  unsigned(BITS - 1 downto 0);
    y        : out signed(WIDTH - 1 downto 0)
  );
end entity interpolation_tb;

architecture sim of interpolation_tb is
begin

  cell : entity work.interpolation
    port map (clk => clk, a => a, b => b, fraction => fraction, y => y);

end architecture sim;
