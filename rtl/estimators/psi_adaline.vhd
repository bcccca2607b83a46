-- Purpose: Adaline of the magnets' flux, paper 000 eq. (13), with the reluctance term of eq. (7b).
--   e = u_q - v_leg*d_q - r*i_q - omega_chord*(l_d*i_d + psi_m);  psi_m += eta_psi*omega_chord*e
-- Held, and told, below omega_psi_min, while the voltage is at its limit, a converter at its end, the voltage not
-- known or the gates off.
-- Six products one after the other, through one multiplier and the adder behind it: sum = addend + mul_a*mul_b.
-- Formats: products and e FLUX, psi_m inside S(1,34), out PU.
-- Latency: 15.  Interval: 15.
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
  constant LATENCY    : positive := PSI_ADALINE_LATENCY;
  constant STATE_W    : positive := PSI_ADALINE_PSI_STATE_W;
  constant DROP_L     : positive := PSI_ADALINE_DROP_L;
  constant DROP_R     : positive := PSI_ADALINE_DROP_R;
  constant DROP_OMEGA : positive := PSI_ADALINE_DROP_OMEGA;
  constant DROP_ETA   : positive := PSI_ADALINE_DROP_ETA;
  constant TO_FLUX    : positive := PSI_ADALINE_TO_FLUX;
  constant TO_R       : positive := DROP_R - PSI_ADALINE_DROP_V;  -- v_leg*2**TO_R drops what r drops
  constant SUM_W      : positive := 48;

  -- State
  signal psi : signed(STATE_W - 1 downto 0);

  signal valid    : std_logic_vector(0 to LATENCY);
  signal learning : std_logic;
  signal room_1   : signed(PU_W - 1 downto 0);
  signal slow_1   : std_logic;
  signal factor_a : signed(FLUX_W - 1 downto 0);
  signal factor_b : signed(PU_W - 1 downto 0);
  signal mul_a    : signed(FLUX_W - 1 downto 0);
  signal mul_b    : signed(PU_W - 1 downto 0);
  signal prod     : signed(FLUX_W + PU_W - 1 downto 0);
  signal addend   : signed(SUM_W - 1 downto 0);
  signal sum      : signed(SUM_W - 1 downto 0);
  signal own_3    : signed(FLUX_W - 1 downto 0);
  signal carry_3  : std_logic;
  signal flux_3   : signed(FLUX_W + 1 downto 0);
  signal flux_4   : signed(FLUX_W downto 0);
  signal narrow   : signed(FLUX_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  learning <= run and voltage_known when sat_d = 0 and sat_q = 0 and current_at_rail = 0 else '0';

  -- |omega_chord| < omega_psi_min; the complement of a negative speed is one less than its size.
  slow_1 <= not room_1(PU_W - 1) and ((or room_1(PU_W - 2 downto 1)) or (room_1(0) and not omega_chord(PU_W - 1)));

  -- own + level by one carry, which is the half that rounds psi; next to the end it would round past the flux.
  own_3   <= saturate(sum(SUM_W - 1 downto DROP_L), FLUX_W);
  carry_3 <= psi(TO_FLUX - 1) and not (not psi(STATE_W - 1) and (and psi(STATE_W - 2 downto TO_FLUX)));
  flux_3  <= (resize(own_3, FLUX_W + 1) & carry_3) + (resize(psi(STATE_W - 1 downto TO_FLUX), FLUX_W + 1) & carry_3);

  narrow <= saturate(sum(SUM_W - 1 downto DROP_OMEGA), FLUX_W);

  factor_a <= saturate(flux_4, FLUX_W) when valid(4) = '1' else
              narrow xor valid(7) when valid(7) = '1' or valid(10) = '1' else
              signed('0' & l_d) when valid(0) = '1' else
              signed('0' & r) when valid(1) = '1' else
              shift_left(resize(v_leg, FLUX_W), TO_R);
  factor_b <= omega_chord when valid(4) = '1' else
              i_d when valid(0) = '1' else
              i_q when valid(1) = '1' else
              d_q when valid(2) = '1' else
              signed('0' & eta_psi);

  -- e grows as its complement: the adder behind the multiplier only adds.
  addend <= rounding_base("0", DROP_L, SUM_W) when valid(2) = '1' else
            rounding_base(not shift_left(resize(u_q, FLUX_W), PU_TO_FLUX), DROP_R, SUM_W) when valid(3) = '1' else
            rounding_base(sum(SUM_W - 1 downto DROP_R), DROP_R, SUM_W) when valid(4) = '1' else
            rounding_base(sum(SUM_W - 1 downto DROP_R), DROP_OMEGA, SUM_W) when valid(6) = '1' else
            rounding_base("0", DROP_OMEGA, SUM_W) when valid(9) = '1' else
            rounding_base(psi, DROP_ETA, SUM_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: room = omega_psi_min - |omega_chord|
      if valid(0) = '1' then
        room_1 <= signed('0' & omega_psi_min) - (omega_chord xor omega_chord(PU_W - 1));
      end if;

      -- Stages 1, 2, 3, 5, 8, 11: l_d and i_d, r and i_q, v_leg and d_q, flux and omega_chord, e, pull and eta_psi
      if (valid(0) or valid(1) or valid(2) or valid(4) or valid(7) or valid(10)) = '1' then
        mul_a <= factor_a;
      end if;
      if (valid(0) or valid(1) or valid(2) or valid(4) or valid(10)) = '1' then
        mul_b <= factor_b;
      end if;

      -- Stages 2, 3, 4, 6, 9, 12: prod = l_d*i_d, r*i_q, v_leg*d_q, flux*omega_chord, e*omega_chord, pull*eta_psi
      if (valid(1) or valid(2) or valid(3) or valid(5) or valid(8) or valid(11)) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stages 3, 4, 5, 7, 10, 13: sum = own, e = u_q - prod, e -= prod, e -= prod, pull, psi + prod
      if (valid(2) or valid(3) or valid(4) or valid(6) or valid(9) or valid(12)) = '1' then
        sum <= addend + prod;
      end if;

      -- Stage 4: flux = own + psi, narrowed
      if valid(3) = '1' then
        flux_4 <= flux_3(FLUX_W + 1 downto 1);
      end if;

      -- Stage 14: psi = sum, narrowed, unless it is held
      if valid(12) = '1' then
        psi_held <= slow_1 or not learning;
      end if;
      if valid(13) = '1' and psi_held = '0' then
        psi <= saturate(sum(SUM_W - 1 downto DROP_ETA), STATE_W);
      end if;

      -- Stage 15: psi_m = psi, narrowed
      if valid(14) = '1' then
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
