-- Purpose: Adaline of the voltage loss of a leg by dead time and drops, paper 000 eq. (10) and Fig. 4(a).
--   lp_u += k_lp*(u_pi_d - lp_u), u_h = u_pi_d - lp_u;  lp_d += k_lp*(d_d - lp_d), d_h = d_d - lp_d
--   e = u_h - v_dead*d_h;  v_dead += eta_v*d_h*e;  v_sum += zeta*v_dead while |v_dead| > v_thr
--   v_comp = limit(gamma*v_dead + v_sum);  v_leg = v_comp + v_dead
-- v_dead is within +-v_comp_max; v_sum and v_comp from zero to v_comp_max, reported by v_comp_limited.  v_dead and
-- v_sum are held while the voltage is at its limit, a converter at its end, the voltage not known, the gates off or
-- |i_d| + |i_q| < i_learn.
-- The filters share a multiplier, fine*d_h, d_h*e and eta_v*pull another, each with the adder behind it.
-- Formats: lp S(1,28), u_h and d_h PU, e FLUX, d_h*e S(-4,21), v_dead and v_sum S(-1,38), v_comp and v_leg V_LEG.
-- Latency: 29.  Interval: 29.
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
  constant LATENCY     : positive                        := V_DEAD_ADALINE_LATENCY;
  constant STATE_W     : positive                        := V_DEAD_ADALINE_V_STATE_W;
  constant FINE_W      : positive                        := V_DEAD_ADALINE_V_FINE_W;
  constant STEP_W      : positive                        := V_DEAD_ADALINE_STEP_W;
  constant DROP_LP     : positive                        := V_DEAD_ADALINE_DROP_LP;
  constant DROP_MODEL  : positive                        := V_DEAD_ADALINE_DROP_MODEL;
  constant DROP_STEP   : positive                        := V_DEAD_ADALINE_DROP_STEP;
  constant DROP_ETA    : positive                        := V_DEAD_ADALINE_DROP_ETA;
  constant DROP_ZETA   : positive                        := V_DEAD_ADALINE_DROP_ZETA;
  constant DROP_GAMMA  : positive                        := V_DEAD_ADALINE_DROP_GAMMA;
  constant TO_LEG      : positive                        := V_DEAD_ADALINE_TO_LEG;
  constant FINE_TO_LEG : positive                        := V_DEAD_ADALINE_FINE_TO_LEG;
  constant PROD_W      : positive                        := FLUX_W + PU_W;
  constant SUM_W       : positive                        := PROD_W + 1;
  constant SUM_Z_W     : positive                        := STATE_W + 1 + DROP_ZETA;
  constant LP_ZERO     : signed(INTEGRAL_W - 1 downto 0) := to_signed(2 ** (PU_TO_INTEGRAL - 1), INTEGRAL_W);

  -- State.  lp_u and lp_d share the registers and have a bias of half an LSB of PU, so that truncation rounds lp.
  -- fine is v_state rounded; the model of the next sample uses it.
  signal lp_next : signed(INTEGRAL_W - 1 downto 0);
  signal lp_last : signed(INTEGRAL_W - 1 downto 0);
  signal v_state : signed(STATE_W - 1 downto 0);
  signal v_sum   : signed(STATE_W - 1 downto 0);
  signal fine    : signed(FINE_W - 1 downto 0);

  signal valid     : std_logic_vector(0 to LATENCY);
  signal learning  : std_logic;
  signal free      : std_logic;                             -- the voltage is not at its limit
  signal measured  : std_logic;
  signal u_1       : signed(PU_W - 1 downto 0);
  signal d_1       : signed(PU_W - 1 downto 0);
  signal i_d_1     : signed(PU_W - 1 downto 0);
  signal i_q_1     : signed(PU_W - 1 downto 0);
  signal i_1       : signed(PU_W - 1 downto 0);
  signal size      : unsigned(PU_W downto 0);               -- |i_d| at clock 3, |i_d| + |i_q| at clock 4
  signal strong_5  : std_logic;
  signal x_1       : signed(PU_W - 1 downto 0);
  signal room      : signed(PU_W + 1 downto 0);
  signal diff      : signed(PU_W downto 0);                 -- complement of d_d - lp_d, then of u_pi_d - lp_u
  signal h         : signed(PU_W - 1 downto 0);             -- d_h at clock 3, u_h from clock 7 on
  signal k_lp_1    : unsigned(k_lp'range);
  signal prod_lp   : signed(k_lp'length + PU_W downto 0);
  signal sum_lp    : signed(k_lp'length + PU_W + 1 downto 0);
  signal moved     : signed(INTEGRAL_W - 1 downto 0);       -- lp_d at clock 5, lp_u at clock 9
  signal lp_under  : std_logic_vector(1 downto 0);          -- lp below the range of PU, one bit per half
  signal mul_a     : signed(FLUX_W - 1 downto 0);           -- fine at clock 7, e at clock 10, eta_v at clock 14
  signal mul_b     : signed(PU_W - 1 downto 0);             -- d_h at clock 7, pull at clock 14
  signal prod      : signed(PROD_W - 1 downto 0);
  signal addend    : signed(SUM_W - 1 downto 0);
  signal sum       : signed(SUM_W - 1 downto 0);
  signal e_9       : signed(FLUX_W - 1 downto 0);
  signal pull_13   : signed(SUM_W - 1 - DROP_STEP downto 0);
  signal past_13   : std_logic;
  signal v_16      : signed(STATE_W downto 0);
  signal past_17   : std_logic;
  signal under_17  : std_logic;
  signal end_17    : signed(V_LEG_W - 1 downto 0);
  signal adding_20 : std_logic;
  signal zeta_21   : unsigned(zeta'range);
  signal prod_z    : signed(FINE_W + zeta'length downto 0);
  signal sum_z     : signed(SUM_Z_W - 1 downto 0);
  signal v_sum_23  : signed(STATE_W downto 0);
  signal past_24   : std_logic;
  signal under_24  : std_logic;
  signal prod_g    : signed(FINE_W + gamma'length downto 0);
  signal sum_g     : signed(FINE_W + gamma'length + 2 downto 0);
  signal v_26      : signed(FINE_W + gamma'length + 2 - DROP_GAMMA downto 0);
  signal past_27   : std_logic;
  signal under_27  : std_logic;

  -- so_far + |x|: so_far - x for a negative x, otherwise so_far - not x - 1.
  function longer (so_far : unsigned; x : signed) return unsigned is
    variable less : signed(so_far'length - 1 downto 0);
    variable both : signed(so_far'length downto 0);
  begin
    less := resize(x xor not x(x'high), so_far'length);
    both := signed(so_far & '0') - (less & not x(x'high));
    return unsigned(both(so_far'length downto 1));
  end function;

  -- '1' if a positive v >= v_comp_max; if equal, setting it to v_comp_max changes nothing.
  function at_limit (v : signed; v_comp_max : unsigned) return std_logic is
    alias u       : signed(v'length - 1 downto 0) is v;
    variable room : signed(v'length - TO_LEG + 1 downto 0);
  begin
    room := signed(resize(v_comp_max & '0', room'length)) - resize(u(u'high downto TO_LEG) & '1', room'length);
    return room(room'high);
  end function;
begin
  valid(0) <= in_valid;

  i_1 <= i_q_1 when valid(3) = '1' else i_d_1;
  x_1 <= u_1 when valid(5) = '1' else d_1;

  -- lp - x - 1
  room <= (resize(lp_next(INTEGRAL_W - 1 downto PU_TO_INTEGRAL), PU_W + 1) & '0') - (resize(x_1, PU_W + 1) & '1');

  -- A low-pass with k_lp < 1 exceeds the range of its input by at most half an LSB of PU.  At the upper end INTEGRAL
  -- has the bits for it; at the lower end lp would lose its bias of half an LSB, which lp_under detects and restores.
  moved <= sum_lp(INTEGRAL_W - 1 + DROP_LP downto DROP_LP);

  e_9      <= saturate(not sum(SUM_W - 1 downto DROP_MODEL), FLUX_W);
  v_16     <= sum(STATE_W + DROP_ETA downto DROP_ETA);
  end_17   <= -signed('0' & v_comp_max) when under_17 = '1' else signed('0' & v_comp_max);
  v_sum_23 <= sum_z(SUM_Z_W - 1 downto DROP_ZETA);
  v_26     <= sum_g(sum_g'high downto DROP_GAMMA);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the inputs, which come from other blocks
      u_1      <= u_pi_d;
      d_1      <= d_d;
      i_d_1    <= i_d;
      i_q_1    <= i_q;
      k_lp_1   <= k_lp;
      free     <= '1' when sat_d = 0 and sat_q = 0 else '0';
      measured <= voltage_known when current_at_rail = 0 else '0';

      -- Clock 6 on: whether the Adaline learns from this sample
      learning <= run and free and measured and strong_5;

      -- Stages 2 to 5: size = |i_d| + |i_q|;  strong = size >= i_learn
      if valid(1) = '1' then
        size <= (others => '0');
      elsif valid(2) = '1' or valid(3) = '1' then
        size <= longer(size, i_1);
      end if;
      if valid(4) = '1' then
        strong_5 <= '0';
        if size >= i_learn then
          strong_5 <= '1';
        end if;
      end if;

      -- Stages 2, 3: d_h = d_d - lp_d;  stages 6, 7: u_h = u_pi_d - lp_u, which is needed later
      if valid(1) = '1' or valid(5) = '1' then
        diff <= room(PU_W + 1 downto 1);
      end if;
      if valid(2) = '1' or valid(6) = '1' then
        h <= saturate(not diff, PU_W);
      end if;

      -- Stages 4 to 8, 8 to 12: lp_d += k_lp*d_h, lp_u += k_lp*u_h
      if valid(3) = '1' or valid(7) = '1' then
        prod_lp <= signed('0' & k_lp_1) * h;
      end if;
      if valid(4) = '1' or valid(8) = '1' then
        sum_lp  <= rounding_base(lp_next, DROP_LP, sum_lp'length) + prod_lp;
        lp_next <= lp_last;
      end if;
      if valid(5) = '1' or valid(9) = '1' then
        lp_last <= moved;
      end if;
      lp_under(1) <= lp_last(INTEGRAL_W - 1) and not (or lp_last(INTEGRAL_W - 2 downto INTEGRAL_W - PU_W / 2));
      lp_under(0) <= not (or lp_last(INTEGRAL_W - PU_W / 2 - 1 downto PU_TO_INTEGRAL - 1));
      if (valid(7) = '1' or valid(11) = '1') and lp_under = "11" then
        lp_last(PU_TO_INTEGRAL - 1 downto 0) <= LP_ZERO(PU_TO_INTEGRAL - 1 downto 0);
      end if;
      if (valid(7) = '1' or valid(11) = '1') and run = '0' then
        lp_last <= LP_ZERO;
      end if;

      -- Stages 7, 10, 14: fine and d_h, e and d_h, eta_v and pull
      if valid(6) = '1' or valid(9) = '1' or valid(13) = '1' then
        mul_a <= signed(resize(eta_v, FLUX_W));
        if valid(6) = '1' then
          mul_a <= fine;
        end if;
        if valid(9) = '1' then
          mul_a <= e_9;
        end if;
      end if;
      if valid(12) = '1' then
        pull_13 <= sum(SUM_W - 1 downto DROP_STEP);
        past_13 <= exceeds(sum(SUM_W - 1 downto DROP_STEP), STEP_W);
      end if;
      if valid(6) = '1' or valid(13) = '1' then
        mul_b <= narrowed(pull_13, past_13, STEP_W) when valid(13) = '1' else h;
      end if;

      -- Stages 8, 11, 15: prod = fine*d_h, e*d_h, eta_v*pull
      if valid(7) = '1' or valid(10) = '1' or valid(14) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stages 9, 12, 16: sum = not e = not u_h + prod, pull, v_state + prod
      if valid(10) = '1' then
        addend <= rounding_base("0", DROP_STEP, SUM_W);
      end if;
      if valid(7) = '1' then
        addend <= rounding_base(not shift_left(resize(h, FLUX_W), PU_TO_FLUX), DROP_MODEL, SUM_W);
      end if;
      if valid(14) = '1' then
        addend <= rounding_base(v_state, DROP_ETA, SUM_W);
      end if;
      if valid(8) = '1' or valid(11) = '1' or valid(15) = '1' then
        sum <= addend + prod;
      end if;

      -- Stages 17, 18: v_state = sum, limited
      if valid(16) = '1' then
        past_17  <= at_limit(v_16 xor v_16(v_16'high), v_comp_max);
        under_17 <= v_16(v_16'high);
      end if;
      if valid(16) = '1' and learning = '1' then
        v_state <= v_16(STATE_W - 1 downto 0);
      end if;
      if valid(17) = '1' and learning = '1' and past_17 = '1' then
        v_state <= shift_left(resize(end_17, STATE_W), TO_LEG);
      end if;

      -- Stage 19: fine = v_state, narrowed
      if valid(18) = '1' then
        fine <= resize(round_half_up(v_state, V_DEAD_ADALINE_DROP_FINE), FINE_W);
      end if;

      -- Stages 20, 21: zeta if |fine| > v_thr;  stages 22, 23: sum_z = v_sum + zeta*fine
      if valid(19) = '1' then
        adding_20 <= beyond(fine, v_thr, FINE_TO_LEG);
      end if;
      if valid(20) = '1' then
        zeta_21 <= zeta;
        if adding_20 = '0' or learning = '0' then
          zeta_21 <= (others => '0');
        end if;
      end if;
      if valid(21) = '1' then
        prod_z <= fine * signed('0' & zeta_21);
      end if;
      if valid(22) = '1' then
        sum_z <= rounding_base(v_sum, DROP_ZETA, SUM_Z_W) + prod_z;
      end if;

      -- Stages 24, 25: v_sum = sum_z, limited
      if valid(23) = '1' then
        past_24  <= at_limit(v_sum_23, v_comp_max);
        under_24 <= v_sum_23(v_sum_23'high) or not compensate;
        v_sum    <= v_sum_23(STATE_W - 1 downto 0);
      end if;
      if valid(24) = '1' and past_24 = '1' then
        v_sum <= shift_left(resize(signed('0' & v_comp_max), STATE_W), TO_LEG);
      end if;
      if valid(24) = '1' and under_24 = '1' then
        v_sum <= (others => '0');
      end if;

      -- Stages 25, 26: sum_g = v_sum + gamma*fine
      if valid(24) = '1' then
        prod_g <= fine * signed('0' & gamma);
      end if;
      if valid(25) = '1' then
        sum_g <= rounding_base(v_sum, DROP_GAMMA, sum_g'length) + prod_g;
      end if;

      -- Stages 27, 28: v_comp = sum_g, narrowed and limited; the rounding cannot move a value beyond the limit
      if valid(26) = '1' then
        past_27        <= beyond(v_26, v_comp_max, TO_LEG);
        under_27       <= v_26(v_26'high) or not compensate;
        v_comp         <= resize(round_half_up(v_26, TO_LEG), V_LEG_W);
        v_comp_limited <= '0';
      end if;
      if valid(27) = '1' and past_27 = '1' then
        v_comp         <= signed('0' & v_comp_max);
        v_comp_limited <= '1';
      end if;
      if valid(27) = '1' and under_27 = '1' then
        v_comp         <= (others => '0');
        v_comp_limited <= '0';
      end if;

      -- Stages 28, 29: v_dead = fine, narrowed;  v_leg = v_comp + v_dead
      if valid(27) = '1' then
        v_dead <= resize(round_half_up(fine, FINE_TO_LEG), V_LEG_W);
      end if;
      if valid(28) = '1' then
        v_leg <= saturate(resize(v_comp, V_LEG_W + 1) + v_dead, V_LEG_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        lp_next             <= LP_ZERO;
        lp_last             <= LP_ZERO;
        v_state             <= (others => '0');
        v_sum               <= (others => '0');
        fine                <= (others => '0');
        v_comp              <= (others => '0');
        v_leg               <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
