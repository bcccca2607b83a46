-- Purpose: Adaline of the magnet flux, paper 000 eq. (13), with the reluctance term of eq. (7b).
--   e = u_q - v_leg*d_q - r*i_q - omega_chord*(l_d*i_d + psi_m);  psi_m += eta_psi*omega_chord*e
-- Held, and reported by psi_held, below omega_psi_min, while the voltage is at its limit, a converter at its end, the
-- voltage not known or the gates off.
-- r*i_q, v_leg*d_q, flux*omega_chord and e*omega_chord share a multiplier and the adder behind it.
-- Formats: products and e FLUX, psi_m inside S(1,34), out PU.
-- Latency: 18.  Interval: 18.
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
  constant TO_PU      : positive := PSI_ADALINE_TO_PU;
  constant TO_R       : positive := DROP_R - PSI_ADALINE_DROP_V;  -- v_leg*2**TO_R: cut by as many bits as r
  constant PROD_W     : positive := FLUX_W + PU_W;
  constant SUM_W      : positive := PROD_W + 2;
  constant SUM_P_W    : positive := STATE_W + DROP_ETA + 1;

  -- State
  signal psi : signed(STATE_W - 1 downto 0);

  signal valid    : std_logic_vector(0 to LATENCY);
  signal free     : std_logic;                              -- the voltage is not at its limit
  signal measured : std_logic;
  signal learning : std_logic;
  signal u_q_1    : signed(PU_W - 1 downto 0);
  signal d_q_1    : signed(PU_W - 1 downto 0);
  signal v_leg_1  : signed(V_LEG_W - 1 downto 0);
  signal i_q_1    : signed(PU_W - 1 downto 0);
  signal r_1      : unsigned(RESISTANCE_W - 1 downto 0);
  signal omega_1  : signed(PU_W - 1 downto 0);
  signal room_2   : signed(PU_W - 1 downto 0);
  signal slow_2   : std_logic;
  signal own_1    : signed(PROD_W - 1 downto 0);
  signal own_2    : signed(PROD_W downto 0);
  signal prod_own : signed(PROD_W - 1 downto 0);
  signal sum_own  : signed(PROD_W downto 0);
  signal past_2   : std_logic;
  signal past_3   : std_logic;
  signal own_3    : signed(FLUX_W - 1 downto 0);
  signal end_3    : std_logic_vector(1 downto 0);
  signal half_3   : std_logic;
  signal sum_flux : signed(FLUX_W + 1 downto 0);
  signal flux_4   : signed(FLUX_W downto 0);
  signal narrow   : signed(FLUX_W - 1 downto 0);            -- e at clock 9, pull at clock 13
  signal factor_a : signed(FLUX_W - 1 downto 0);
  signal factor_b : signed(PU_W - 1 downto 0);
  signal mul_a    : signed(FLUX_W - 1 downto 0);
  signal mul_b    : signed(PU_W - 1 downto 0);
  signal product  : signed(PROD_W - 1 downto 0);            -- next values of prod, sum and narrow
  signal total    : signed(SUM_W - 1 downto 0);
  signal limited  : signed(FLUX_W - 1 downto 0);
  signal prod     : signed(PROD_W - 1 downto 0);
  signal base     : signed(SUM_W - 1 downto 0);
  signal addend   : signed(SUM_W - 1 downto 0);
  signal sum      : signed(SUM_W - 1 downto 0);
  signal step_14  : signed(FLUX_W + eta_psi'length downto 0);
  signal moved_15 : signed(SUM_P_W - 1 downto 0);
  signal prod_psi : signed(FLUX_W + eta_psi'length downto 0);
  signal sum_psi  : signed(SUM_P_W - 1 downto 0);
  signal end_17   : std_logic_vector(1 downto 0);
  signal half_17  : std_logic;

  -- '1' if x, cut to width bits, is the largest number: rounding up would overflow.  One bit for each half.
  function at_end (x : signed; width : positive) return std_logic_vector is
    alias v : signed(x'length - 1 downto 0) is x;
  begin
    return (not v(v'high) and (and v(v'high - 1 downto v'high - width / 2)))
           & (and v(v'high - width / 2 - 1 downto v'high - width + 1));
  end function;
begin
  valid(0) <= in_valid;

  -- |omega_chord| < omega_psi_min; the complement of a negative speed is its magnitude minus one.
  slow_2 <= not room_2(PU_W - 1) and ((or room_2(PU_W - 2 downto 1)) or (room_2(0) and not omega_1(PU_W - 1)));

  -- own + rounded psi, with one carry for the one missing in the complement of own and one for the half.
  own_3    <= narrowed(sum_own(PROD_W downto DROP_L), past_3, FLUX_W);
  half_3   <= psi(TO_FLUX - 1) and not (and end_3);
  half_17  <= psi(TO_PU - 1) and not (and end_17);
  sum_flux <= (resize(psi(STATE_W - 1 downto TO_FLUX), FLUX_W + 1) & half_3) - (resize(not own_3, FLUX_W + 1) & '1');

  factor_a <= saturate(flux_4, FLUX_W) when valid(5) = '1' else
              not narrow when valid(9) = '1' else
              shift_left(resize(v_leg_1, FLUX_W), TO_R) when valid(3) = '1' else
              signed('0' & r_1);
  factor_b <= i_q_1 when valid(1) = '1' else
              d_q_1 when valid(3) = '1' else
              omega_1;

  -- e is accumulated as its complement, because the adder behind the multiplier can only add.
  base <= rounding_base(not shift_left(resize(u_q_1, FLUX_W), PU_TO_FLUX), DROP_R, SUM_W) when valid(2) = '1' else
          rounding_base(sum(SUM_W - 1 downto DROP_R), DROP_R, SUM_W) when valid(4) = '1' else
          rounding_base(sum(SUM_W - 1 downto DROP_R), DROP_OMEGA, SUM_W) when valid(6) = '1' else
          rounding_base("0", DROP_OMEGA, SUM_W);

  -- Outside the clocked process, so that a simulator computes them only when an operand changes.
  own_1    <= signed('0' & l_d) * i_d;
  own_2    <= rounding_base("0", DROP_L, PROD_W + 1) + prod_own;
  past_2   <= exceeds(sum_own(PROD_W downto DROP_L), FLUX_W);
  product  <= mul_a * mul_b;
  total    <= addend + prod;
  limited  <= saturate(sum(SUM_W - 1 downto DROP_OMEGA), FLUX_W);
  step_14  <= narrow * signed('0' & eta_psi);
  moved_15 <= rounding_base(psi, DROP_ETA, SUM_P_W) + prod_psi;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the inputs of the sample, which come from other blocks
      if valid(0) = '1' then
        u_q_1   <= u_q;
        d_q_1   <= d_q;
        v_leg_1 <= v_leg;
        i_q_1   <= i_q;
        r_1     <= r;
        omega_1 <= omega_chord;
      end if;

      -- Stage 2: room = omega_psi_min - |omega_chord|
      if valid(1) = '1' then
        room_2 <= signed('0' & omega_psi_min) - (omega_1 xor omega_1(PU_W - 1));
      end if;

      -- Stages 1 to 4: flux = l_d*i_d + psi, each narrowed.  From here to sum_psi nothing needs an enable: the factors
      -- are constant while they are used.
      prod_own <= own_1;
      sum_own  <= own_2;
      past_3   <= past_2;
      end_3    <= at_end(psi, FLUX_W);
      flux_4   <= sum_flux(FLUX_W + 1 downto 1);

      -- Stages 2, 4, 6, 10: r and i_q, v_leg and d_q, flux and omega_chord, e and omega_chord
      mul_a <= factor_a;
      mul_b <= factor_b;

      -- Stages 3, 5, 7, 11: prod = r*i_q, v_leg*d_q, flux*omega_chord, e*omega_chord;  addend: the other operand of sum
      prod   <= product;
      addend <= base;

      -- Stages 4, 6, 8, 12: sum = e = u_q - prod, e -= prod, e -= prod, pull;  stages 9, 13: narrowed
      sum    <= total;
      narrow <= limited;

      -- Stages 14 to 16: psi += eta_psi*pull, narrowed, unless held
      free     <= '1' when sat_d = 0 and sat_q = 0 else '0';
      measured <= voltage_known when current_at_rail = 0 else '0';
      learning <= run and free and measured;
      if valid(12) = '1' then
        psi_held <= slow_2 or not learning;
      end if;
      prod_psi <= step_14;
      sum_psi  <= moved_15;
      if valid(15) = '1' and psi_held = '0' then
        psi <= saturate(sum_psi(SUM_P_W - 1 downto DROP_ETA), STATE_W);
      end if;

      -- Stages 17, 18: psi_m = psi, narrowed
      end_17 <= at_end(psi, PU_W);
      if valid(17) = '1' then
        psi_m <= signed'('0' & half_17) + psi(STATE_W - 1 downto TO_PU);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        psi                 <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
