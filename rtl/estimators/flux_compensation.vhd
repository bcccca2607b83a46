-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the PI of paper 001 eq. (17) on delta_lambda, or the plain addition of eq. (16).
--   integral = limit(integral + flux_ki*delta_lambda)                                     flux_mode 3
--   integral = integral - integral/2**8 while delta_lambda is held: an unverified compensation decays
--   lambda_pi = limit(flux_kp*delta_lambda + integral)                                    flux_mode 3
--   lambda_add = limit(delta_lambda)                                                      flux_mode 2
-- resumes = 1, the first sample after voltage mode: the integral is what gives lambda_pi of the sample before once more.
-- limit: to +-delta_max, reported.
-- One pipeline for both axes: d, then q a clock later.
-- Formats: flux_kp U(7,10), flux_ki U(0,17), products and integral S(1,30), delta_max U(0,16), out FLUX.
-- Latency: 9 (d, then q).  Interval: 9.
-- Rounding: half up; the limit is a multiple of FLUX's LSB.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_compensation is
  port (
    clk                  : in  std_logic;
    rst                  : in  std_logic;
    in_valid             : in  std_logic;
    delta_lambda_d       : in  signed(FLUX_W - 1 downto 0);
    delta_lambda_q       : in  signed(FLUX_W - 1 downto 0);
    delta_held           : in  std_logic;
    before_d             : in  signed(FLUX_W - 1 downto 0);
    before_q             : in  signed(FLUX_W - 1 downto 0);
    resumes              : in  std_logic;
    flux_mode            : in  unsigned(1 downto 0);
    flux_kp              : in  unsigned(16 downto 0);
    flux_ki              : in  unsigned(16 downto 0);
    delta_max            : in  unsigned(15 downto 0);
    out_valid            : out std_logic;
    lambda_pi_d          : out signed(FLUX_W - 1 downto 0);
    lambda_pi_q          : out signed(FLUX_W - 1 downto 0);
    lambda_add_d         : out signed(FLUX_W - 1 downto 0);
    lambda_add_q         : out signed(FLUX_W - 1 downto 0);
    compensation_limited : out std_logic
  );
end entity flux_compensation;

