-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: merge of voltage and current models in the stator frame, paper 001 eq. (7).
--   drop = rho*i;  lambda = carried - drop;  eps = lambda_c - lambda;  y = omega_0*eps;  x += omega_0*y
--   carried = lambda_m = lambda + 2*xi*y + x + t_s*u_applied - drop
-- If the voltage of the last period is not known or the gates are off: lambda = lambda_c, eps = x = 0.
-- One pipeline for both axes: alpha during the first half, beta during the second.  The inputs of an axis are constant
-- meanwhile, so each value stays once it is there; the state of the axis changes in the last stage.
-- Formats: carried S(1,30), eps and u FLUX, y S(-1,25), x S(-3,36); products exact.
-- Latency: 30 (alpha 15, beta 30).  Interval: 30.
-- Rounding: half up, each product and x separately.  lambda, eps, x and the carried flux saturate, which is reported.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_merge is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    i_alpha         : in  signed(PU_W - 1 downto 0);
    i_beta          : in  signed(PU_W - 1 downto 0);
    lambda_c_alpha  : in  signed(FLUX_W - 1 downto 0);
    lambda_c_beta   : in  signed(FLUX_W - 1 downto 0);
    u_applied_alpha : in  signed(FLUX_W - 1 downto 0);
    u_applied_beta  : in  signed(FLUX_W - 1 downto 0);
    voltage_known   : in  std_logic;
    run             : in  std_logic;
    rho             : in  unsigned(RHO_W - 1 downto 0);
    omega_0         : in  unsigned(15 downto 0);
    xi              : in  unsigned(15 downto 0);
    t_s             : in  unsigned(SAMPLE_TIME_W - 1 downto 0);
    out_valid       : out std_logic;
    lambda_m_alpha  : out signed(FLUX_W - 1 downto 0);
    lambda_m_beta   : out signed(FLUX_W - 1 downto 0);
    merge_known     : out std_logic;
    merge_limited   : out std_logic
  );
end entity flux_merge;

