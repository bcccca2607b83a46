-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: rotates a vector by the angle whose sine and cosine are given.
--   out_x = x*cos_theta - y*sin_theta
--   out_y = y*cos_theta + x*sin_theta
-- One pipeline of two multipliers for both components: out_y, then out_x a clock later.
-- Formats: x, y PU; TRIG S(1,16) within +-1; products and sums exact.
-- Latency: 5 (y is needed a clock after x, out_y is valid with out_soon).  Interval: 4.
-- Rounding: half up.  No saturation: the components of currents and voltages are within 1.375 per unit, so the vector
-- is shorter than 2 at every angle.

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
  constant LATENCY  : positive := ROTATE_LATENCY;
  constant RESULT_W : positive := PU_W + TRIG_W + 2 - ROTATE_DROP;  -- the whole sum: nothing to saturate

  signal valid    : std_logic_vector(0 to LATENCY);
  signal by_sin_0 : signed(PU_W - 1 downto 0);
  signal by_cos_1 : signed(PU_W - 1 downto 0);
  signal result_3 : signed(RESULT_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The component that enters: out_y, then out_x; the factor of the cosine a clock after that of the sine
  by_sin_0 <= y when valid(1) = '1' else x;
  by_cos_1 <= x when valid(2) = '1' else y;

  -- Stages 1 to 3: out_y = y*cos_theta + x*sin_theta, then out_x = x*cos_theta - y*sin_theta
  rotation : entity work.sum_of_products
    generic map (DROP => ROTATE_DROP)
    port map (clk => clk, a => by_sin_0, b => sin_theta, minus => valid(1), c => by_cos_1, d => cos_theta, y => result_3);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 4, 5: out_y, then out_x
      if valid(3) = '1' then
        out_y <= resize(result_3, PU_W);
      end if;
      if valid(4) = '1' then
        out_x <= resize(result_3, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - 1);
  out_valid <= valid(LATENCY);

end architecture rtl;
