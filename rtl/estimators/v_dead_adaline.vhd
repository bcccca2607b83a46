-- Purpose: Adaline of the voltage that dead time and drops take from a leg, paper 000 eq. (10) and Fig. 4(a).
--   lp_u += k_lp*(u_pi_d - lp_u), u_h = u_pi_d - lp_u;  lp_d += k_lp*(d_d - lp_d), d_h = d_d - lp_d
--   e = u_h - v_dead*d_h;  v_dead += eta_v*d_h*e;  v_sum += zeta*v_dead while |v_dead| > v_thr
--   v_comp = limit(gamma*v_dead + v_sum);  v_leg = v_comp + v_dead
-- v_dead within +-v_comp_max; v_sum and v_comp from zero to v_comp_max, which is told.  Nothing learns while the
-- voltage is at its limit, a converter at its end, the voltage not known, the gates off or |i_d| + |i_q| < i_learn.
-- Eight products one after the other, through one multiplier and the adder behind it: sum = addend + mul_a*mul_b.
-- Formats: lp S(1,28), u_h and d_h PU, e FLUX, d_h*e S(-4,21), v_dead and v_sum S(-1,38), v_comp and v_leg V_LEG.
-- Latency: 24.  Interval: 24.
-- Rounding: half up.

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
    out_valid       : out std_logic;
    v_dead          : out signed(V_LEG_W - 1 downto 0);
    v_comp          : out signed(V_LEG_W - 1 downto 0);
    v_leg           : out signed(V_LEG_W - 1 downto 0);
    v_comp_limited  : out std_logic
  );
end entity v_dead_adaline;

