-- Purpose: rotates a vector by the angle whose sine and cosine are given, with two multipliers in two clocks.
--   out_x = x*cos_theta - y*sin_theta
--   out_y = x*sin_theta + y*cos_theta
-- Formats: x, y PU; TRIG S(1,16) within +-1; products and sums exact.
-- The multiplier for sin_theta works a clock ahead of the one for cos_theta, whose adder forms the sum.  y is needed
-- a clock after x, out_y is valid a clock before out_x, with out_soon.  Each instance registers its sine and cosine.
-- Latency: 5.  Interval: 4.  Rounding: half up.  No saturation: the components of currents and voltages are within
-- 1.375 per unit, so the vector is shorter than 2 at every angle.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity rotate is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    x         : in  signed(PU_W - 1 downto 0);
    y         : in  signed(PU_W - 1 downto 0);
    cos_theta : in  signed(TRIG_W - 1 downto 0);
    sin_theta : in  signed(TRIG_W - 1 downto 0);
    out_soon  : out std_logic;
    out_valid : out std_logic;
    out_x     : out signed(PU_W - 1 downto 0);
    out_y     : out signed(PU_W - 1 downto 0)
  );
end entity rotate;

architecture rtl of rotate is
  constant LATENCY : positive := ROTATE_LATENCY;
  constant PROD_W  : positive := PU_W + TRIG_W;

  signal valid      : std_logic_vector(0 to LATENCY);
  signal cos_1      : signed(TRIG_W - 1 downto 0);
  signal sin_1      : signed(TRIG_W - 1 downto 0);
  signal factor_s_0 : signed(PU_W - 1 downto 0);
  signal factor_s   : signed(PU_W - 1 downto 0);    -- x at clock 1, not y at clock 2
  signal factor_c_1 : signed(PU_W - 1 downto 0);
  signal factor_c   : signed(PU_W - 1 downto 0);    -- y at clock 2, x at clock 3
  signal prod_s     : signed(PROD_W - 1 downto 0);  -- x*sin_theta at clock 2, (not y)*sin_theta at clock 3
  signal rest       : signed(TRIG_W - 1 downto 0);
  signal sum_s      : signed(PROD_W - 1 downto 0);  -- x*sin_theta at clock 3, -y*sin_theta at clock 4
  signal prod_c     : signed(PROD_W - 1 downto 0);  -- y*cos_theta at clock 3, x*cos_theta at clock 4
  signal sum        : signed(PROD_W - 1 downto 0);
  signal out_3      : signed(PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- -y*sin_theta = (not y)*sin_theta + sin_theta, so no carry chain precedes the multiplier
  factor_s_0 <= not y when valid(1) = '1' else x;
  factor_c_1 <= x when valid(2) = '1' else y;

  sum   <= prod_c + sum_s;
  out_3 <= sum(PU_W - 1 + ROTATE_DROP downto ROTATE_DROP);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the angle.  Stages 1, 2: x, then not y;  stages 2, 3: y, then x
      if valid(0) = '1' then
        cos_1 <= cos_theta;
        sin_1 <= sin_theta;
      end if;
      if valid(0) = '1' or valid(1) = '1' then
        factor_s <= factor_s_0;
      end if;
      if valid(1) = '1' or valid(2) = '1' then
        factor_c <= factor_c_1;
      end if;

      -- Stages 2, 3: prod_s = x*sin_theta, then (not y)*sin_theta;  rest: half an LSB, then half an LSB + sin_theta
      if valid(1) = '1' or valid(2) = '1' then
        prod_s <= factor_s * sin_1;
        rest   <= half(ROTATE_DROP, TRIG_W);
        if valid(2) = '1' then
          rest <= sin_1 + half(ROTATE_DROP, TRIG_W);
        end if;
      end if;

      -- Stages 3, 4: sum_s = x*sin_theta, then -y*sin_theta;  prod_c = y*cos_theta, then x*cos_theta
      if valid(2) = '1' or valid(3) = '1' then
        sum_s  <= prod_s + rest;
        prod_c <= factor_c * cos_1;
      end if;

      -- Stages 4, 5: out_y = x*sin_theta + y*cos_theta, then out_x = x*cos_theta - y*sin_theta, narrowed
      if valid(3) = '1' then
        out_y <= out_3;
      end if;
      if valid(4) = '1' then
        out_x <= out_3;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - 1);
  out_valid <= valid(LATENCY);

end architecture rtl;
