-- Purpose: rotates a flux linkage by the angle whose sine and cosine are given, with two multipliers in two clocks.
--   out_x = x*cos_theta - y*sin_theta
--   out_y = x*sin_theta + y*cos_theta
-- Formats: x, y FLUX; TRIG S(1,16) within +-1; products and sums exact.
-- Like rotate, but 25 bits wide: operands have two registers; if a multiplier takes only 18 bits, synthesis can move
-- the second one behind the partial products.  No enables: the inputs are constant during the interval.
-- Latency: 6.  Interval: 3.  Rounding: half up.  Saturation: a sum is at most 4 per unit, so its three top bits show
-- whether it fits; out_y reaches its register through out_x, which halves the fan-out of the limiter.

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
  signal factor_s_1 : signed(FLUX_W - 1 downto 0);  -- x at clock 1, not y at clock 2
  signal factor_s_2 : signed(FLUX_W - 1 downto 0);
  signal factor_c_2 : signed(FLUX_W - 1 downto 0);  -- y at clock 2, x at clock 3
  signal factor_c_3 : signed(FLUX_W - 1 downto 0);
  signal prod_s_2   : signed(PROD_W - 1 downto 0);
  signal prod_s_3   : signed(PROD_W - 1 downto 0);  -- x*sin_theta at clock 3, (not y)*sin_theta at clock 4
  signal rest_2     : signed(TRIG_W - 1 downto 0);
  signal rest_3     : signed(TRIG_W - 1 downto 0);
  signal sum_s_3    : signed(PROD_W - 1 downto 0);
  signal sum_s_4    : signed(PROD_W - 1 downto 0);  -- x*sin_theta at clock 4, -y*sin_theta at clock 5
  signal prod_c_3   : signed(PROD_W - 1 downto 0);
  signal prod_c_4   : signed(PROD_W - 1 downto 0);  -- y*cos_theta at clock 4, x*cos_theta at clock 5
  signal sum_4      : signed(PROD_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- Outside the clocked process, so that a simulator computes them only when an operand changes.
  prod_s_2 <= factor_s_2 * sin_2;
  sum_s_3  <= prod_s_3 + rest_3;
  prod_c_3 <= factor_c_3 * cos_3;
  sum_4    <= prod_c_4 + sum_s_4;

  -- Half an LSB for the rounding, in the second clock plus sin_theta
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

      -- Stages 1, 2: x, then not y.  -y*sin_theta = (not y)*sin_theta + sin_theta, so no carry chain precedes the
      -- multiplier
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

      -- Stages 3, 4: prod_s = x*sin_theta, then (not y)*sin_theta;  rest: half an LSB, then half an LSB + sin_theta
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
