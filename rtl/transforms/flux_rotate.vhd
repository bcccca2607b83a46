-- Purpose: turns a flux linkage by the angle whose sine and cosine are given, two multipliers in two clocks.
--   out_x = x*cos_theta - y*sin_theta
--   out_y = x*sin_theta + y*cos_theta
-- Formats: x, y FLUX; TRIG S(1,16) within +-1; products and sums exact.
-- As rotate, but 25 bits wide: operands have two registers, of which the second may be moved behind the partial
-- products where a multiplier takes only 18 bits.  No enables: inputs stay for the interval.
-- Latency: 6.  Interval: 3.  Rounding: half up.  Saturation: a sum is at most 4 per unit, so its three top bits say
-- whether it fits; out_y comes over out_x, half as many readers of the limit.

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

  signal valid      : std_logic_vector(0 to LATENCY);
  signal sin_1      : signed(TRIG_W - 1 downto 0);
  signal sin_2      : signed(TRIG_W - 1 downto 0);
  signal cos_2      : signed(TRIG_W - 1 downto 0);
  signal cos_3      : signed(TRIG_W - 1 downto 0);
  signal factor_s_1 : signed(FLUX_W - 1 downto 0);  -- at clock 1 x, at clock 2 not y
  signal factor_s_2 : signed(FLUX_W - 1 downto 0);
  signal factor_c_2 : signed(FLUX_W - 1 downto 0);  -- at clock 2 y, at clock 3 x
  signal factor_c_3 : signed(FLUX_W - 1 downto 0);
  signal prod_s_2   : signed(PROD_W - 1 downto 0);
  signal prod_s_3   : signed(PROD_W - 1 downto 0);  -- at clock 3 of x, at clock 4 of not y
  signal rest_2     : signed(TRIG_W - 1 downto 0);
  signal rest_3     : signed(TRIG_W - 1 downto 0);
  signal sum_s_3    : signed(PROD_W - 1 downto 0);
  signal sum_s_4    : signed(PROD_W - 1 downto 0);  -- at clock 4 x*sin_theta, at clock 5 -y*sin_theta
  signal prod_c_3   : signed(PROD_W - 1 downto 0);
  signal prod_c_4   : signed(PROD_W - 1 downto 0);  -- at clock 4 of y, at clock 5 of x
  signal sum_4      : signed(PROD_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- Outside the clocked process, so that a simulator computes them only when an operand changes.
  prod_s_2 <= factor_s_2 * sin_2;
  sum_s_3  <= prod_s_3 + rest_3;
  prod_c_3 <= factor_c_3 * cos_3;
  sum_4    <= prod_c_4 + sum_s_4;

  -- Half an LSB to round with, then sin_theta too
  process (all)
  begin
    rest_2 <= half(FLUX_ROTATE_DROP, TRIG_W);
    if valid(3) = '1' then
      rest_2 <= sin_2 + half(FLUX_ROTATE_DROP, TRIG_W);
    end if;
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: x, then not y;  -y*sin_theta is made of not y, which is -y - 1, and the missing sin_theta: no
      -- carry before the multiplier
      sin_1      <= sin_theta;
      factor_s_1 <= x;
      if valid(1) = '1' then
        factor_s_1 <= not y;
      end if;

      -- Stages 2, 3: y, then x
      sin_2      <= sin_1;
      factor_s_2 <= factor_s_1;
      cos_2      <= cos_theta;
      factor_c_2 <= x;
      if valid(1) = '1' then
        factor_c_2 <= y;
      end if;

      -- Stages 3, 4: prod_s = x*sin_theta, then (not y)*sin_theta;  rest: half an LSB to round with, then sin_theta too
      cos_3      <= cos_2;
      factor_c_3 <= factor_c_2;
      prod_s_3   <= prod_s_2;
      rest_3     <= rest_2;

      -- Stages 4, 5: sum_s = x*sin_theta, then -y*sin_theta;  prod_c = y*cos_theta, then x*cos_theta
      sum_s_4  <= sum_s_3;
      prod_c_4 <= prod_c_3;

      -- Stages 5, 6: out_y = x*sin_theta + y*cos_theta, then out_x = x*cos_theta - y*sin_theta, narrowed
      if valid(4) = '1' or valid(5) = '1' then
        out_x <= saturate(sum_4(PROD_W - 1 downto FLUX_ROTATE_DROP), FLUX_W);
        out_y <= out_x;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
