-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: error of the flux estimate, from the current regulators' integrals, paper 001 eq. (15).
--   delta_lambda_d =  (u_int_q - r*i_q - left_q) * factor * 2**n_omega
--   delta_lambda_q = -(u_int_d - r*i_d - left_d) * factor * 2**n_omega
-- u_int is that of two samples before.  While the integrals contain other voltages (voltage at its limit, a current
-- converter at its end, voltage not known) delta_lambda decays by a sixteenth per sample and left = u_int - r*i, which
-- then fades by 1/128 per sample; zero while the gates are off.
-- One pipeline for both results: d, then q a clock later.
-- Formats: r U(0,24), u_int, left and the differences 28 fraction bits, factor S(0,17), out FLUX.
-- Latency: 12 (d, then q).  Interval: 12.
-- Rounding: half up after r*i, the fading, the shift and the factor.  The shifted difference saturates, which is
-- reported unless the factor is zero.  The other results fit: |r*i| < 2 and |factor| < 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity delta_lambda is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    u_int_d         : in  signed(INTEGRAL_W - 1 downto 0);
    u_int_q         : in  signed(INTEGRAL_W - 1 downto 0);
    i_d             : in  signed(PU_W - 1 downto 0);
    i_q             : in  signed(PU_W - 1 downto 0);
    sat_d           : in  signed(1 downto 0);
    sat_q           : in  signed(1 downto 0);
    current_at_rail : in  unsigned(2 downto 0);
    voltage_known   : in  std_logic;
    run             : in  std_logic;
    factor          : in  signed(RECIPROCAL_W downto 0);
    n_omega         : in  unsigned(3 downto 0);
    r               : in  unsigned(RESISTANCE_W - 1 downto 0);
    out_valid       : out std_logic;
    delta_lambda_d  : out signed(FLUX_W - 1 downto 0);
    delta_lambda_q  : out signed(FLUX_W - 1 downto 0);
    delta_held      : out std_logic;
    delta_limited   : out std_logic
  );
end entity delta_lambda;