architecture rtl of v_dead_adaline is
  constant LATENCY     : positive                     := V_DEAD_ADALINE_LATENCY;
  constant STATE_W     : positive                     := V_DEAD_ADALINE_V_STATE_W;
  constant FINE_W      : positive                     := V_DEAD_ADALINE_V_FINE_W;
  constant STEP_W      : positive                     := V_DEAD_ADALINE_STEP_W;
  constant DROP_LP     : positive                     := V_DEAD_ADALINE_DROP_LP;
  constant DROP_MODEL  : positive                     := V_DEAD_ADALINE_DROP_MODEL;
  constant DROP_STEP   : positive                     := V_DEAD_ADALINE_DROP_STEP;
  constant DROP_ETA    : positive                     := V_DEAD_ADALINE_DROP_ETA;
  constant DROP_ZETA   : positive                     := V_DEAD_ADALINE_DROP_ZETA;
  constant DROP_GAMMA  : positive                     := V_DEAD_ADALINE_DROP_GAMMA;
  constant TO_LEG      : positive                     := V_DEAD_ADALINE_TO_LEG;
  constant FINE_TO_LEG : positive                     := V_DEAD_ADALINE_FINE_TO_LEG;
  constant SUM_W       : positive                     := 48;
  constant ONE         : positive                     := DROP_STEP - FINE_TO_LEG;  -- fine*2**ONE drops what d_h*e does
  constant TO_ZETA     : natural                      := DROP_ZETA - DROP_LP;        -- k_lp*2**TO_ZETA as zeta does
  constant LP_ZERO     : signed(STATE_W - 1 downto 0) := to_signed(2 ** (PU_TO_INTEGRAL - 1), STATE_W);

  -- State; lp_u, lp_d and v_sum take turns at one scale: next, then, last.  lp holds half an LSB of PU more, so that
  -- its upper bits are lp rounded.  Fine: v_state rounded, as the next sample's model takes it too.
  signal turn_next : signed(STATE_W - 1 downto 0);
  signal turn_then : signed(STATE_W - 1 downto 0);
  signal turn_last : signed(STATE_W - 1 downto 0);
  signal v_state   : signed(STATE_W - 1 downto 0);
  signal fine      : signed(FINE_W - 1 downto 0);

  signal valid     : std_logic_vector(0 to LATENCY);
  signal learning  : std_logic;
  signal i_0       : signed(PU_W - 1 downto 0);
  signal size      : unsigned(PU_W downto 0);           -- |i_d| at clock 2, |i_d| + |i_q| at clock 3
  signal strong_4  : std_logic;
  signal x_0       : signed(PU_W - 1 downto 0);
  signal diff      : signed(PU_W downto 0);             -- complement of u_pi_d - lp_u, of d_d - lp_d
  signal h         : signed(PU_W - 1 downto 0);
  signal u_h_2     : signed(PU_W - 1 downto 0);
  signal factor_b  : signed(PU_W - 1 downto 0);
  signal mul_a     : signed(FLUX_W - 1 downto 0);
  signal mul_b     : signed(PU_W - 1 downto 0);
  signal prod      : signed(FLUX_W + PU_W - 1 downto 0);
  signal addend    : signed(SUM_W - 1 downto 0);
  signal sum       : signed(SUM_W - 1 downto 0);
  signal moved     : signed(STATE_W downto 0);          -- lp_u at clock 4, lp_d at clock 8, v_sum at clock 20
  signal lp_0      : signed(PU_W - 1 downto 0);
  signal lp_under  : std_logic;
  signal e_9       : signed(FLUX_W - 1 downto 0);
  signal pull_12   : signed(STEP_W - 1 downto 0);
  signal v         : signed(STATE_W + 2 downto 0);       -- v_state moved at clock 15, v_comp asked for at clock 22
  signal v_past    : std_logic;
  signal v_end_15  : signed(V_LEG_W - 1 downto 0);
  signal adding_17 : std_logic;
  signal zeta_17   : signed(PU_W - 1 downto 0);
  signal dead_23   : signed(V_LEG_W - 1 downto 0);

  -- so_far + |x|; what the complement of a negative x lacks comes as a carry.
  function longer (so_far : unsigned; x : signed) return unsigned is
    variable more : unsigned(so_far'length - 1 downto 0);
    variable both : unsigned(so_far'length downto 0);
  begin
    more := resize(unsigned(x xor x(x'high)), so_far'length);
    both := (more & x(x'high)) + (so_far & x(x'high));
    return both(so_far'length downto 1);
  end function;
begin
  valid(0) <= in_valid;
  learning <= run and voltage_known and strong_4 when sat_d = 0 and sat_q = 0 and current_at_rail = 0 else '0';

  i_0 <= i_q when valid(2) = '1' else i_d;
  x_0 <= d_d when valid(4) = '1' else u_pi_d;
  h   <= saturate(not diff, PU_W);

  lp_0 <= turn_next(INTEGRAL_W - 1 downto PU_TO_INTEGRAL);

  adding_17 <= learning and beyond(fine, v_thr, FINE_TO_LEG);
  zeta_17   <= signed('0' & zeta) when adding_17 = '1' else (others => '0');

  factor_b <= h when valid(1) = '1' or valid(5) = '1' else
              pull_12 when valid(12) = '1' else
              zeta_17 when valid(17) = '1' else
              signed('0' & gamma) when valid(18) = '1' else
              to_signed(2 ** ONE, PU_W);

  addend <= rounding_base(turn_next, DROP_ZETA, SUM_W) when valid(3) = '1' or valid(7) = '1' or valid(19) = '1' else
            rounding_base(not shift_left(resize(u_h_2, FLUX_W), PU_TO_FLUX), DROP_MODEL, SUM_W) when valid(8) = '1' else
            rounding_base(v_state, DROP_ETA, SUM_W) when valid(14) = '1' else
            rounding_base(turn_last, DROP_GAMMA, SUM_W) when valid(21) = '1' else
            rounding_base("0", DROP_STEP, SUM_W);

  -- A low-pass with k_lp < 1 leaves the range of what it filters by half an LSB of PU at most: that is within
  -- INTEGRAL at the upper end of PU, and below its lower end where lp, which is half an LSB more, has no such bit.
  moved    <= sum(SUM_W - 1 downto DROP_ZETA);
  lp_under <= moved(INTEGRAL_W - 1) and not (or moved(INTEGRAL_W - 2 downto PU_TO_INTEGRAL - 1));
  e_9      <= saturate(not sum(SUM_W - 1 downto DROP_MODEL), FLUX_W);
  pull_12  <= saturate(sum(SUM_W - 1 downto DROP_STEP), STEP_W);
  v        <= sum(STATE_W + 2 + DROP_ETA downto DROP_ETA);
  v_past   <= beyond(v, v_comp_max, TO_LEG);
  v_end_15 <= -signed('0' & v_comp_max) when v < 0 else signed('0' & v_comp_max);
  dead_23  <= sum(V_LEG_W - 1 + DROP_STEP downto DROP_STEP);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1 to 4: size = |i_d| + |i_q|;  strong = size >= i_learn
      if valid(0) = '1' then
        size <= (others => '0');
      elsif valid(1) = '1' or valid(2) = '1' then
        size <= longer(size, i_0);
      end if;
      if valid(3) = '1' then
        strong_4 <= '0';
        if size >= i_learn then
          strong_4 <= '1';
        end if;
      end if;

      -- Stages 1, 2: u_h = u_pi_d - lp_u;  stages 5, 6: d_h = d_d - lp_d, which stays in mul_b until clock 12
      if valid(0) = '1' or valid(4) = '1' then
        diff <= (not resize(x_0, PU_W + 1)) + lp_0;
      end if;
      if valid(1) = '1' then
        u_h_2 <= h;
        mul_a <= shift_left(signed(resize(k_lp, FLUX_W)), TO_ZETA);
      end if;
      if (valid(1) or valid(5) or valid(12) or valid(17) or valid(18) or valid(19)) = '1' then
        mul_b <= factor_b;
      end if;

      -- Stages 3, 7, 8, 11, 14, 19, 20, 22: prod = k_lp*u_h, k_lp*d_h, fine*d_h, e*d_h, eta_v*pull, fine*zeta,
      -- fine*gamma, fine*2**ONE
      if (valid(2) or valid(6) or valid(7) or valid(10) or valid(13) or valid(18) or valid(19) or valid(21)) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stages 4, 8, 9, 12, 15, 20, 22, 23: sum = addend + prod
      if (valid(3) or valid(7) or valid(8) or valid(11) or valid(14) or valid(19) or valid(21) or valid(22)) = '1' then
        sum <= addend + prod;
      end if;

      -- Stages 4, 5, 8, 9, 20, 21: lp_u += k_lp*u_h, lp_d += k_lp*d_h, v_sum += zeta*fine where it adds; limited
      if valid(3) = '1' or valid(7) = '1' or valid(19) = '1' then
        turn_next <= turn_then;
        turn_then <= turn_last;
      end if;
      if valid(4) = '1' or valid(8) = '1' or valid(20) = '1' then
        turn_last <= moved(STATE_W - 1 downto 0);
      end if;
      if (valid(4) = '1' or valid(8) = '1') and lp_under = '1' then
        turn_last(PU_TO_INTEGRAL - 1 downto 0) <= LP_ZERO(PU_TO_INTEGRAL - 1 downto 0);
      end if;
      if (valid(4) = '1' or valid(8) = '1') and run = '0' then
        turn_last <= LP_ZERO;
      end if;
      if valid(20) = '1' and beyond(moved, v_comp_max, TO_LEG) = '1' then
        turn_last <= shift_left(resize(signed('0' & v_comp_max), STATE_W), TO_LEG);
      end if;
      if valid(20) = '1' and (compensate = '0' or moved < 0) then
        turn_last <= (others => '0');
      end if;

      -- Stages 9, 10: e = u_h - fine*d_h
      if valid(6) = '1' then
        mul_a <= fine;
      end if;
      if valid(9) = '1' then
        mul_a <= e_9;
      end if;

      -- Stages 12, 13: pull = e*d_h
      if valid(12) = '1' then
        mul_a <= signed(resize(eta_v, FLUX_W));
      end if;

      -- Stages 15 to 17: v_state += eta_v*pull, limited;  fine = v_state, narrowed
      if valid(15) = '1' and learning = '1' then
        v_state <= v(STATE_W - 1 downto 0);
      end if;
      if valid(15) = '1' and learning = '1' and v_past = '1' then
        v_state <= shift_left(resize(v_end_15, STATE_W), TO_LEG);
      end if;
      if valid(16) = '1' then
        fine <= resize(round_half_up(v_state, V_DEAD_ADALINE_DROP_FINE), FINE_W);
      end if;

      -- Stage 18: fine, and zeta where |fine| > v_thr
      if valid(17) = '1' then
        mul_a <= fine;
      end if;

      -- Stages 22, 23: v_comp = v_sum + fine*gamma, narrowed and limited; the rounding moves nothing past the limit
      if valid(22) = '1' then
        v_comp         <= resize(round_half_up(v, TO_LEG), V_LEG_W);
        v_comp_limited <= '0';
        if v_past = '1' then
          v_comp         <= signed('0' & v_comp_max);
          v_comp_limited <= '1';
        end if;
      end if;
      if valid(22) = '1' and (compensate = '0' or v < 0) then
        v_comp         <= (others => '0');
        v_comp_limited <= '0';
      end if;

      -- Stages 23, 24: v_dead = fine, narrowed;  v_leg = v_comp + v_dead
      if valid(23) = '1' then
        v_dead <= dead_23;
        v_leg  <= saturate(resize(v_comp, V_LEG_W + 1) + dead_23, V_LEG_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        turn_next           <= LP_ZERO;
        turn_then           <= LP_ZERO;
        turn_last           <= (others => '0');
        v_state             <= (others => '0');
        fine                <= (others => '0');
        v_comp              <= (others => '0');
        v_leg               <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
