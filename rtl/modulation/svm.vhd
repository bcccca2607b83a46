-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: symmetrical space-vector modulation, stator voltage to three duties, without a divider.
--   x = u_alpha/u_dc,  y = sqrt(3)/2*u_beta/u_dc,  by inverse and inverse_beta of u_dc_processing
--   legs a = x, b = -x/2 + y, c = -x/2 - y;  duty = 1/2 + leg + mid(a,b,c)/2
-- Formats: products 33 fraction bits; x, y S(1,17); legs S(3,18), exact; duty U(1,16), 0 to 1.  With OVERMODULATION = 1
-- x, y S(3,17) and legs S(5,18).
-- Latency: 5.  Interval: 1.
-- Rounding: half up.  x and y need no limiter: voltage_limit allows less than one bus voltage, because k_u_max is
-- below 1, times the gain of overmodulation less than eight.  The duties are limited to 0 and 1: beyond the hexagon the
-- voltage is its nearest point.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity svm is
  generic (
    OVERMODULATION : natural range 0 to 1 := 0  -- 1: voltages beyond the hexagon, up to eight bus voltages
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    u_alpha      : in  signed(PU_W - 1 downto 0);
    u_beta       : in  signed(PU_W - 1 downto 0);
    inverse      : in  unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
    inverse_beta : in  unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
    out_valid    : out std_logic;
    duty_a       : out unsigned(DUTY_W - 1 downto 0);
    duty_b       : out unsigned(DUTY_W - 1 downto 0);
    duty_c       : out unsigned(DUTY_W - 1 downto 0)
  );
end entity svm;

architecture rtl of svm is
  constant LATENCY   : positive := SVM_LATENCY;
  constant SCALED_W  : positive := SVM_SCALED_W + 2 * OVERMODULATION;
  constant LEG_W     : positive := SCALED_W + 3;
  constant SUM_W     : positive := LEG_W + 2;
  constant INVERSE_W : positive := U_DC_PROCESSING_INVERSE_W;

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid           : std_logic_vector(0 to LATENCY);
  signal by_inverse      : signed(INVERSE_W downto 0);
  signal by_inverse_beta : signed(INVERSE_W downto 0);
  signal x_3             : signed(SCALED_W - 1 downto 0);
  signal y_3             : signed(SCALED_W - 1 downto 0);
  signal twice_x         : signed(LEG_W - 1 downto 0);
  signal triple_x        : signed(LEG_W - 1 downto 0);
  signal twice_y         : signed(LEG_W - 1 downto 0);
  signal leg_a_4         : signed(LEG_W - 1 downto 0);
  signal leg_b_4         : signed(LEG_W - 1 downto 0);
  signal leg_c_4         : signed(LEG_W - 1 downto 0);
  signal a_ge_b_4        : boolean;
  signal a_ge_c_4        : boolean;
  signal b_ge_c_4        : boolean;
  signal mid             : signed(LEG_W - 1 downto 0);

  -- 1/2 + leg + mid/2, rounded and limited to 0..1
  function to_duty (leg : signed; mid : signed) return unsigned is
    constant HALF    : signed(SUM_W - 1 downto 0)             := to_signed(SVM_HALF, SUM_W);
    constant DUTY    : signed(SUM_W - SVM_DROP_DUTY downto 0) :=
                                                                 round_half_up(HALF + shift_left(resize(leg, SUM_W), 1) + mid, SVM_DROP_DUTY);
    constant HIGHEST : unsigned(DUTY_W - 1 downto 0)          := to_unsigned(DUTY_ONE, DUTY_W);
  begin
    if DUTY < 0 then
      return to_unsigned(0, DUTY_W);
    elsif DUTY > DUTY_ONE then
      return HIGHEST;
    end if;
    return unsigned(DUTY(DUTY_W - 1 downto 0));
  end function;
begin
  valid(0)        <= in_valid;
  by_inverse      <= signed('0' & inverse);
  by_inverse_beta <= signed('0' & inverse_beta);

  -- Stages 1 to 3: x = u_alpha*inverse;  y = u_beta*inverse_beta
  scaled_x : entity work.multiply_add
    generic map (DROP => SVM_DROP_SCALED)
    port map (clk => clk, a => by_inverse, b => u_alpha, c => NOTHING, y => x_3, limited => open);

  scaled_y : entity work.multiply_add
    generic map (DROP => SVM_DROP_SCALED)
    port map (clk => clk, a => by_inverse_beta, b => u_beta, c => NOTHING, y => y_3, limited => open);

  twice_x  <= shift_left(resize(x_3, LEG_W), 1);
  twice_y  <= shift_left(resize(y_3, LEG_W), 1);
  triple_x <= twice_x + x_3;

  mid <= leg_a_4 when a_ge_b_4 /= a_ge_c_4 else
         leg_b_4 when a_ge_b_4 = b_ge_c_4 else
         leg_c_4;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 4: the legs with one more fraction bit, and their order
      leg_a_4  <= twice_x;
      leg_b_4  <= twice_y - x_3;
      leg_c_4  <= -twice_y - x_3;
      a_ge_b_4 <= triple_x - twice_y >= 0;
      a_ge_c_4 <= triple_x + twice_y >= 0;
      b_ge_c_4 <= y_3 >= 0;

      -- Stage 5: duty = 1/2 + leg + mid/2
      if valid(4) = '1' then
        duty_a <= to_duty(leg_a_4, mid);
        duty_b <= to_duty(leg_b_4, mid);
        duty_c <= to_duty(leg_c_4, mid);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
