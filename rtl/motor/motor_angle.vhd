-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: what follows from the rotor's angle: sine, cosine, harmonic fluxes, their slopes, cogging torque.
--   theta_e = quadrant + (address + 1/2)/4096 + delta;  sin = S + delta*C,  cos = C - delta*S
--   h = w_0 + (w_1 - w_0)*f;  slope = (w_1 - w_0)*1024/(2*pi): three tables, one interpolation after the other
-- Formats: angles U(0,25), sine and cosine S(0,17) by the table of sincos, delta S(-10,24); words S(-2,19), slopes PU.
-- Latency: 10; the words of the tables are needed 3 clocks after the angles.  Interval: 8.
-- Rounding: products of the sine floored to 22 fraction bits, all else half up; sine, cosine and slopes saturate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_angle is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    theta_e   : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    theta_m   : in  unsigned(MOTOR_ANGLE_W - 1 downto 0);
    wave_d_0  : in  signed(MOTOR_WAVE_W - 1 downto 0);
    wave_d_1  : in  signed(MOTOR_WAVE_W - 1 downto 0);
    wave_q_0  : in  signed(MOTOR_WAVE_W - 1 downto 0);
    wave_q_1  : in  signed(MOTOR_WAVE_W - 1 downto 0);
    cog_0     : in  signed(MOTOR_WAVE_W - 1 downto 0);
    cog_1     : in  signed(MOTOR_WAVE_W - 1 downto 0);
    out_valid : out std_logic;
    cos_theta : out signed(MOTOR_TRIG_W - 1 downto 0);
    sin_theta : out signed(MOTOR_TRIG_W - 1 downto 0);
    wave_d    : out signed(MOTOR_WAVE_W - 1 downto 0);
    wave_q    : out signed(MOTOR_WAVE_W - 1 downto 0);
    slope_d   : out signed(PU_W - 1 downto 0);
    slope_q   : out signed(PU_W - 1 downto 0);
    cogging   : out signed(MOTOR_WAVE_W - 1 downto 0)
  );
end entity motor_angle;

architecture rtl of motor_angle is
  constant LATENCY    : positive           := MOTOR_ANGLE_LATENCY;
  constant DELTA_BITS : positive           := MOTOR_ANGLE_DELTA_BITS;
  constant F_BITS     : positive           := MOTOR_ANGLE_F_BITS;
  constant LOW        : natural            := MOTOR_ANGLE_W - 2 - SINCOS_ADDRESS_BITS - DELTA_BITS;
  constant FINE_W     : positive           := 24;  -- S(1,22)
  constant SUM_W      : positive           := FINE_W + MOTOR_ANGLE_DROP_PROD;
  constant NOTHING    : signed(0 downto 0) := "0";

  signal valid      : std_logic_vector(0 to LATENCY);
  signal address_0  : unsigned(SINCOS_ADDRESS_BITS - 1 downto 0);
  signal low_0      : unsigned(DELTA_BITS - 1 downto 0);
  signal quadrant_0 : unsigned(1 downto 0);
  signal s_1        : unsigned(17 downto 0);
  signal c_1        : unsigned(17 downto 0);
  signal s_2        : unsigned(17 downto 0);
  signal c_2        : unsigned(17 downto 0);
  signal s_3        : unsigned(17 downto 0);
  signal c_3        : unsigned(17 downto 0);
  signal delta_1    : signed(14 downto 0);
  signal delta_2    : signed(14 downto 0);
  signal prod_s_3   : signed(33 downto 0);
  signal prod_c_3   : signed(33 downto 0);
  signal fine_s_4   : signed(FINE_W - 1 downto 0);
  signal fine_c_4   : signed(FINE_W - 1 downto 0);
  signal size_s_4   : signed(FINE_W - 1 downto 0);
  signal size_c_4   : signed(FINE_W - 1 downto 0);
  signal minus_s_4  : std_logic;
  signal minus_c_4  : std_logic;
  signal before_3   : signed(MOTOR_WAVE_W - 1 downto 0);
  signal after_3    : signed(MOTOR_WAVE_W - 1 downto 0);
  signal before_4   : signed(MOTOR_WAVE_W - 1 downto 0);
  signal rise_4     : signed(MOTOR_WAVE_W downto 0);
  signal f_4        : signed(F_BITS downto 0);
  signal value_7    : signed(MOTOR_WAVE_W - 1 downto 0);
  signal slope_7    : signed(PU_W - 1 downto 0);

  -- x plus a floored product, whose bits below the cut cannot reach x
  function plus_floored (x : unsigned; prod : signed) return signed is
    variable sum : signed(SUM_W - 1 downto 0);
  begin
    sum := shift_left(signed(resize(x, SUM_W)), SINCOS_TABLE_SHIFT + MOTOR_ANGLE_DROP_PROD) + prod;
    return sum(SUM_W - 1 downto MOTOR_ANGLE_DROP_PROD);
  end function;
