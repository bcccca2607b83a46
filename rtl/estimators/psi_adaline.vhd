-- Purpose: Adaline of the magnets' flux, paper 000 eq. (13), with the reluctance term of eq. (7b).
--   e = u_q - v_leg*d_q - r*i_q - omega_chord*(l_d*i_d + psi_m);  psi_m += eta_psi*omega_chord*e
-- Held, and told, below omega_psi_min, while the voltage is at its limit, a converter at its end, the voltage not
-- known or the gates off.
-- Six products one after the other, through one multiplier.
-- Formats: products and e FLUX, psi_m inside S(1,34), out PU.
-- Latency: 11.  Interval: 11.
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
  constant REST_W  : positive := FLUX_W + 3;

  -- State
  signal psi : signed(STATE_W - 1 downto 0);

  signal valid    : std_logic_vector(0 to LATENCY);
  signal learning : std_logic;
  signal slow     : std_logic;
  signal mul_a    : signed(FLUX_W - 1 downto 0);
  signal mul_b    : signed(PU_W - 1 downto 0);
  signal prod     : signed(FLUX_W + PU_W - 1 downto 0);
  signal level_1  : signed(FLUX_W - 1 downto 0);
  signal own_2    : signed(FLUX_W - 1 downto 0);
  signal flux_3   : signed(FLUX_W - 1 downto 0);
  signal rest_3   : signed(REST_W - 1 downto 0);
  signal rest_4   : signed(REST_W - 1 downto 0);
  signal e_4      : signed(REST_W - 1 downto 0);
  signal e_5      : signed(FLUX_W - 1 downto 0);
  signal pull_7   : signed(FLUX_W - 1 downto 0);
  signal sum_9    : signed(STATE_W downto 0);
begin
  valid(0) <= in_valid;
  learning <= run and voltage_known when sat_d = 0 and sat_q = 0 and current_at_rail = 0 else '0';
  slow     <= '1' when omega_chord < signed('0' & omega_psi_min) and omega_chord > -signed('0' & omega_psi_min) else
              '0';

  mul_a <= signed('0' & l_d) when valid(0) = '1' else
           signed('0' & r) when valid(1) = '1' else
           resize(v_leg, FLUX_W) when valid(2) = '1' else
           flux_3 when valid(3) = '1' else
           e_5 when valid(5) = '1' else
           pull_7;
  mul_b <= i_d when valid(0) = '1' else
           i_q when valid(1) = '1' else
           d_q when valid(2) = '1' else
           signed('0' & eta_psi) when valid(7) = '1' else
           omega_chord;

  e_4 <= minus_rounded(rest_4, prod, PSI_ADALINE_DROP_OMEGA);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2, 3, 4, 6, 8: prod = l_d*i_d, r*i_q, v_leg*d_q, flux*omega_chord, e*omega_chord, pull*eta_psi
      if valid(0) = '1' or valid(1) = '1' or valid(2) = '1' or valid(3) = '1' or valid(5) = '1' or valid(7) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stage 1: level = psi, narrowed
      if valid(0) = '1' then
        level_1 <= round_sat(psi, PSI_ADALINE_TO_FLUX, FLUX_W);
      end if;

      -- Stage 2: own = prod, narrowed
      if valid(1) = '1' then
        own_2 <= round_sat(prod, PSI_ADALINE_DROP_L, FLUX_W);
      end if;

      -- Stage 3: flux = own + level;  rest = u_q - prod
      if valid(2) = '1' then
        flux_3 <= saturate(resize(own_2, FLUX_W + 1) + level_1, FLUX_W);
        rest_3 <= minus_rounded(shift_left(resize(u_q, REST_W), PU_TO_FLUX), prod, PSI_ADALINE_DROP_R);
      end if;

      -- Stage 4: rest -= prod
      if valid(3) = '1' then
        rest_4 <= minus_rounded(rest_3, prod, PSI_ADALINE_DROP_V);
      end if;

      -- Stage 5: e = rest - prod
      if valid(4) = '1' then
        e_5 <= saturate(e_4, FLUX_W);
      end if;

      -- Stage 7: pull = prod, narrowed
      if valid(6) = '1' then
        pull_7 <= round_sat(prod, PSI_ADALINE_DROP_OMEGA, FLUX_W);
      end if;

      -- Stages 9, 10: psi += prod
      if valid(8) = '1' then
        sum_9    <= plus_rounded(resize(psi, STATE_W + 1), prod, PSI_ADALINE_DROP_ETA);
        psi_held <= slow or not learning;
      end if;
      if valid(9) = '1' and psi_held = '0' then
        psi <= saturate(sum_9, STATE_W);
      end if;

      -- Stage 11: psi_m = psi, narrowed
      if valid(10) = '1' then
        psi_m <= round_sat(psi, PSI_ADALINE_TO_PU, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        psi                 <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
