-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: sine and cosine of two angles, one after the other, from an interpolated quarter-wave table.
--   theta = quadrant + (address + 1/2)/4096 + delta;  sin = S + delta*C,  cos = C - delta*S
-- Formats: table U(0,18), delta S(-10,22) radians, interpolated value 22 fraction bits, TRIG out.
-- Latency: 13.  The first angle is theta_me, whose outputs are valid with out_soon after 5 clocks.  theta_out is needed
-- 8 clocks after it, its outputs come with out_valid.
-- Interval: 9.
-- Rounding: product floored to 22 fraction bits, output half up; 1.0 is reached and fits, no saturation.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity sincos is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    theta_me  : in  unsigned(TURN_W - 1 downto 0);
    theta_out : in  unsigned(TURN_W - 1 downto 0);
    out_soon  : out std_logic;
    out_valid : out std_logic;
    cos_theta : out signed(TRIG_W - 1 downto 0);
    sin_theta : out signed(TRIG_W - 1 downto 0);
    cos_out   : out signed(TRIG_W - 1 downto 0);
    sin_out   : out signed(TRIG_W - 1 downto 0)
  );
end entity sincos;

architecture rtl of sincos is
  constant LATENCY    : positive := SINCOS_LATENCY;
  constant SECOND     : positive := SINCOS_SECOND;
  constant DELTA_BITS : positive := TURN_W - 2 - SINCOS_ADDRESS_BITS;
  constant FINE_W     : positive := 24;  -- S(1,22)
  constant SUM_W      : positive := FINE_W + SINCOS_DROP_PROD;

  signal valid      : std_logic_vector(0 to LATENCY);
  signal theta_0    : unsigned(TURN_W - 1 downto 0);
  signal address_0  : unsigned(SINCOS_ADDRESS_BITS - 1 downto 0);
  signal quadrant_1 : unsigned(1 downto 0);
  signal quadrant_2 : unsigned(1 downto 0);
  signal quadrant_3 : unsigned(1 downto 0);
  signal quadrant_4 : unsigned(1 downto 0);
  signal low_0      : unsigned(DELTA_BITS - 1 downto 0);
  signal s_1        : unsigned(17 downto 0);
  signal c_1        : unsigned(17 downto 0);
  signal delta_1    : signed(12 downto 0);
  signal delta_2    : signed(12 downto 0);
  signal s_2        : unsigned(17 downto 0);
  signal c_2        : unsigned(17 downto 0);
  signal prod_s_3   : signed(31 downto 0);
  signal prod_c_3   : signed(31 downto 0);
  signal s_3        : unsigned(17 downto 0);
  signal c_3        : unsigned(17 downto 0);
  signal sum_s_4    : signed(SUM_W - 1 downto 0);
  signal fine_s_4   : signed(FINE_W - 1 downto 0);
  signal fine_c_4   : signed(FINE_W - 1 downto 0);
  signal size_s_4   : signed(FINE_W - 1 downto 0);
  signal size_c_4   : signed(FINE_W - 1 downto 0);
  signal minus_s_4  : std_logic;
  signal minus_c_4  : std_logic;
  signal sin_4      : signed(TRIG_W - 1 downto 0);
  signal cos_4      : signed(TRIG_W - 1 downto 0);

  -- A value of the table at the scale of the interpolated ones
  function scaled (x : unsigned) return signed is
  begin
    return signed(shift_left(resize(x, FINE_W), SINCOS_TABLE_SHIFT));
  end function;
begin
  valid(0) <= in_valid;

  -- The angle that enters
  theta_0   <= theta_out when valid(SECOND) = '1' else theta_me;
  address_0 <= theta_0(TURN_W - 3 downto DELTA_BITS);
  low_0     <= theta_0(DELTA_BITS - 1 downto 0);

  -- The cut of the sum floors the product, because the table's value has no bits below the cut
  fine_s_4 <= sum_s_4(SUM_W - 1 downto SINCOS_DROP_PROD);

  -- A quarter turn swaps sine and cosine and inverts the sign of the cosine, a half turn inverts both signs
  size_s_4  <= fine_c_4 when quadrant_4(0) = '1' else fine_s_4;
  size_c_4  <= fine_s_4 when quadrant_4(0) = '1' else fine_c_4;
  minus_s_4 <= quadrant_4(1);
  minus_c_4 <= quadrant_4(1) xor quadrant_4(0);
  sin_4     <= resize(turned_half_up(size_s_4, minus_s_4, SINCOS_DROP_OUT), TRIG_W);
  cos_4     <= resize(turned_half_up(size_c_4, minus_c_4, SINCOS_DROP_OUT), TRIG_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: s and c from both ends of the table;  delta in radians
      quadrant_1 <= theta_0(TURN_W - 1 downto TURN_W - 2);
      s_1        <= SINCOS_SINE(to_integer(address_0));
      c_1        <= SINCOS_SINE(to_integer(not address_0));
      delta_1    <= SINCOS_DELTA(to_integer(low_0));

      -- Stage 2: registers behind the tables, as a block RAM's output arrives late
      quadrant_2 <= quadrant_1;
      s_2        <= s_1;
      c_2        <= c_1;
      delta_2    <= delta_1;

      -- Stage 3: prod_s = delta*c;  prod_c = delta*s
      quadrant_3 <= quadrant_2;
      prod_s_3   <= delta_2 * signed('0' & c_2);
      prod_c_3   <= delta_2 * signed('0' & s_2);
      s_3        <= s_2;
      c_3        <= c_2;

      -- Stage 4: fine_s = s + prod_s;  fine_c = c - prod_c
      quadrant_4 <= quadrant_3;
      sum_s_4    <= shift_left(resize(scaled(s_3), SUM_W), SINCOS_DROP_PROD) + prod_s_3;
      fine_c_4   <= scaled(c_3) - resize(shift_right(prod_c_3, SINCOS_DROP_PROD), FINE_W);

      -- Stage 5: into the quadrant, narrowed;  stage 13 for the second angle
      if valid(4) = '1' then
        sin_theta <= sin_4;
        cos_theta <= cos_4;
      end if;
      if valid(LATENCY - 1) = '1' then
        sin_out <= sin_4;
        cos_out <= cos_4;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - SINCOS_SECOND);
  out_valid <= valid(LATENCY);

end architecture rtl;