begin
  valid(0)   <= in_valid;
  quadrant_0 <= theta_e(MOTOR_ANGLE_W - 1 downto MOTOR_ANGLE_W - 2);
  address_0  <= theta_e(MOTOR_ANGLE_W - 3 downto LOW + DELTA_BITS);
  low_0      <= theta_e(LOW + DELTA_BITS - 1 downto LOW);

  -- A quarter turn swaps sine and cosine and inverts the sign of the cosine, a half turn inverts both signs
  size_s_4  <= fine_c_4 when quadrant_0(0) = '1' else fine_s_4;
  size_c_4  <= fine_s_4 when quadrant_0(0) = '1' else fine_c_4;
  minus_s_4 <= quadrant_0(1);
  minus_c_4 <= quadrant_0(1) xor quadrant_0(0);

  -- The table that enters the interpolation: d, q, cogging
  before_3 <= wave_q_0 when valid(4) = '1' else cog_0 when valid(5) = '1' else wave_d_0;
  after_3  <= wave_q_1 when valid(4) = '1' else cog_1 when valid(5) = '1' else wave_d_1;

  -- Stages 5 to 7: h = before + rise*f;  slope = rise*1024/(2*pi)
  along : entity work.multiply_add
    generic map (DROP => F_BITS)
    port map (clk => clk, a => rise_4, b => f_4, c => before_4, y => value_7, limited => open);

  steep : entity work.multiply_add
    generic map (DROP => MOTOR_ANGLE_DROP_SLOPE)
    port map (clk => clk, a => rise_4, b => MOTOR_ANGLE_SLOPE, c => NOTHING, y => slope_7, limited => open);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: s and c from both ends of the table, delta in radians; a block RAM has an output register
      s_1     <= SINCOS_SINE(to_integer(address_0));
      c_1     <= SINCOS_SINE(to_integer(not address_0));
      delta_1 <= MOTOR_ANGLE_DELTA(to_integer(low_0));
      s_2     <= s_1;
      c_2     <= c_1;
      delta_2 <= delta_1;

      -- Stage 3: prod_s = delta*c;  prod_c = delta*s
      s_3      <= s_2;
      c_3      <= c_2;
      prod_s_3 <= delta_2 * signed('0' & c_2);
      prod_c_3 <= delta_2 * signed('0' & s_2);

      -- Stage 4: fine_s = s + prod_s;  fine_c = c - prod_c;  rise of the table that enters
      fine_s_4 <= plus_floored(s_3, prod_s_3);
      fine_c_4 <= signed(shift_left(resize(c_3, FINE_W), SINCOS_TABLE_SHIFT))
                  - shift_right(prod_c_3, MOTOR_ANGLE_DROP_PROD)(FINE_W - 1 downto 0);
      before_4 <= before_3;
      rise_4   <= resize(after_3, MOTOR_WAVE_W + 1) - before_3;
      f_4      <= signed('0' & theta_e(F_BITS - 1 downto 0));
      if valid(5) = '1' then
        f_4 <= signed('0' & theta_m(F_BITS - 1 downto 0));
      end if;

      -- Stage 5: into the quadrant, narrowed
      if valid(4) = '1' then
        sin_theta <= saturate(turned_half_up(size_s_4, minus_s_4, MOTOR_ANGLE_DROP_TRIG), MOTOR_TRIG_W);
        cos_theta <= saturate(turned_half_up(size_c_4, minus_c_4, MOTOR_ANGLE_DROP_TRIG), MOTOR_TRIG_W);
      end if;

      -- Stages 8 to 10: one table after the other
      if valid(7) = '1' then
        wave_d  <= value_7;
        slope_d <= slope_7;
      end if;
      if valid(8) = '1' then
        wave_q  <= value_7;
        slope_q <= slope_7;
      end if;
      if valid(9) = '1' then
        cogging <= value_7;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
