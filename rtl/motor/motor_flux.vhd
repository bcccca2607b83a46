-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: integrates the flux linkages of the windings in the stator frame, d lambda/dt = u - R*i.
--   s_x = leg_x - r_x*i_x                     phases a, b, c one after the other through one multiplier
--   lambda_alpha += 2*s_a - s_b - s_c;  lambda_beta += sqrt(3)*(s_b - s_c);  start: (psi_start, 0)
-- Formats: leg S(6,22), r U(3,21), i PU; state S(1,38), whose LSB is that of a leg: alpha is exact; outputs FLUX.
-- Latency: 9.  Interval: 10.
-- Rounding: each product, s_b - s_c to 17 fraction bits half up; the outputs are cut.  Sums saturate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_flux is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    leg_a        : in  signed(MOTOR_LEG_W - 1 downto 0);
    leg_b        : in  signed(MOTOR_LEG_W - 1 downto 0);
    leg_c        : in  signed(MOTOR_LEG_W - 1 downto 0);
    i_a          : in  signed(PU_W - 1 downto 0);
    i_b          : in  signed(PU_W - 1 downto 0);
    i_c          : in  signed(PU_W - 1 downto 0);
    start        : in  std_logic;
    r_a          : in  unsigned(23 downto 0);
    r_b          : in  unsigned(23 downto 0);
    r_c          : in  unsigned(23 downto 0);
    psi_start    : in  signed(FLUX_W - 1 downto 0);
    out_valid    : out std_logic;
    lambda_alpha : out signed(FLUX_W - 1 downto 0);
    lambda_beta  : out signed(FLUX_W - 1 downto 0)
  );
end entity motor_flux;

architecture rtl of motor_flux is
  constant LATENCY : positive := MOTOR_FLUX_LATENCY;
  constant D_W     : positive := 25;
  constant SUM_W   : positive := MOTOR_LEG_W + 2;

  signal valid   : std_logic_vector(0 to LATENCY);
  signal r_0     : signed(24 downto 0);
  signal i_0     : signed(PU_W - 1 downto 0);
  signal leg_0   : signed(MOTOR_LEG_W - 1 downto 0);
  signal s_3     : signed(MOTOR_LEG_W - 1 downto 0);
  signal s_a_4   : signed(MOTOR_LEG_W - 1 downto 0);
  signal s_b_5   : signed(MOTOR_LEG_W - 1 downto 0);
  signal s_c_6   : signed(MOTOR_LEG_W - 1 downto 0);
  signal rest_6  : signed(SUM_W - 1 downto 0);
  signal move_7  : signed(SUM_W - 1 downto 0);
  signal d_7     : signed(D_W - 1 downto 0);
  signal move_8  : signed(SUM_W - 1 downto 0);
  signal prod_8  : signed(D_W + MOTOR_FLUX_SQRT3'length - 1 downto 0);
  signal alpha_9 : signed(MOTOR_FLUX_W - 1 downto 0);  -- state
  signal beta_9  : signed(MOTOR_FLUX_W - 1 downto 0);  -- state
begin
  valid(0) <= in_valid;

  -- The phase that enters: a, then b, then c
  r_0   <= signed('0' & r_b) when valid(1) = '1' else signed('0' & r_c) when valid(2) = '1' else signed('0' & r_a);
  i_0   <= i_b when valid(1) = '1' else i_c when valid(2) = '1' else i_a;
  leg_0 <= leg_b when valid(1) = '1' else leg_c when valid(2) = '1' else leg_a;

  -- Stages 1 to 3: s = leg - r*i
  terminals : entity work.multiply_add
    generic map (DROP => MOTOR_FLUX_DROP_RI, MINUS => 1)
    port map (clk => clk, a => r_0, b => i_0, c => leg_0, y => s_3, limited => open);

  process (clk)
    variable sum : signed(MOTOR_FLUX_W downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 4 to 6: the three phases;  rest = 2*s_a - s_b
      if valid(3) = '1' then
        s_a_4 <= s_3;
      end if;
      if valid(4) = '1' then
        s_b_5 <= s_3;
      end if;
      s_c_6  <= s_3;
      rest_6 <= shift_left(resize(s_a_4, SUM_W), 1) - s_b_5;

      -- Stage 7: move = 2*s_a - s_b - s_c;  d = s_b - s_c
      move_7 <= rest_6 - s_c_6;
      d_7    <= round_sat(difference(s_b_5, s_c_6), MOTOR_FLUX_DROP_D, D_W);

      -- Stage 8: prod = sqrt(3)*d
      move_8 <= move_7;
      prod_8 <= d_7 * MOTOR_FLUX_SQRT3;

      -- Stage 9: both sums, the only state
      if valid(8) = '1' then
        sum     := resize(alpha_9, MOTOR_FLUX_W + 1) + move_8;
        alpha_9 <= saturate(sum, MOTOR_FLUX_W);
        sum     := resize(beta_9, MOTOR_FLUX_W + 1) + round_half_up(prod_8, MOTOR_FLUX_DROP_BETA);
        beta_9  <= saturate(sum, MOTOR_FLUX_W);
        if start = '1' then
          alpha_9 <= shift_left(resize(psi_start, MOTOR_FLUX_W), MOTOR_FLUX_DROP_OUT);
          beta_9  <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        alpha_9             <= (others => '0');
        beta_9              <= (others => '0');
      end if;
    end if;
  end process;

  out_valid    <= valid(LATENCY);
  lambda_alpha <= alpha_9(MOTOR_FLUX_W - 1 downto MOTOR_FLUX_DROP_OUT);
  lambda_beta  <= beta_9(MOTOR_FLUX_W - 1 downto MOTOR_FLUX_DROP_OUT);

end architecture rtl;
