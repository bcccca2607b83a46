-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the arithmetic that most equations of the core consist of, in one DSP48 with all of its registers.
--   y = saturate(c + round_half_up(a*b, DROP)),  with MINUS = 1:  saturate(c - round_half_up(a*b, DROP))
--   limited: y is saturated
-- Formats: a*b has DROP fraction bits more than c and y; the sum fits the 48 bits of the adder.
-- Latency: 3 (operands, product, sum).  Interval: 1; no strobes, the pipeline never stops.
-- Rounding: half up, by half an LSB below c in the adder's operand.  Overflow: saturation, told by limited.
-- The adder behind the multiplier only adds, so a difference is the complement of (not c) + a*b.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;

entity multiply_add is
  generic (
    DROP  : natural;
    MINUS : natural range 0 to 1 := 0
  );
  port (
    clk     : in  std_logic;
    a       : in  signed;
    b       : in  signed;
    c       : in  signed;
    y       : out signed;
    limited : out std_logic
  );
end entity multiply_add;

architecture rtl of multiply_add is
  constant PROD_W : positive  := a'length + b'length;
  constant SUM_W  : positive  := maximum(c'length + DROP, PROD_W) + 1;
  constant FLIP   : std_logic := to_unsigned(MINUS, 1)(0);

  signal a_1    : signed(a'length - 1 downto 0);
  signal b_1    : signed(b'length - 1 downto 0);
  signal c_1    : signed(c'length - 1 downto 0);
  signal prod_1 : signed(PROD_W - 1 downto 0);
  signal prod_2 : signed(PROD_W - 1 downto 0);
  signal base_2 : signed(SUM_W - 1 downto 0);
  signal sum_2  : signed(SUM_W - 1 downto 0);
  signal sum_3  : signed(SUM_W - 1 downto 0);
  signal cut_3  : signed(SUM_W - 1 - DROP downto 0);

  -- c at the scale of the product, plus the half that turns the cut behind the adder into a rounding half up.
  function at_product (x : signed) return signed is
    variable result : signed(SUM_W - 1 downto 0) := shift_left(resize(x, SUM_W), DROP);
  begin
    if DROP > 0 then
      result(DROP - 1) := '1';
    end if;
    return result;
  end function;
begin
  assert SUM_W <= 48
    report "multiply_add: the sum has " & integer'image(SUM_W) & " bits, a DSP48 has 48"
    severity failure;

  process (clk)
  begin
    if rising_edge(clk) then
      -- Stage 1: the operands
      a_1 <= a;
      b_1 <= b;
      c_1 <= c xor FLIP;

      -- Stage 2: prod = a*b
      prod_2 <= prod_1;
      base_2 <= at_product(c_1);

      -- Stage 3: sum = c + prod
      sum_3 <= sum_2;
    end if;
  end process;

  -- Outside the process a simulator computes them only when an operand has changed, not at every clock.
  prod_1 <= a_1 * b_1;
  sum_2  <= base_2 + prod_2;

  cut_3   <= sum_3(SUM_W - 1 downto DROP) xor FLIP;
  y       <= saturate(cut_3, y'length);
  limited <= exceeds(cut_3, y'length);

end architecture rtl;
