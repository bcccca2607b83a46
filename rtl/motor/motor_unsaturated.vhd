-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the fluxes in the rotor frame, the currents of a linear machine, and the place of these in the map.
--   lambda_d = lambda_alpha*cos + lambda_beta*sin;  lambda_q = lambda_beta*cos - lambda_alpha*sin
--   x_d = (lambda_d - psi_m - wave_d)*inv_l_d;  x_q = (lambda_q - wave_q)*inv_l_q;  row + f_d = 32*x_d + 31.5
--   turn_d = lambda_d + slope_q;  turn_q = lambda_q - slope_d
-- One pipeline for both axes, d a clock before q.
-- Formats: fluxes FLUX, trigonometry S(0,17), wave S(-2,19), slope PU, inv_l U(9,16), x S(1,22), f U(0,17).
-- Latency: 10; all outputs change together.  Interval: 10.
-- Rounding: rotation and x half up.  Sums saturate; the place is limited to the map.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_unsaturated is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    lambda_alpha : in  signed(FLUX_W - 1 downto 0);
    lambda_beta  : in  signed(FLUX_W - 1 downto 0);
    cos_theta    : in  signed(MOTOR_TRIG_W - 1 downto 0);
    sin_theta    : in  signed(MOTOR_TRIG_W - 1 downto 0);
    wave_d       : in  signed(MOTOR_WAVE_W - 1 downto 0);
    wave_q       : in  signed(MOTOR_WAVE_W - 1 downto 0);
    slope_d      : in  signed(PU_W - 1 downto 0);
    slope_q      : in  signed(PU_W - 1 downto 0);
    psi_m        : in  signed(FLUX_W - 1 downto 0);
    inv_l_d      : in  unsigned(24 downto 0);
    inv_l_q      : in  unsigned(24 downto 0);
    out_valid    : out std_logic;
    x_d          : out signed(23 downto 0);
    x_q          : out signed(23 downto 0);
    row          : out unsigned(5 downto 0);
    column       : out unsigned(5 downto 0);
    f_d          : out unsigned(MOTOR_UNSATURATED_F_BITS - 1 downto 0);
    f_q          : out unsigned(MOTOR_UNSATURATED_F_BITS - 1 downto 0);
    turn_d       : out signed(FLUX_W - 1 downto 0);
    turn_q       : out signed(FLUX_W - 1 downto 0);
    cos_held     : out signed(MOTOR_TRIG_W - 1 downto 0);
    sin_held     : out signed(MOTOR_TRIG_W - 1 downto 0)
  );
end entity motor_unsaturated;

