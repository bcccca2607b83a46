-- Purpose: turns a vector by the angle whose sine and cosine are given, two multipliers in two clocks.
--   out_x = x*cos_theta - y*sin_theta
--   out_y = x*sin_theta + y*cos_theta
-- Formats: x, y S(1,WIDTH-2), PU or FLUX; TRIG S(1,16) within +-1; products and sums exact.
-- Latency: 4.  Interval: 2.  Rounding: half up, saturated: a vector longer than 2 per unit is outside every base.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity rotate is
  generic (
    WIDTH : positive range 18 to 25 := 18
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    x         : in  signed(WIDTH - 1 downto 0);
    y         : in  signed(WIDTH - 1 downto 0);
    cos_theta : in  signed(TRIG_W - 1 downto 0);
    sin_theta : in  signed(TRIG_W - 1 downto 0);
    out_valid : out std_logic;
    out_x     : out signed(WIDTH - 1 downto 0);
    out_y     : out signed(WIDTH - 1 downto 0)
  );
end entity rotate;

architecture rtl of rotate is
  constant LATENCY : positive := ROTATE_LATENCY;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal factor_0 : signed(WIDTH - 1 downto 0);
  signal prod_c   : signed(WIDTH + TRIG_W - 1 downto 0);  -- by cos_theta: x at clock 1, y at clock 2
  signal prod_s   : signed(WIDTH + TRIG_W - 1 downto 0);  -- by sin_theta: x at clock 1, y at clock 2
  signal prod_c_2 : signed(WIDTH + TRIG_W - 1 downto 0);
  signal prod_s_2 : signed(WIDTH + TRIG_W - 1 downto 0);
  signal sum_x_3  : signed(WIDTH + TRIG_W downto 0);
  signal sum_y_3  : signed(WIDTH + TRIG_W downto 0);
begin
  valid(0) <= in_valid;
  factor_0 <= y when valid(1) = '1' else x;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod = x*cos_theta, x*sin_theta, a clock later y*cos_theta, y*sin_theta
      if valid(0) = '1' or valid(1) = '1' then
        prod_c <= factor_0 * cos_theta;
        prod_s <= factor_0 * sin_theta;
      end if;

      -- Stage 2: the products of x wait for those of y
      if valid(1) = '1' then
        prod_c_2 <= prod_c;
        prod_s_2 <= prod_s;
      end if;

      -- Stage 3: sum_x = x*cos_theta - y*sin_theta,  sum_y = x*sin_theta + y*cos_theta
      if valid(2) = '1' then
        sum_x_3 <= resize(prod_c_2, WIDTH + TRIG_W + 1) - resize(prod_s, WIDTH + TRIG_W + 1);
        sum_y_3 <= resize(prod_s_2, WIDTH + TRIG_W + 1) + resize(prod_c, WIDTH + TRIG_W + 1);
      end if;

      -- Stage 4: out = sum, narrowed
      if valid(3) = '1' then
        out_x <= round_sat(sum_x_3, ROTATE_DROP, WIDTH);
        out_y <= round_sat(sum_y_3, ROTATE_DROP, WIDTH);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
