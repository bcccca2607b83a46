-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: Adaline of the magnet flux, paper 000 eq. (13), with the reluctance term of eq. (7b).
--   e = u_q - v_leg*d_q - r*i_q - omega_chord*(l_d*i_d + psi_m);  psi_m += eta_psi*omega_chord*e
-- Held, and reported by psi_held, below omega_psi_min, while the voltage is at its limit, a converter at its end, the
-- voltage not known or the gates off.
-- Inputs and state are constant while a sample is processed, so each value stays once it is there; the state changes
-- in the last stage.
-- Formats: products and e FLUX, psi_m inside S(1,34), out PU.
-- Latency: 16.  Interval: 16.
-- Rounding: half up.  l_d*i_d, the flux, e, omega_chord*e and psi_m saturate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity psi_adaline is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    u_q             : in  signed(PU_W - 1 downto 0);
    d_q             : in  signed(PU_W - 1 downto 0);
    v_leg           : in  signed(V_LEG_W - 1 downto 0);
    i_d             : in  signed(PU_W - 1 downto 0);
    i_q             : in  signed(PU_W - 1 downto 0);
    r               : in  unsigned(RESISTANCE_W - 1 downto 0);
    omega_chord     : in  signed(PU_W - 1 downto 0);
    sat_d           : in  signed(1 downto 0);
    sat_q           : in  signed(1 downto 0);
    current_at_rail : in  unsigned(2 downto 0);
    voltage_known   : in  std_logic;
    run             : in  std_logic;
    l_d             : in  unsigned(INDUCTANCE_W - 1 downto 0);
    eta_psi         : in  unsigned(16 downto 0);
    omega_psi_min   : in  unsigned(16 downto 0);
    out_valid       : out std_logic;
    psi_m           : out signed(PU_W - 1 downto 0);
    psi_held        : out std_logic
  );
end entity psi_adaline;

architecture rtl of psi_adaline is
  constant LATENCY : positive := PSI_ADALINE_LATENCY;
  constant STATE_W : positive := PSI_ADALINE_PSI_STATE_W;
  constant REST_W  : positive := FLUX_W + 2;

  constant NOTHING : signed(0 downto 0) := "0";

  type state_t is record
    psi_m : signed(STATE_W - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal by_l_d   : signed(INDUCTANCE_W downto 0);
  signal by_r     : signed(RESISTANCE_W downto 0);
  signal by_eta   : signed(eta_psi'length downto 0);
  signal wide_u_q : signed(FLUX_W - 1 downto 0);  -- u_q as FLUX
  signal calm     : std_logic;                    -- from clock 1 on
  signal speed_1  : unsigned(PU_W - 1 downto 0);
  signal learning : std_logic;                    -- from clock 2 on
  signal psi_1    : signed(FLUX_W - 1 downto 0);
  signal own_3    : signed(FLUX_W - 1 downto 0);
  signal flux_4   : signed(FLUX_W - 1 downto 0);
  signal after_v  : signed(FLUX_W downto 0);      -- u_q - v_leg*d_q at clock 3
  signal rest_6   : signed(REST_W - 1 downto 0);  -- without r*i_q too
  signal e_9      : signed(FLUX_W - 1 downto 0);
  signal pull_12  : signed(FLUX_W - 1 downto 0);
  signal moved_15 : signed(STATE_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  by_l_d   <= signed('0' & l_d);
  by_r     <= signed('0' & r);
  by_eta   <= signed('0' & eta_psi);
  wide_u_q <= shift_left(resize(u_q, FLUX_W), PU_TO_FLUX);

  -- Stages 1 to 3: own = l_d*i_d;  the rest of u_q without v_leg*d_q
  reluctance : entity work.multiply_add
    generic map (DROP => PSI_ADALINE_DROP_L)
    port map (clk => clk, a => by_l_d, b => i_d, c => NOTHING, y => own_3, limited => open);

  leg_loss : entity work.multiply_add
    generic map (DROP => PSI_ADALINE_DROP_V, MINUS => 1)
    port map (clk => clk, a => v_leg, b => d_q, c => wide_u_q, y => after_v, limited => open);

  -- Stages 4 to 6: and without r*i_q
  resistive_drop : entity work.multiply_add
    generic map (DROP => PSI_ADALINE_DROP_R, MINUS => 1)
    port map (clk => clk, a => by_r, b => i_q, c => after_v, y => rest_6, limited => open);

  -- Stages 7 to 9: e = rest - flux*omega_chord
  emf : entity work.multiply_add
    generic map (DROP => PSI_ADALINE_DROP_OMEGA, MINUS => 1)
    port map (clk => clk, a => flux_4, b => omega_chord, c => rest_6, y => e_9, limited => open);

  -- Stages 10 to 12: pull = e*omega_chord
  gradient : entity work.multiply_add
    generic map (DROP => PSI_ADALINE_DROP_OMEGA)
    port map (clk => clk, a => e_9, b => omega_chord, c => NOTHING, y => pull_12, limited => open);

  -- Stages 13 to 15: moved = psi_m + eta_psi*pull
  adaline : entity work.multiply_add
    generic map (DROP => PSI_ADALINE_DROP_ETA)
    port map (clk => clk, a => pull_12, b => by_eta, c => state.psi_m, y => moved_15, limited => open);

  process (clk)
    variable psi : signed(STATE_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: learning = calm and |omega_chord| >= omega_psi_min
      calm     <= run and voltage_known when sat_d = 0 and sat_q = 0 and current_at_rail = 0 else '0';
      speed_1  <= magnitude(omega_chord);
      learning <= calm when speed_1 >= omega_psi_min else '0';

      -- Stages 1, 4: flux = own + psi_m, each narrowed
      psi_1  <= round_sat(state.psi_m, PSI_ADALINE_TO_FLUX, FLUX_W);
      flux_4 <= saturate(resize(own_3, FLUX_W + 1) + psi_1, FLUX_W);

      -- Stage 16: psi_m = moved if learning, and as an output
      psi := moved_15 when learning = '1' else state.psi_m;
      if valid(LATENCY - 1) = '1' then
        state.psi_m <= psi;
        psi_m       <= round_sat(psi, PSI_ADALINE_TO_PU, PU_W);
        psi_held    <= not learning;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.psi_m         <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