architecture rtl of delta_lambda is
  constant LATENCY : positive := DELTA_LAMBDA_LATENCY;
  constant REST_W  : positive := INTEGRAL_W + 1;
  constant WIDE_W  : positive := REST_W + 1 + DELTA_LAMBDA_N_MAX;  -- room for the largest shift
  constant DROP    : positive := DELTA_LAMBDA_DROP_SHIFTED;

  constant NOTHING : signed(0 downto 0) := "0";

  type state_t is record
    delta_d   : signed(FLUX_W - 1 downto 0);
    delta_q   : signed(FLUX_W - 1 downto 0);
    u_int_d_1 : signed(INTEGRAL_W - 1 downto 0);  -- of the last sample
    u_int_q_1 : signed(INTEGRAL_W - 1 downto 0);
    u_int_d_2 : signed(INTEGRAL_W - 1 downto 0);  -- of the sample before
    u_int_q_2 : signed(INTEGRAL_W - 1 downto 0);
    left_d    : signed(REST_W - 1 downto 0);      -- what a hold has left in the integral
    left_q    : signed(REST_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal by_r      : signed(RESISTANCE_W downto 0);
  signal held      : std_logic;  -- from clock 1 on
  signal u_int_1   : signed(INTEGRAL_W - 1 downto 0);
  signal i_1       : signed(PU_W - 1 downto 0);
  signal rest_4    : signed(REST_W downto 0);
  signal coarse_5  : signed(WIDE_W - 1 downto 0);
  signal shifted_6 : signed(WIDE_W - 1 downto 0);
  signal value_7   : signed(FLUX_W - 1 downto 0);
  signal past_7    : std_logic;
  signal past_8    : std_logic;
  signal limited   : std_logic;  -- of either result, from clock 9 on
  signal factor_7  : signed(RECIPROCAL_W downto 0);
  signal delta_10  : signed(FLUX_W + 1 downto 0);
  signal delta_11  : signed(FLUX_W + 1 downto 0);

  -- delta, decayed by a sixteenth
  function faded (delta : signed) return signed is
  begin
    return resize(delta - round_half_up(delta, DELTA_LAMBDA_FADE), FLUX_W);
  end function;

  -- left of the next sample
  function kept (left : signed; rest : signed; held : std_logic; run : std_logic) return signed is
  begin
    if run = '0' then
      return to_signed(0, REST_W);
    elsif held = '1' then
      return rest;
    end if;
    return resize(left - round_half_up(left, DELTA_LAMBDA_FORGET), REST_W);
  end function;
begin
  valid(0) <= in_valid;
  by_r     <= signed('0' & r);

  -- Stages 2 to 4: rest = u_int - r*i
  resistive_drop : entity work.multiply_add
    generic map (DROP => DELTA_LAMBDA_DROP_R, MINUS => 1)
    port map (clk => clk, a => by_r, b => i_1, c => u_int_1, y => rest_4, limited => open);

  -- Stages 8 to 10: delta = value*factor
  scaling : entity work.multiply_add
    generic map (DROP => DELTA_LAMBDA_DROP_FACTOR)
    port map (clk => clk, a => value_7, b => factor_7, c => NOTHING, y => delta_10, limited => open);

  process (clk)
    variable rounded_7 : signed(WIDE_W - DROP downto 0);
    variable rest_5    : signed(REST_W - 1 downto 0);
    variable left_5    : signed(REST_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the quantities of q, for the result of d, then those of d
      u_int_1 <= state.u_int_d_2 when valid(1) = '1' else state.u_int_q_2;
      i_1     <= i_d when valid(1) = '1' else i_q;
      held    <= '0' when sat_d = 0 and sat_q = 0 and current_at_rail = 0 and voltage_known = '1' else run;

      -- Stages 5, 6: shifted = (rest - left) * 2**n_omega, by multiples of four, then by the remainder
      rest_5   := rest_4(REST_W - 1 downto 0);
      left_5   := state.left_d when valid(5) = '1' else state.left_q;
      coarse_5 <= shift_left(resize(rest_5, WIDE_W) - left_5, to_integer(n_omega(3 downto 2) & "00"));
      if valid(4) = '1' then
        state.left_q <= kept(state.left_q, rest_5, held, run);
      end if;
      if valid(5) = '1' then
        state.left_d <= kept(state.left_d, rest_5, held, run);
      end if;
      shifted_6 <= shift_left(coarse_5, to_integer(n_omega(1 downto 0)));

      -- Stage 7: value = shifted, narrowed;  the factor, negative for q
      rounded_7 := round_half_up(shifted_6, DROP);
      value_7   <= saturate(rounded_7, FLUX_W);
      past_7    <= exceeds(rounded_7, FLUX_W);
      past_8    <= past_7;
      if valid(8) = '1' then
        limited <= past_7 or past_8;
      end if;
      factor_7 <= negated(factor, valid(7));

      -- Stages 11, 12: delta of d waits for that of q;  the state of the next sample
      delta_11 <= delta_10;
      if valid(LATENCY - 1) = '1' then
        state.delta_d   <= resize(delta_11, FLUX_W);
        state.delta_q   <= resize(delta_10, FLUX_W);
        state.u_int_d_1 <= u_int_d;
        state.u_int_q_1 <= u_int_q;
        state.u_int_d_2 <= state.u_int_d_1;
        state.u_int_q_2 <= state.u_int_q_1;
        if held = '1' then
          state.delta_d <= faded(state.delta_d);
          state.delta_q <= faded(state.delta_q);
        end if;
        if run = '0' then
          state.delta_d <= (others => '0');
          state.delta_q <= (others => '0');
        end if;
        delta_held    <= held;
        delta_limited <= limited and run and not held when factor /= 0 else '0';
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (others => (others => '0'));
        delta_held          <= '0';
        delta_limited       <= '0';
      end if;
    end if;
  end process;

  out_valid      <= valid(LATENCY);
  delta_lambda_d <= state.delta_d;
  delta_lambda_q <= state.delta_q;

end architecture rtl;
