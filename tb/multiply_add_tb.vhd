-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: multiply_add with ports of given widths, for the bench of the blocks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity multiply_add_tb is
  generic (
    A_W   : positive;
    B_W   : positive;
    C_W   : positive;
    Y_W   : positive;
    DROP  : natural;
    MINUS : natural
  );
  port (
    clk     : in  std_logic;
    a       : in  signed(A_W - 1 downto 0);
    b       : in  signed(B_W - 1 downto 0);
    c       : in  signed(C_W - 1 downto 0);
    y       : out signed(Y_W - 1 downto 0);
    limited : out std_logic
  );
end entity multiply_add_tb;

architecture sim of multiply_add_tb is
begin

  cell : entity work.multiply_add
    generic map (DROP => DROP, MINUS => MINUS)
    port map (clk => clk, a => a, b => b, c => c, y => y, limited => limited);

end architecture sim;
