-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: rotates a flux linkage by the angle whose sine and cosine are given, with two multipliers in two clocks.
--   out_y = x*sin_theta + y*cos_theta
--   out_x = x*cos_theta - y*sin_theta
-- One pipeline for both components, x*first + y*second: out_y, then out_x a clock later.
-- Formats: x, y FLUX; TRIG S(1,16) within +-1; products and sums exact.
-- Latency: 6 (out_y, then out_x).  Interval: 3.  Rounding: half up.  The rounded sums saturate.
-- A product has two registers: where a multiplier takes only 18 bits, synthesis can move one behind partial products.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_rotate is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    x         : in  signed(FLUX_W - 1 downto 0);
    y         : in  signed(FLUX_W - 1 downto 0);
    cos_theta : in  signed(TRIG_W - 1 downto 0);
    sin_theta : in  signed(TRIG_W - 1 downto 0);
    out_valid : out std_logic;
    out_x     : out signed(FLUX_W - 1 downto 0);
    out_y     : out signed(FLUX_W - 1 downto 0)
  );
end entity flux_rotate;

architecture rtl of flux_rotate is
  constant LATENCY : positive := FLUX_ROTATE_LATENCY;
  constant PROD_W  : positive := FLUX_W + TRIG_W;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal x_1      : signed(FLUX_W - 1 downto 0);
  signal first_1  : signed(TRIG_W - 1 downto 0);
  signal times_x  : signed(PROD_W - 1 downto 0);
  signal prod_x_2 : signed(PROD_W - 1 downto 0);
  signal prod_x_3 : signed(PROD_W - 1 downto 0);
  signal y_1      : signed(FLUX_W - 1 downto 0);
  signal second_1 : signed(TRIG_W - 1 downto 0);
  signal y_2      : signed(FLUX_W - 1 downto 0);
  signal second_2 : signed(TRIG_W - 1 downto 0);
  signal times_y  : signed(PROD_W - 1 downto 0);
  signal prod_y_3 : signed(PROD_W - 1 downto 0);
  signal sum_4    : signed(PROD_W - 1 downto 0);
  signal out_4    : signed(FLUX_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- Outside the clocked process, so that a simulator computes them only when an operand changes.
  times_x <= x_1 * first_1;
  times_y <= y_2 * second_2;
  out_4   <= round_sat(sum_4, FLUX_ROTATE_DROP, FLUX_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: first = sin_theta, second = cos_theta for out_y, then cos_theta and -sin_theta for out_x
      x_1      <= x;
      y_1      <= y;
      first_1  <= cos_theta when valid(1) = '1' else sin_theta;
      second_1 <= -sin_theta when valid(1) = '1' else cos_theta;

      -- Stages 2, 3: prod_x = x*first;  prod_y = y*second, a clock later for the adder behind its multiplier
      prod_x_2 <= times_x;
      prod_x_3 <= prod_x_2;
      y_2      <= y_1;
      second_2 <= second_1;
      prod_y_3 <= times_y;

      -- Stage 4: sum = x*first + y*second; |sum| < 2*2.83, so it fits
      sum_4 <= prod_x_3 + prod_y_3;

      -- Stages 5, 6: the components, narrowed
      if valid(4) = '1' then
        out_y <= out_4;
      end if;
      if valid(5) = '1' then
        out_x <= out_4;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
