-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: a point between two words.
--   y = a + fraction*(b - a)
-- Formats: a, b and y of one width; fraction U(0,n) with the bits of its port.
-- Latency: 3 (difference, product, sum).  Interval: 1; no strobes, the pipeline never stops.
-- Rounding: the product is floored.  No overflow: y lies between a and b.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity interpolation is
  port (
    clk      : in  std_logic;
    a        : in  signed;
    b        : in  signed;
    fraction : in  unsigned;
    y        : out signed
  );
end entity interpolation;

architecture rtl of interpolation is
  constant WIDTH : positive := a'length;
  constant BITS  : positive := fraction'length;

  signal base_1     : signed(WIDTH - 1 downto 0);
  signal step_1     : signed(WIDTH downto 0);
  signal fraction_1 : unsigned(BITS - 1 downto 0);
  signal base_2     : signed(WIDTH - 1 downto 0);
  signal product_2  : signed(WIDTH + 1 + BITS downto 0);
begin
  process (clk)
  begin
    if rising_edge(clk) then
      -- Stage 1: step = b - a
      base_1     <= a;
      step_1     <= resize(b, WIDTH + 1) - a;
      fraction_1 <= fraction;

      -- Stage 2: product = fraction*step
      base_2    <= base_1;
      product_2 <= step_1 * signed('0' & fraction_1);

      -- Stage 3: y = a + product
      y <= resize(base_2 + shift_right(product_2, BITS), WIDTH);
    end if;
  end process;

end architecture rtl;