architecture rtl of flux_merge is
  constant LATENCY : positive := FLUX_MERGE_LATENCY;
  constant TURN    : positive := LATENCY / 2;  -- clocks of an axis
  constant Y_W     : positive := FLUX_MERGE_Y_W;
  constant X_W     : positive := FLUX_MERGE_X_W;
  constant TOTAL_W : positive := FLUX_STATE_W + 3;

  constant NOTHING : signed(0 downto 0) := "0";

  type state_t is record
    lambda_alpha : signed(FLUX_STATE_W - 1 downto 0);
    lambda_beta  : signed(FLUX_STATE_W - 1 downto 0);
    x_alpha      : signed(X_W - 1 downto 0);
    x_beta       : signed(X_W - 1 downto 0);
    known        : std_logic;
  end record state_t;

  signal state : state_t;

  signal valid         : std_logic_vector(0 to LATENCY);
  signal beta          : std_logic;  -- the axis that enters
  signal trusted       : std_logic;
  signal by_rho        : signed(RHO_W downto 0);
  signal by_t_s        : signed(t_s'length downto 0);
  signal by_omega_0    : signed(omega_0'length downto 0);
  signal by_xi         : signed(xi'length downto 0);
  signal carried_1     : signed(FLUX_STATE_W - 1 downto 0);
  signal x_1           : signed(X_W - 1 downto 0);
  signal i_1           : signed(PU_W - 1 downto 0);
  signal lambda_c_1    : signed(FLUX_W - 1 downto 0);
  signal u_1           : signed(FLUX_W - 1 downto 0);
  signal drop_4        : signed(FLUX_STATE_W - 1 downto 0);
  signal gained_4      : signed(FLUX_STATE_W downto 0);
  signal now_5         : signed(FLUX_STATE_W downto 0);
  signal push_5        : signed(FLUX_STATE_W downto 0);
  signal lambda_6      : signed(FLUX_STATE_W - 1 downto 0);
  signal diff_7        : signed(FLUX_W downto 0);
  signal start_7       : signed(TOTAL_W - 2 downto 0);
  signal eps_7         : signed(FLUX_W - 1 downto 0);
  signal y_10          : signed(Y_W + 1 downto 0);
  signal x_13          : signed(X_W - 1 downto 0);
  signal x_limited     : std_logic;
  signal corrected_13  : signed(TOTAL_W - 1 downto 0);
  signal total_14      : signed(TOTAL_W - 1 downto 0);
  signal carried       : signed(FLUX_STATE_W - 1 downto 0);
  signal lambda_m      : signed(FLUX_W - 1 downto 0);
  signal limited       : std_logic;
  signal limited_alpha : std_logic;
begin
  valid(0)   <= in_valid;
  trusted    <= state.known and run;
  by_rho     <= signed('0' & rho);
  by_t_s     <= signed('0' & t_s);
  by_omega_0 <= signed('0' & omega_0);
  by_xi      <= signed('0' & xi);

  -- Stages 2 to 4: drop = rho*i;  gained = t_s*u_applied
  resistive_drop : entity work.multiply_add
    generic map (DROP => FLUX_MERGE_DROP_RHO)
    port map (clk => clk, a => by_rho, b => i_1, c => NOTHING, y => drop_4, limited => open);

  voltage_gain : entity work.multiply_add
    generic map (DROP => FLUX_MERGE_DROP_U)
    port map (clk => clk, a => u_1, b => by_t_s, c => NOTHING, y => gained_4, limited => open);

  -- Stages 8 to 10: y = omega_0*eps; |eps| <= 2 and omega_0 < 1/4, so it fits Y_W bits
  eps_7 <= saturate(diff_7, FLUX_W) when trusted = '1' else (others => '0');

  crossover : entity work.multiply_add
    generic map (DROP => FLUX_MERGE_DROP_Y)
    port map (clk => clk, a => eps_7, b => by_omega_0, c => NOTHING, y => y_10, limited => open);

  -- Stages 11 to 13: x += omega_0*y;  corrected = lambda + push + 2*xi*y
  integral : entity work.multiply_add
    generic map (DROP => FLUX_MERGE_DROP_X)
    port map (clk => clk, a => y_10(Y_W - 1 downto 0), b => by_omega_0, c => x_1, y => x_13, limited => x_limited);

  damping : entity work.multiply_add
    generic map (DROP => FLUX_MERGE_DROP_XI)
    port map (clk => clk, a => y_10(Y_W - 1 downto 0), b => by_xi, c => start_7, y => corrected_13, limited => open);

  -- Stage 15: the carried flux, narrowed twice; any limit of the axis, of which all but the last count if trusted
  carried  <= saturate(total_14, FLUX_STATE_W);
  lambda_m <= round_sat(carried, FLUX_TO_STATE, FLUX_W);
  limited  <= exceeds(total_14, FLUX_STATE_W)
              or (trusted and (exceeds(now_5, FLUX_STATE_W) or exceeds(diff_7, FLUX_W) or x_limited));

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the axis
      if beta = '1' then
        carried_1  <= state.lambda_beta;
        x_1        <= state.x_beta;
        i_1        <= i_beta;
        lambda_c_1 <= lambda_c_beta;
        u_1        <= u_applied_beta;
      else
        carried_1  <= state.lambda_alpha;
        x_1        <= state.x_alpha;
        i_1        <= i_alpha;
        lambda_c_1 <= lambda_c_alpha;
        u_1        <= u_applied_alpha;
      end if;
      if trusted = '0' then
        x_1 <= (others => '0');
      end if;

      -- Stage 5: now = carried - drop;  push = gained - drop
      now_5  <= resize(carried_1, FLUX_STATE_W + 1) - drop_4;
      push_5 <= resize(gained_4, FLUX_STATE_W + 1) - drop_4;

      -- Stage 6: lambda = now, narrowed, or lambda_c
      lambda_6 <= saturate(now_5, FLUX_STATE_W);
      if trusted = '0' then
        lambda_6 <= shift_left(resize(lambda_c_1, FLUX_STATE_W), FLUX_TO_STATE);
      end if;

      -- Stage 7: diff = lambda_c - lambda;  start = lambda + push
      diff_7  <= resize(lambda_c_1, FLUX_W + 1) - round_sat(lambda_6, FLUX_TO_STATE, FLUX_W);
      start_7 <= resize(lambda_6, TOTAL_W - 1) + push_5;

      -- Stage 14: total = corrected + x
      total_14 <= plus_rounded(corrected_13, x_13, FLUX_MERGE_X_TO_STATE);

      -- Stage 15: the state of the axis and its flux, alpha's at clock 15, beta's at clock 30
      if valid(TURN - 1) = '1' then
        beta               <= '1';
        lambda_m_alpha     <= lambda_m;
        limited_alpha      <= limited;
        state.lambda_alpha <= carried;
        state.x_alpha      <= x_13;
      end if;
      if valid(LATENCY - 1) = '1' then
        beta              <= '0';
        lambda_m_beta     <= lambda_m;
        merge_known       <= voltage_known;
        merge_limited     <= limited_alpha or limited;
        state.lambda_beta <= carried;
        state.x_beta      <= x_13;
        state.known       <= voltage_known;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        beta                <= '0';
        state               <= (known => '0', others => (others => '0'));
        lambda_m_alpha      <= (others => '0');
        lambda_m_beta       <= (others => '0');
        merge_known         <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