architecture rtl of flux_compensation is
  constant LATENCY     : positive := FLUX_COMPENSATION_LATENCY;
  constant SHIFT_LIMIT : positive := FLUX_COMPENSATION_SHIFT_LIMIT;
  constant FORGET      : positive := FLUX_COMPENSATION_FORGET;
  constant EARLIER     : natural  := FLUX_MODELS_EARLIER;
  constant PROPOSED    : natural  := FLUX_MODELS_PROPOSED;
  constant PART_W      : positive := FLUX_STATE_W + 7;  -- flux_kp is below 128
  constant MOVED_W     : positive := FLUX_STATE_W + 8;  -- so wide for what resumes
  constant TOTAL_W     : positive := PART_W + 1;

  constant NOTHING : signed(0 downto 0) := "0";

  type state_t is record
    integral_d : signed(FLUX_STATE_W - 1 downto 0);
    integral_q : signed(FLUX_STATE_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid          : std_logic_vector(0 to LATENCY);
  signal by_kp          : signed(flux_kp'length downto 0);
  signal by_ki          : signed(flux_ki'length downto 0);
  signal delta_1        : signed(FLUX_W - 1 downto 0);
  signal proportional_4 : signed(PART_W + 1 downto 0);
  signal increment_4    : signed(FLUX_STATE_W + 1 downto 0);
  signal integral_4     : signed(FLUX_STATE_W - 1 downto 0);
  signal delta_4        : signed(FLUX_W - 1 downto 0);
  signal before_4       : signed(FLUX_W - 1 downto 0);
  signal moved_5        : signed(MOVED_W - 1 downto 0);
  signal proportional_5 : signed(PART_W - 1 downto 0);
  signal integral_6     : signed(FLUX_STATE_W - 1 downto 0);
  signal proportional_6 : signed(PART_W - 1 downto 0);
  signal integral_7     : signed(FLUX_STATE_W - 1 downto 0);
  signal total_7        : signed(TOTAL_W - 1 downto 0);
  signal integral_8     : signed(FLUX_STATE_W - 1 downto 0);
  signal lambda_7       : signed(FLUX_W - 1 downto 0);
  signal lambda_8       : signed(FLUX_W - 1 downto 0);
  signal past_7         : std_logic;
  signal past_8         : std_logic;
begin
  valid(0) <= in_valid;
  by_kp    <= signed('0' & flux_kp);
  by_ki    <= signed('0' & flux_ki);

  -- Stages 2 to 4: proportional = flux_kp*delta;  increment = flux_ki*delta
  proportional_part : entity work.multiply_add
    generic map (DROP => FLUX_COMPENSATION_DROP_P)
    port map (clk => clk, a => delta_1, b => by_kp, c => NOTHING, y => proportional_4, limited => open);

  integral_part : entity work.multiply_add
    generic map (DROP => FLUX_COMPENSATION_DROP_I)
    port map (clk => clk, a => delta_1, b => by_ki, c => NOTHING, y => increment_4, limited => open);

  integral_4 <= state.integral_q when valid(5) = '1' else state.integral_d;
  delta_4    <= delta_lambda_q when valid(5) = '1' else delta_lambda_d;
  before_4   <= before_q when valid(5) = '1' else before_d;

  -- lambda = total, limited; the limit is a multiple of FLUX's LSB, so the rounding cannot move a value beyond it
  lambda_7 <= resize(round_half_up(within(total_7, delta_max, SHIFT_LIMIT), FLUX_TO_STATE), FLUX_W);
  past_7   <= beyond(total_7, delta_max, SHIFT_LIMIT);

  process (clk)
    variable increment : signed(FLUX_STATE_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the axis
      delta_1 <= delta_lambda_q when valid(1) = '1' else delta_lambda_d;

      -- Stage 5: moved = integral + increment, which lets the integral decay while held;  the earlier scheme has a
      -- gain of one.  Both products fit: |delta| <= 2, flux_kp < 128, flux_ki < 1.
      increment := resize(increment_4, FLUX_STATE_W);
      if delta_held = '1' then
        increment := resize(round_half_up(-resize(integral_4, MOVED_W), FORGET), FLUX_STATE_W);
      end if;
      moved_5        <= resize(integral_4, MOVED_W) + increment;
      if resumes = '1' then
        moved_5 <= shift_left(resize(before_4, MOVED_W), FLUX_TO_STATE) - resize(proportional_4, PART_W);
      end if;
      proportional_5 <= resize(proportional_4, PART_W);
      if flux_mode = EARLIER then
        proportional_5 <= shift_left(resize(delta_4, PART_W), FLUX_TO_STATE);
      end if;

      -- Stage 6: integral = moved, limited;  the earlier scheme has none
      integral_6 <= resize(within(moved_5, delta_max, SHIFT_LIMIT), FLUX_STATE_W);
      if flux_mode /= PROPOSED then
        integral_6 <= (others => '0');
      end if;
      proportional_6 <= proportional_5;

      -- Stage 7: total = proportional + integral
      total_7    <= resize(proportional_6, TOTAL_W) + integral_6;
      integral_7 <= integral_6;

      -- Stage 8: the results of d wait for those of q
      lambda_8   <= lambda_7;
      past_8     <= past_7;
      integral_8 <= integral_7;

      -- Stage 9: the results of the mode and the state of the next sample
      if valid(LATENCY - 1) = '1' then
        state                <= (integral_d => integral_8, integral_q => integral_7);
        lambda_pi_d          <= (others => '0');
        lambda_pi_q          <= (others => '0');
        lambda_add_d         <= (others => '0');
        lambda_add_q         <= (others => '0');
        compensation_limited <= '0';
        if flux_mode = PROPOSED then
          lambda_pi_d          <= lambda_8;
          lambda_pi_q          <= lambda_7;
          compensation_limited <= past_8 or past_7;
        elsif flux_mode = EARLIER then
          lambda_add_d         <= lambda_8;
          lambda_add_q         <= lambda_7;
          compensation_limited <= past_8 or past_7;
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (others => (others => '0'));
        lambda_pi_d         <= (others => '0');
        lambda_pi_q         <= (others => '0');
        lambda_add_d        <= (others => '0');
        lambda_add_q        <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
