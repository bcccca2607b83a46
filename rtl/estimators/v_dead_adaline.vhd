-- Purpose: Adaline of the voltage that dead time and drops take from a leg, paper 000 eq. (10) and Fig. 4(a).
--   lp_u += k_lp*(u_pi_d - lp_u), u_h = u_pi_d - lp_u;  lp_d += k_lp*(d_d - lp_d), d_h = d_d - lp_d
--   e = u_h - v_dead*d_h;  v_dead += eta_v*d_h*e;  v_sum += zeta*v_dead while |v_dead| > v_thr
--   v_comp = limit(gamma*v_dead + v_sum);  v_leg = v_comp + v_dead
-- v_dead within +-v_comp_max; v_sum and v_comp from zero to v_comp_max, which is told.  Nothing learns while the
-- voltage is at its limit, a converter at its end, the voltage not known, the gates off or |i_d| + |i_q| < i_learn.
-- Seven products one after the other, through one multiplier.
-- Formats: lp S(1,28), u_h and d_h PU, e FLUX, d_h*e S(-4,21), v_dead and v_sum S(-1,38), v_comp and v_leg V_LEG.
-- Latency: 17.  Interval: 17.
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
  constant LATENCY     : positive := V_DEAD_ADALINE_LATENCY;
  constant STATE_W     : positive := V_DEAD_ADALINE_V_STATE_W;
  constant FINE_W      : positive := V_DEAD_ADALINE_V_FINE_W;
  constant STEP_W      : positive := V_DEAD_ADALINE_STEP_W;
  constant TO_LEG      : positive := V_DEAD_ADALINE_TO_LEG;
  constant FINE_TO_LEG : positive := V_DEAD_ADALINE_FINE_TO_LEG;

  -- State; fine: v_state rounded, as the next sample's model takes it too
  signal lp_u    : signed(INTEGRAL_W - 1 downto 0);
  signal lp_d    : signed(INTEGRAL_W - 1 downto 0);
  signal v_state : signed(STATE_W - 1 downto 0);
  signal fine    : signed(FINE_W - 1 downto 0);
  signal v_sum   : signed(STATE_W - 1 downto 0);

  signal valid     : std_logic_vector(0 to LATENCY);
  signal learning  : std_logic;
  signal length_1  : unsigned(PU_W downto 0);
  signal strong_2  : std_logic;
  signal mul_a     : signed(FLUX_W - 1 downto 0);
  signal mul_b     : signed(PU_W - 1 downto 0);
  signal prod      : signed(FLUX_W + PU_W - 1 downto 0);
  signal upper     : signed(V_LEG_W - 1 downto 0);
  signal lower     : signed(V_LEG_W - 1 downto 0);
  signal level     : signed(PU_W - 1 downto 0);
  signal u_h_2     : signed(PU_W - 1 downto 0);
  signal d_h_3     : signed(PU_W - 1 downto 0);
  signal moved_3   : signed(INTEGRAL_W downto 0);
  signal moved_4   : signed(INTEGRAL_W downto 0);
  signal rest_5    : signed(FLUX_W downto 0);
  signal e_6       : signed(FLUX_W - 1 downto 0);
  signal pull_8    : signed(STEP_W - 1 downto 0);
  signal sum_10    : signed(STATE_W + 1 downto 0);
  signal moved_10  : signed(STATE_W - 1 downto 0);
  signal adding_12 : std_logic;
  signal sum_13    : signed(STATE_W downto 0);
  signal asked_15  : signed(STATE_W + 2 downto 0);
  signal side_10   : signed(1 downto 0);
  signal side_13   : signed(1 downto 0);
  signal side_15   : signed(1 downto 0);
  signal leg_16    : signed(V_LEG_W + 1 downto 0);

  -- +1 above, -1 below +-limit, which counts from bit shift of x on.
  function side (x : signed; limit : unsigned; shift : positive) return signed is
    alias v       : signed(x'length - 1 downto 0) is x;
    variable more : std_logic;
    variable room : signed(x'length - shift downto 0);
  begin
    more := or v(shift - 1 downto 0);
    room := resize(v(v'high downto shift), room'length) + signed('0' & limit);
    if (v(v'high downto shift) & more) > signed('0' & limit & '0') then
      return "01";
    elsif room < 0 then
      return "11";
    end if;
    return "00";
  end function;
begin
  valid(0) <= in_valid;
  learning <= run and voltage_known and strong_2 when sat_d = 0 and sat_q = 0 and current_at_rail = 0 else '0';
  upper    <= signed('0' & v_comp_max);
  lower    <= -signed('0' & v_comp_max);

  mul_a <= signed(resize(k_lp, FLUX_W)) when valid(2) = '1' or valid(3) = '1' else
           e_6 when valid(6) = '1' else
           signed(resize(eta_v, FLUX_W)) when valid(8) = '1' else
           fine;
  mul_b <= u_h_2 when valid(2) = '1' else
           pull_8 when valid(8) = '1' else
           signed('0' & zeta) when valid(11) = '1' else
           signed('0' & gamma) when valid(12) = '1' else
           d_h_3;

  moved_3  <= plus_rounded(resize(lp_u, INTEGRAL_W + 1), prod, V_DEAD_ADALINE_DROP_LP);
  moved_4  <= plus_rounded(resize(lp_d, INTEGRAL_W + 1), prod, V_DEAD_ADALINE_DROP_LP);
  rest_5   <= minus_rounded(shift_left(resize(u_h_2, FLUX_W + 1), PU_TO_FLUX), prod, V_DEAD_ADALINE_DROP_MODEL);
  side_10  <= side(sum_10, v_comp_max, TO_LEG);
  moved_10 <= shift_left(resize(upper, STATE_W), TO_LEG) when side_10 > 0 else
              shift_left(resize(lower, STATE_W), TO_LEG) when side_10 < 0 else
              sum_10(STATE_W - 1 downto 0);
  side_13  <= side(sum_13, v_comp_max, TO_LEG);
  side_15  <= side(asked_15, v_comp_max, TO_LEG);
  leg_16   <= plus_rounded(resize(v_comp, V_LEG_W + 2), fine, FINE_TO_LEG);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: length = |i_d| + |i_q|;  strong = length >= i_learn
      if valid(0) = '1' then
        length_1 <= resize(unsigned(abs(i_d)), PU_W + 1) + unsigned(abs(i_q));
      end if;
      if valid(1) = '1' then
        strong_2 <= '0';
        if length_1 >= i_learn then
          strong_2 <= '1';
        end if;
      end if;

      -- Stages 1, 2: level = lp_u, then lp_d, narrowed
      if valid(0) = '1' then
        level <= round_sat(lp_u, PU_TO_INTEGRAL, PU_W);
      end if;
      if valid(1) = '1' then
        level <= round_sat(lp_d, PU_TO_INTEGRAL, PU_W);
      end if;

      -- Stages 2, 3: u_h = u_pi_d - level;  d_h = d_d - level
      if valid(1) = '1' then
        u_h_2 <= saturate(resize(u_pi_d, PU_W + 1) - level, PU_W);
      end if;
      if valid(2) = '1' then
        d_h_3 <= saturate(resize(d_d, PU_W + 1) - level, PU_W);
      end if;

      -- Stages 3, 4, 5, 7, 9, 12, 13: prod = k_lp*u_h, k_lp*d_h, fine*d_h, e*d_h, eta_v*pull, fine*zeta, fine*gamma
      if valid(2) = '1' or valid(3) = '1' or valid(4) = '1' or valid(6) = '1' or valid(8) = '1' or valid(11) = '1'
         or valid(12) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stages 4, 5: lp_u += prod;  lp_d += prod
      if valid(3) = '1' then
        lp_u <= saturate(moved_3, INTEGRAL_W);
        if run = '0' then
          lp_u <= (others => '0');
        end if;
      end if;
      if valid(4) = '1' then
        lp_d <= saturate(moved_4, INTEGRAL_W);
        if run = '0' then
          lp_d <= (others => '0');
        end if;
      end if;

      -- Stage 6: e = u_h - prod
      if valid(5) = '1' then
        e_6 <= saturate(rest_5, FLUX_W);
      end if;

      -- Stage 8: pull = prod, narrowed
      if valid(7) = '1' then
        pull_8 <= round_sat(prod, V_DEAD_ADALINE_DROP_STEP, STEP_W);
      end if;

      -- Stages 10, 11: v_state += prod;  fine = v_state, narrowed
      if valid(9) = '1' then
        sum_10 <= plus_rounded(resize(v_state, STATE_W + 2), prod, V_DEAD_ADALINE_DROP_ETA);
      end if;
      if valid(10) = '1' and learning = '1' then
        v_state <= moved_10;
        fine    <= resize(round_half_up(moved_10, V_DEAD_ADALINE_DROP_FINE), FINE_W);
      end if;

      -- Stage 12: adding = |fine| > v_thr
      if valid(11) = '1' then
        adding_12 <= '0';
        if side(fine, v_thr, FINE_TO_LEG) /= 0 then
          adding_12 <= learning;
        end if;
      end if;

      -- Stages 13, 14: v_sum += prod, limited
      if valid(12) = '1' then
        sum_13 <= resize(v_sum, STATE_W + 1);
        if adding_12 = '1' then
          sum_13 <= plus_rounded(resize(v_sum, STATE_W + 1), prod, V_DEAD_ADALINE_DROP_ZETA);
        end if;
      end if;
      if valid(13) = '1' then
        v_sum <= sum_13(STATE_W - 1 downto 0);
        if compensate = '0' then
          v_sum <= (others => '0');
        elsif side_13 > 0 then
          v_sum <= shift_left(resize(upper, STATE_W), TO_LEG);
        elsif sum_13 < 0 then
          v_sum <= (others => '0');
        end if;
      end if;

      -- Stage 15: asked = v_sum + prod
      if valid(14) = '1' then
        asked_15 <= plus_rounded(resize(v_sum, STATE_W + 3), prod, V_DEAD_ADALINE_DROP_GAMMA);
      end if;

      -- Stage 16: v_comp = asked, narrowed and limited; the rounding cannot move anything past the limit
      if valid(15) = '1' then
        v_comp         <= resize(round_half_up(asked_15, TO_LEG), V_LEG_W);
        v_comp_limited <= '0';
        if compensate = '0' or asked_15 < 0 then
          v_comp <= (others => '0');
        elsif side_15 > 0 then
          v_comp         <= upper;
          v_comp_limited <= '1';
        end if;
      end if;

      -- Stage 17: v_leg = v_comp + fine;  v_dead = fine, narrowed
      if valid(16) = '1' then
        v_leg  <= saturate(leg_16, V_LEG_W);
        v_dead <= round_sat(fine, FINE_TO_LEG, V_LEG_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        lp_u                <= (others => '0');
        lp_d                <= (others => '0');
        v_state             <= (others => '0');
        fine                <= (others => '0');
        v_sum               <= (others => '0');
        v_comp              <= (others => '0');
        v_leg               <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