architecture rtl of motor_unsaturated is
  constant LATENCY : positive := MOTOR_UNSATURATED_LATENCY;
  constant X_W     : positive := 24;
  constant LOW     : positive := MOTOR_UNSATURATED_LOW_BITS;
  constant F_BITS  : positive := MOTOR_UNSATURATED_F_BITS;
  constant PLACE_W : positive := F_BITS + 6;
  constant WIDE_W  : positive := FLUX_W + 2;  -- a flux and two more terms

  signal valid    : std_logic_vector(0 to LATENCY);
  signal a_0      : signed(FLUX_W - 1 downto 0);
  signal c_1      : signed(FLUX_W - 1 downto 0);
  signal lambda_3 : signed(FLUX_W - 1 downto 0);
  signal lambda_4 : signed(FLUX_W - 1 downto 0);
  signal less_4   : signed(WIDE_W - 1 downto 0);
  signal more_4   : signed(WIDE_W - 1 downto 0);
  signal flux_5   : signed(FLUX_W - 1 downto 0);
  signal turn_5   : signed(FLUX_W - 1 downto 0);
  signal turn_d_6 : signed(FLUX_W - 1 downto 0);
  signal turn_q_7 : signed(FLUX_W - 1 downto 0);
  signal high_5   : signed(17 downto 0);
  signal low_5    : signed(LOW downto 0);
  signal by_hi_6  : signed(FLUX_W + 17 downto 0);
  signal by_lo_6  : signed(FLUX_W + LOW downto 0);
  signal sum_7    : signed(FLUX_W + 18 + LOW downto 0);
  signal x_8      : signed(X_W - 1 downto 0);
  signal place_8  : unsigned(PLACE_W - 1 downto 0);
  signal x_9      : signed(X_W - 1 downto 0);
  signal place_9  : unsigned(PLACE_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The axis that enters: d, then q; the factor of the cosine a clock after that of the sine
  a_0 <= lambda_alpha when valid(1) = '1' else lambda_beta;
  c_1 <= lambda_beta when valid(2) = '1' else lambda_alpha;

  -- Stages 1 to 3: lambda_d, then lambda_q
  rotation : entity work.sum_of_products
    generic map (DROP => MOTOR_UNSATURATED_DROP)
    port map (clk => clk, a => a_0, b => sin_theta, minus => valid(1), c => c_1, d => cos_theta, y => lambda_3);

  -- The place in the map of the axis that is there
  place_8 <= resize(unsigned(clamp(resize(x_8, X_W + 1) + MOTOR_UNSATURATED_CENTRE, to_signed(0, X_W + 1),
                                   to_signed(MOTOR_UNSATURATED_LAST, X_W + 1))), PLACE_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 4: the flux, and what it is compared with: magnets and harmonics; slope of the harmonics
      lambda_4 <= lambda_3;
      less_4   <= shift_left(resize(wave_q, WIDE_W), MOTOR_UNSATURATED_WAVE_SHIFT);
      more_4   <= -shift_left(resize(slope_d, WIDE_W), MOTOR_UNSATURATED_SLOPE_SHIFT);
      if valid(3) = '1' then
        less_4 <= shift_left(resize(wave_d, WIDE_W), MOTOR_UNSATURATED_WAVE_SHIFT) + psi_m;
        more_4 <= shift_left(resize(slope_q, WIDE_W), MOTOR_UNSATURATED_SLOPE_SHIFT);
      end if;

      -- Stage 5: flux of the current alone;  turn;  1/L of the axis
      flux_5 <= saturate(lambda_4 - less_4, FLUX_W);
      turn_5 <= saturate(lambda_4 + more_4, FLUX_W);
      high_5 <= signed('0' & inv_l_q(24 downto LOW));
      low_5  <= signed('0' & inv_l_q(LOW - 1 downto 0));
      if valid(4) = '1' then
        high_5 <= signed('0' & inv_l_d(24 downto LOW));
        low_5  <= signed('0' & inv_l_d(LOW - 1 downto 0));
      end if;

      -- Stage 6: both parts of flux*inv_l
      by_hi_6 <= flux_5 * high_5;
      by_lo_6 <= flux_5 * low_5;
      if valid(5) = '1' then
        turn_d_6 <= turn_5;
      end if;

      -- Stage 7: their sum, and the half that rounds it
      sum_7 <= shift_left(resize(by_hi_6, sum_7'length), LOW)
               + (resize(by_lo_6, FLUX_W + LOW + 2) + half(MOTOR_UNSATURATED_DROP_X, FLUX_W + LOW + 2));
      if valid(6) = '1' then
        turn_q_7 <= turn_5;
      end if;

      -- Stage 8: x
      x_8 <= saturate(shift_right(sum_7, MOTOR_UNSATURATED_DROP_X), X_W);

      -- Stage 9: d waits for q
      x_9     <= x_8;
      place_9 <= place_8;

      -- Stage 10
      if valid(9) = '1' then
        x_d      <= x_9;
        x_q      <= x_8;
        row      <= place_9(PLACE_W - 1 downto F_BITS);
        column   <= place_8(PLACE_W - 1 downto F_BITS);
        f_d      <= place_9(F_BITS - 1 downto 0);
        f_q      <= place_8(F_BITS - 1 downto 0);
        turn_d   <= turn_d_6;
        turn_q   <= turn_q_7;
        cos_held <= cos_theta;
        sin_held <= sin_theta;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
