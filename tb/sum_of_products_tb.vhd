-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: sum_of_products with ports of given widths, for the bench of the blocks; c and d are delayed here, so that
-- the bench gives all operands of a sum in one clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity sum_of_products_tb is
  generic (
    A_W  : positive;
    B_W  : positive;
    C_W  : positive;
    D_W  : positive;
    Y_W  : positive;
    DROP : positive
  );
  port (
    clk   : in  std_logic;
    a     : in  signed(A_W - 1 downto 0);
    b     : in  signed(B_W - 1 downto 0);
    minus : in  std_logic;
    c     : in  signed(C_W - 1 downto 0);
    d     : in  signed(D_W - 1 downto 0);
    y     : out signed(Y_W - 1 downto 0)
  );
end entity sum_of_products_tb;

architecture sim of sum_of_products_tb is
  signal c_1 : signed(C_W - 1 downto 0);
  signal d_1 : signed(D_W - 1 downto 0);
begin

  process (clk)
  begin
    if rising_edge(clk) then
      c_1 <= c;
      d_1 <= d;
    end if;
  end process;

  cell : entity work.sum_of_products
    generic map (DROP => DROP)
    port map (clk => clk, a => a, b => b, minus => minus, c => c_1, d => d_1, y => y);

end architecture sim;
