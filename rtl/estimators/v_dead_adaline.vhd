-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: Adaline of the voltage loss of a leg by dead time and drops, paper 000 eq. (10) and Fig. 4(a).
--   lp_u += k_lp*(u_pi_d - lp_u), u_h = u_pi_d - lp_u;  lp_d += k_lp*(d_d - lp_d), d_h = d_d - lp_d
--   e = u_h - v_dead*d_h;  v_dead += eta_v*d_h*e;  v_sum += zeta*v_dead while |v_dead| > v_thr
--   v_sum is v_start until the gates are on for the first time, and is kept when they are off again
--   v_comp = limit(gamma*v_dead + v_sum);  v_leg = v_comp + v_dead
-- v_dead is within +-v_comp_max; v_sum and v_comp from zero to v_comp_max, reported by v_comp_limited.  v_dead and
-- v_sum are held while the voltage is at its limit, a converter at its end, the voltage not known, the gates off or
-- |i_d| + |i_q| < i_learn.
-- Inputs and state are constant while a sample is processed, so each value stays once it is there; the state changes
-- in the last stage.
-- Formats: lp S(1,28), u_h and d_h PU, e FLUX, d_h*e S(-4,21), v_dead and v_sum S(-1,38), v_comp and v_leg V_LEG.
-- Latency: 22.  Interval: 22.
-- Rounding: half up.  u_h, d_h, lp, e, d_h*e and v_leg saturate, the other sums have the bits that they need.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity v_dead_adaline is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    u_pi_d          : in  signed(PU_W - 1 downto 0);
    d_d             : in  signed(PU_W - 1 downto 0);
    i_d             : in  signed(PU_W - 1 downto 0);
    i_q             : in  signed(PU_W - 1 downto 0);
    sat_d           : in  signed(1 downto 0);
    sat_q           : in  signed(1 downto 0);
    current_at_rail : in  unsigned(2 downto 0);
    voltage_known   : in  std_logic;
    run             : in  std_logic;
    k_lp            : in  unsigned(19 downto 0);
    eta_v           : in  unsigned(20 downto 0);
    gamma           : in  unsigned(16 downto 0);
    zeta            : in  unsigned(16 downto 0);
    v_thr           : in  unsigned(V_LEG_W - 2 downto 0);
    v_comp_max      : in  unsigned(V_LEG_W - 2 downto 0);
    i_learn         : in  unsigned(PU_W - 2 downto 0);
    compensate      : in  std_logic;
    v_start         : in  unsigned(V_LEG_W - 2 downto 0);
    out_valid       : out std_logic;
    v_dead          : out signed(V_LEG_W - 1 downto 0);
    v_comp          : out signed(V_LEG_W - 1 downto 0);
    v_leg           : out signed(V_LEG_W - 1 downto 0);
    v_comp_limited  : out std_logic
  );
end entity v_dead_adaline;

