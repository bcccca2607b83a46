-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: two products that are added or subtracted, in two DSP48 with registers at operands and products.
--   y = round_half_up(c*d + a*b, DROP),  with minus = '1':  round_half_up(c*d - a*b, DROP)
-- Formats: y has DROP fraction bits less than the products; the sum fits the 48 bits of the adder.
-- Latency: 3; c and d are needed a clock after a, b and minus, because the second adder takes the first one's sum.
-- Interval: 1; no strobes, the pipeline never stops.  y has no register of its own: that of the adder is its user's.
-- Rounding: half up, by half an LSB of y in the first adder.  Overflow: saturation.
-- That adder only adds: -a*b = (not a)*b + b, so no carry chain precedes the multiplier.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;

entity sum_of_products is
  generic (
    DROP : positive
  );
  port (
    clk   : in  std_logic;
    a     : in  signed;
    b     : in  signed;
    minus : in  std_logic;
    c     : in  signed;
    d     : in  signed;
    y     : out signed
  );
end entity sum_of_products;

architecture rtl of sum_of_products is
  constant PROD_W : positive := maximum(a'length + b'length, c'length + d'length);
  constant SUM_W  : positive := PROD_W + 2;
  constant REST_W : positive := maximum(b'length, DROP) + 2;

  signal a_1       : signed(a'length - 1 downto 0);
  signal b_1       : signed(b'length - 1 downto 0);
  signal minus_1   : std_logic;
  signal prod_ab_1 : signed(a'length + b'length - 1 downto 0);
  signal prod_ab_2 : signed(a'length + b'length - 1 downto 0);
  signal rest_2    : signed(REST_W - 1 downto 0);
  signal c_2       : signed(c'length - 1 downto 0);
  signal d_2       : signed(d'length - 1 downto 0);
  signal sum_ab_3  : signed(SUM_W - 1 downto 0);
  signal prod_cd_2 : signed(c'length + d'length - 1 downto 0);
  signal prod_cd_3 : signed(c'length + d'length - 1 downto 0);
  signal sum_3     : signed(SUM_W - 1 downto 0);
begin
  assert SUM_W <= 48
    report "sum_of_products: the sum has " & integer'image(SUM_W) & " bits, a DSP48 has 48"
    severity failure;

  process (clk)
  begin
    if rising_edge(clk) then
      -- Stage 1: a, b
      a_1     <= a xor minus;
      b_1     <= b;
      minus_1 <= minus;

      -- Stage 2: prod_ab = a*b;  rest: half an LSB of y, and b where a is complemented;  c, d
      prod_ab_2 <= prod_ab_1;
      rest_2    <= half(DROP, REST_W);
      if minus_1 = '1' then
        rest_2 <= resize(b_1, REST_W) + half(DROP, REST_W);
      end if;
      c_2 <= c;
      d_2 <= d;

      -- Stage 3: sum_ab = +-a*b and half an LSB of y;  prod_cd = c*d
      sum_ab_3  <= resize(prod_ab_2, SUM_W) + rest_2;
      prod_cd_3 <= prod_cd_2;
    end if;
  end process;

  -- Outside the process a simulator multiplies only when an operand has changed, not at every clock.
  prod_ab_1 <= a_1 * b_1;
  prod_cd_2 <= c_2 * d_2;

  sum_3 <= sum_ab_3 + prod_cd_3;
  y     <= saturate(sum_3(SUM_W - 1 downto DROP), y'length);

end architecture rtl;
