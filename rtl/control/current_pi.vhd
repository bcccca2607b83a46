-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: current regulators of both axes.
--   err = i_ref - i;  u_pi = kp*err + int
--   int += ki*err unless the voltage was at its limit and err pushes further
-- sat_d, sat_q (-1, 0, +1): the limits that were active in the previous sample.  run = 0: all zero.
-- follows = 1: int = u_rest, what the voltage of the last sample leaves;  by_voltage = 1: the voltage is the host's, no
-- proportional part.
-- One pipeline for both axes: d, then q a clock later.
-- Formats: err PU, proportional part 28 fraction bits, integral S(1,28), output PU.
-- Latency: 6 (d, then q: i_q and i_q_ref are needed a clock after i_d, u_pi_d is valid with out_soon).
-- Interval: 5.
-- Rounding: half up.  err, integral and output saturate, the last two at 2 per unit, twice the limiter's voltage.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity current_pi is
  port (
    clk        : in  std_logic;
    rst        : in  std_logic;
    in_valid   : in  std_logic;
    i_d        : in  signed(PU_W - 1 downto 0);
    i_q        : in  signed(PU_W - 1 downto 0);
    i_d_ref    : in  signed(PU_W - 1 downto 0);
    i_q_ref    : in  signed(PU_W - 1 downto 0);
    sat_d      : in  signed(1 downto 0);
    sat_q      : in  signed(1 downto 0);
    u_rest_d   : in  signed(PU_W - 1 downto 0);
    u_rest_q   : in  signed(PU_W - 1 downto 0);
    follows    : in  std_logic;
    by_voltage : in  std_logic;
    run        : in  std_logic;
    kp_d       : in  unsigned(KP_W - 1 downto 0);
    ki_d       : in  unsigned(KI_W - 1 downto 0);
    kp_q       : in  unsigned(KP_W - 1 downto 0);
    ki_q       : in  unsigned(KI_W - 1 downto 0);
    out_soon   : out std_logic;
    out_valid  : out std_logic;
    u_pi_d     : out signed(PU_W - 1 downto 0);
    u_pi_q     : out signed(PU_W - 1 downto 0);
    u_int_d    : out signed(INTEGRAL_W - 1 downto 0);
    u_int_q    : out signed(INTEGRAL_W - 1 downto 0)
  );
end entity current_pi;

architecture rtl of current_pi is
  constant LATENCY : positive := CURRENT_PI_LATENCY;
  constant PROP_W  : positive := CURRENT_PI_PROPORTIONAL_W;

  constant NOTHING : signed(0 downto 0) := "0";

  type state_t is record
    integral_d : signed(INTEGRAL_W - 1 downto 0);
    integral_q : signed(INTEGRAL_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid          : std_logic_vector(0 to LATENCY);
  signal i_0            : signed(PU_W - 1 downto 0);
  signal i_ref_0        : signed(PU_W - 1 downto 0);
  signal err_0          : signed(PU_W - 1 downto 0);
  signal sat_0          : signed(1 downto 0);
  signal kp_0           : signed(KP_W downto 0);
  signal ki_0           : signed(KI_W downto 0);
  signal integral_0     : signed(INTEGRAL_W - 1 downto 0);
  signal held_1         : std_logic;
  signal held_2         : std_logic;
  signal held_3         : std_logic;
  signal u_rest_3       : signed(PU_W - 1 downto 0);
  signal proportional_3 : signed(PROP_W - 1 downto 0);
  signal moved_3        : signed(INTEGRAL_W - 1 downto 0);
  signal proportional_4 : signed(PROP_W - 1 downto 0);
  signal integral_4     : signed(INTEGRAL_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The axis that enters, and its error
  i_0        <= i_q when valid(1) = '1' else i_d;
  i_ref_0    <= i_q_ref when valid(1) = '1' else i_d_ref;
  sat_0      <= sat_q when valid(1) = '1' else sat_d;
  kp_0       <= signed('0' & kp_q) when valid(1) = '1' else signed('0' & kp_d);
  ki_0       <= signed('0' & ki_q) when valid(1) = '1' else signed('0' & ki_d);
  integral_0 <= state.integral_q when valid(1) = '1' else state.integral_d;
  err_0      <= saturate(resize(i_ref_0, PU_W + 1) - i_0, PU_W);

  u_rest_3   <= u_rest_q when valid(4) = '1' else u_rest_d;

  -- Stages 1 to 3: proportional = kp*err;  moved = integral + ki*err
  proportional_part : entity work.multiply_add
    generic map (DROP => CURRENT_PI_DROP_P)
    port map (clk => clk, a => kp_0, b => err_0, c => NOTHING, y => proportional_3, limited => open);

  integral_part : entity work.multiply_add
    generic map (DROP => CURRENT_PI_DROP_I)
    port map (clk => clk, a => ki_0, b => err_0, c => integral_0, y => moved_3, limited => open);

  process (clk)
    variable u_pi : signed(PU_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1 to 3: whether err pushes further against an active limit
      held_1 <= '1' when (sat_0 > 0 and err_0 > 0) or (sat_0 < 0 and err_0 < 0) else '0';
      held_2 <= held_1;
      held_3 <= held_2;

      -- Stage 4: integral = moved unless held, or u_rest;  all zero while not running
      proportional_4 <= proportional_3 and not by_voltage;
      integral_4     <= moved_3;
      if held_3 = '1' then
        integral_4 <= state.integral_q when valid(4) = '1' else state.integral_d;
      end if;
      if follows = '1' then
        integral_4 <= shift_left(resize(u_rest_3, INTEGRAL_W), PU_TO_INTEGRAL);
      end if;
      if run = '0' then
        proportional_4 <= (others => '0');
        integral_4     <= (others => '0');
      end if;

      -- Stages 5, 6: u_pi = proportional + integral, and the state of the next sample;  d, then q
      u_pi := round_sat(resize(proportional_4, PROP_W + 1) + integral_4, PU_TO_INTEGRAL, PU_W);
      if valid(4) = '1' then
        u_pi_d           <= u_pi;
        state.integral_d <= integral_4;
      end if;
      if valid(5) = '1' then
        u_pi_q           <= u_pi;
        state.integral_q <= integral_4;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (others => (others => '0'));
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - 1);
  out_valid <= valid(LATENCY);
  u_int_d   <= state.integral_d;
  u_int_q   <= state.integral_q;

end architecture rtl;