architecture rtl of v_dead_adaline is
  constant LATENCY     : positive := V_DEAD_ADALINE_LATENCY;
  constant STATE_W     : positive := V_DEAD_ADALINE_V_STATE_W;
  constant FINE_W      : positive := V_DEAD_ADALINE_V_FINE_W;
  constant STEP_W      : positive := V_DEAD_ADALINE_STEP_W;
  constant DROP_FINE   : positive := V_DEAD_ADALINE_DROP_FINE;
  constant TO_LEG      : positive := V_DEAD_ADALINE_TO_LEG;
  constant FINE_TO_LEG : positive := V_DEAD_ADALINE_FINE_TO_LEG;
  constant ASKED_W     : positive := STATE_W + 3;

  type state_t is record
    lp_u   : signed(INTEGRAL_W - 1 downto 0);
    lp_d   : signed(INTEGRAL_W - 1 downto 0);
    v_dead : signed(STATE_W - 1 downto 0);
    v_sum  : signed(STATE_W - 1 downto 0);
    begun  : std_logic;  -- the gates have been on
  end record state_t;

  signal state : state_t;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal by_k_lp   : signed(k_lp'length downto 0);
  signal by_eta_v  : signed(eta_v'length downto 0);
  signal by_gamma  : signed(gamma'length downto 0);
  signal calm_1    : std_logic;
  signal size_d_1  : unsigned(PU_W - 1 downto 0);
  signal size_q_1  : unsigned(PU_W - 1 downto 0);
  signal size_2    : unsigned(PU_W downto 0);
  signal learning  : std_logic;  -- from clock 3 on
  signal low_u_1   : signed(PU_W - 1 downto 0);
  signal low_d_1   : signed(PU_W - 1 downto 0);
  signal fine_1    : signed(FINE_W - 1 downto 0);
  signal u_h_2     : signed(PU_W - 1 downto 0);
  signal d_h_2     : signed(PU_W - 1 downto 0);
  signal wide_u_h  : signed(FLUX_W - 1 downto 0);  -- u_h_2 as FLUX
  signal lp_u_5    : signed(INTEGRAL_W - 1 downto 0);
  signal lp_d_5    : signed(INTEGRAL_W - 1 downto 0);
  signal e_5       : signed(FLUX_W - 1 downto 0);
  signal pull_8    : signed(STEP_W - 1 downto 0);
  signal moved_11  : signed(STATE_W downto 0);
  signal v_dead_12 : signed(STATE_W - 1 downto 0);
  signal fine_13   : signed(FINE_W - 1 downto 0);
  signal zeta_14   : signed(zeta'length downto 0);
  signal grown_17  : signed(STATE_W downto 0);
  signal v_sum_0   : signed(STATE_W - 1 downto 0);
  signal v_sum_18  : signed(STATE_W - 1 downto 0);
  signal asked_21  : signed(ASKED_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  wide_u_h <= shift_left(resize(u_h_2, FLUX_W), PU_TO_FLUX);
  by_k_lp  <= signed('0' & k_lp);
  by_eta_v <= signed('0' & eta_v);
  by_gamma <= signed('0' & gamma);

  -- Stages 3 to 5: lp_u += k_lp*u_h;  lp_d += k_lp*d_h
  low_pass_u : entity work.multiply_add
    generic map (DROP => V_DEAD_ADALINE_DROP_LP)
    port map (clk => clk, a => by_k_lp, b => u_h_2, c => state.lp_u, y => lp_u_5, limited => open);

  low_pass_d : entity work.multiply_add
    generic map (DROP => V_DEAD_ADALINE_DROP_LP)
    port map (clk => clk, a => by_k_lp, b => d_h_2, c => state.lp_d, y => lp_d_5, limited => open);

  -- Stages 3 to 5: e = u_h - fine*d_h
  model : entity work.multiply_add
    generic map (DROP => V_DEAD_ADALINE_DROP_MODEL, MINUS => 1)
    port map (clk => clk, a => fine_1, b => d_h_2, c => wide_u_h, y => e_5, limited => open);

  -- Stages 6 to 8: pull = d_h*e
  gradient : entity work.multiply_add
    generic map (DROP => V_DEAD_ADALINE_DROP_STEP)
    port map (clk => clk, a => e_5, b => d_h_2, c => "0", y => pull_8, limited => open);

  -- Stages 9 to 11: moved = v_dead + eta_v*pull
  adaline : entity work.multiply_add
    generic map (DROP => V_DEAD_ADALINE_DROP_ETA)
    port map (clk => clk, a => by_eta_v, b => pull_8, c => state.v_dead, y => moved_11, limited => open);

  v_sum_0 <= state.v_sum when state.begun = '1' else shift_left(signed(resize(v_start, STATE_W)), TO_LEG);

  -- Stages 15 to 17: grown = v_sum + zeta*fine
  minimisation : entity work.multiply_add
    generic map (DROP => V_DEAD_ADALINE_DROP_ZETA)
    port map (clk => clk, a => fine_13, b => zeta_14, c => v_sum_0, y => grown_17, limited => open);

  -- Stages 19 to 21: asked = v_sum + gamma*fine
  compensation : entity work.multiply_add
    generic map (DROP => V_DEAD_ADALINE_DROP_GAMMA)
    port map (clk => clk, a => fine_13, b => by_gamma, c => v_sum_18, y => asked_21, limited => open);

  process (clk)
    variable v_dead_22 : signed(V_LEG_W - 1 downto 0);
    variable v_comp_22 : signed(V_LEG_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1 to 3: learning = calm and |i_d| + |i_q| >= i_learn
      calm_1   <= run and voltage_known when sat_d = 0 and sat_q = 0 and current_at_rail = 0 else '0';
      size_d_1 <= magnitude(i_d);
      size_q_1 <= magnitude(i_q);
      size_2   <= resize(size_d_1, PU_W + 1) + size_q_1;
      learning <= calm_1 when size_2 >= i_learn else '0';

      -- Stage 1: the low-pass outputs and v_dead, narrowed for the multipliers.  lp moves by no more than the distance
      -- of two PU numbers, so it rounds to one: half an LSB beyond is the most.
      low_u_1 <= resize(round_half_up(state.lp_u, PU_TO_INTEGRAL), PU_W);
      low_d_1 <= resize(round_half_up(state.lp_d, PU_TO_INTEGRAL), PU_W);
      fine_1  <= resize(round_half_up(state.v_dead, DROP_FINE), FINE_W);

      -- Stage 2: u_h = u_pi_d - lp_u;  d_h = d_d - lp_d
      u_h_2 <= saturate(resize(u_pi_d, PU_W + 1) - low_u_1, PU_W);
      d_h_2 <= saturate(resize(d_d, PU_W + 1) - low_d_1, PU_W);

      -- Stage 12: v_dead = moved, limited, if learning;  stage 13: narrowed, which the limit leaves room for
      v_dead_12 <= state.v_dead;
      if learning = '1' then
        v_dead_12 <= resize(within(moved_11, v_comp_max, TO_LEG), STATE_W);
      end if;
      fine_13 <= resize(round_half_up(v_dead_12, DROP_FINE), FINE_W);

      -- Stage 14: zeta while learning and |fine| > v_thr
      zeta_14 <= signed('0' & zeta) and (learning and beyond(fine_13, v_thr, FINE_TO_LEG));

      -- Stage 18: v_sum = grown, limited
      v_sum_18 <= signed('0' & within_u(grown_17, v_comp_max, TO_LEG)) and compensate;

      -- Stage 22: v_comp = asked, limited;  v_leg = v_comp + v_dead;  the state of the next sample
      v_dead_22 := resize(round_half_up(fine_13, FINE_TO_LEG), V_LEG_W);
      v_comp_22 := resize(round_half_up(signed('0' & within_u(asked_21, v_comp_max, TO_LEG)), TO_LEG), V_LEG_W)
                   and compensate;
      if valid(LATENCY - 1) = '1' then
        v_dead         <= v_dead_22;
        v_comp         <= v_comp_22;
        v_leg          <= saturate(resize(v_comp_22, V_LEG_W + 1) + v_dead_22, V_LEG_W);
        v_comp_limited <= compensate and beyond(asked_21, v_comp_max, TO_LEG) and not asked_21(ASKED_W - 1);
        state          <= (lp_u => lp_u_5, lp_d => lp_d_5, v_dead => v_dead_12, v_sum => v_sum_18,
                           begun => state.begun or run);
        if run = '0' then
          state.lp_u <= (others => '0');
          state.lp_d <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (begun => '0', others => (others => '0'));
        v_comp              <= (others => '0');
        v_leg               <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
