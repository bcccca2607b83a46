-- Purpose: merge of voltage and current models in the stator frame, paper 001 eq. (7); alpha first, then beta.
--   lambda = carried - rho*i;  eps = lambda_c - lambda;  y = omega_0*eps;  x += omega_0*y
--   carried = lambda_m = lambda + 2*xi*y + x + t_s*u_applied - rho*i
-- If the voltage of the last period is not known or the gates are off: lambda = lambda_c, x = 0.
-- Formats: carried S(1,30), eps and u FLUX, y S(-1,25), x S(-3,36); products exact.
-- Latency: 31 (alpha, then beta).  Interval: 31.
-- Each sum with a product is formed by the adder behind the multiplier.  One register per axis contains the flux in all
-- steps: carried, lambda, the total, the new carried.
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
    minus_rho       : in  signed(MINUS_RHO_W - 1 downto 0);
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
  constant LATENCY  : positive := FLUX_MERGE_LATENCY;
  constant DROP_RHO : positive := FLUX_MERGE_DROP_RHO;
  constant DROP_Y   : positive := FLUX_MERGE_DROP_Y;
  constant DROP_X   : positive := FLUX_MERGE_DROP_X;
  constant DROP_XI  : positive := FLUX_MERGE_DROP_XI;
  constant DROP_U   : positive := FLUX_MERGE_DROP_U;
  constant X_W      : positive := FLUX_MERGE_X_W;
  constant TOTAL_W  : positive := FLUX_STATE_W + 3;
  constant SUM_R_W  : positive := TOTAL_W + DROP_RHO + 1;
  constant PROD_Y_W : positive := FLUX_W + omega_0'length + 1;
  constant PROD_X_W : positive := FLUX_MERGE_Y_W + omega_0'length + 1;
  constant SUM_U_W  : positive := TOTAL_W + DROP_U + 1;
  constant TURN     : positive := 14;  -- delay of beta behind alpha, clocks

  -- One LSB less than half: -rho*i is rounded half down, because rho*i is rounded half up.
  constant HALF_DOWN : signed(DROP_RHO - 1 downto 0) := (DROP_RHO - 1 => '0', others => '1');

  -- Sources of the register flux
  constant LESS_DROP : std_logic_vector(1 downto 0) := "00";
  constant MODEL     : std_logic_vector(1 downto 0) := "01";
  constant TOTAL     : std_logic_vector(1 downto 0) := "10";
  constant OTHER     : std_logic_vector(1 downto 0) := "11";

  -- State, with merge_known; the two axes share the registers: the next axis, and the other
  signal flux       : signed(TOTAL_W - 1 downto 0);
  signal flux_other : signed(TOTAL_W - 1 downto 0);
  signal x          : signed(X_W - 1 downto 0);
  signal x_other    : signed(X_W - 1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal step       : std_logic_vector(0 to LATENCY - TURN);  -- valid bits of both axes
  signal beta       : std_logic;
  signal trusted    : std_logic;
  signal limited    : std_logic;  -- by any stage of either axis
  signal limits     : std_logic_vector(2 downto 0);  -- limit reached: lambda, eps, x
  signal moves      : std_logic;  -- flux is loaded
  signal source     : std_logic_vector(1 downto 0);  -- source of flux at its next load
  signal i_1        : signed(PU_W - 1 downto 0);
  signal lambda_c_1 : signed(FLUX_W - 1 downto 0);
  signal u_1        : signed(FLUX_W - 1 downto 0);
  signal t_s_1      : unsigned(t_s'range);
  signal omega_0_1  : unsigned(omega_0'range);
  signal prod_r_2   : signed(PU_W + MINUS_RHO_W - 1 downto 0);
  signal prod_u_2   : signed(FLUX_W + SAMPLE_TIME_W downto 0);
  signal sum_r      : signed(SUM_R_W - 1 downto 0);  -- at clock 3, then at clock 14
  signal less_r     : signed(TOTAL_W downto 0);
  signal top        : std_logic_vector(1 downto 0);  -- flux a clock ago is at the end of its range, by halves
  signal rounded    : signed(FLUX_STATE_W downto FLUX_TO_STATE);
  signal diff_5     : signed(FLUX_W + 1 downto 0);
  signal eps_6      : signed(FLUX_W downto 0);
  signal eps_7      : signed(FLUX_W - 1 downto 0);
  signal prod_y_8   : signed(PROD_Y_W - 1 downto 0);
  signal sum_y_9    : signed(PROD_Y_W - 1 downto 0);
  signal y_9        : signed(FLUX_MERGE_Y_W - 1 downto 0);
  signal prod_x_10  : signed(PROD_X_W - 1 downto 0);
  signal prod_xi_10 : signed(PROD_X_W - 1 downto 0);
  signal sum_x_11   : signed(PROD_X_W downto 0);
  signal moved_11   : signed(PROD_X_W - DROP_X downto 0);
  signal sum_xi_11  : signed(PROD_X_W downto 0);
  signal sum_u_12   : signed(SUM_U_W - 1 downto 0);
  signal total_12   : signed(TOTAL_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  step     <= valid(0 to LATENCY - TURN) or valid(TURN to LATENCY);
  trusted  <= merge_known and run;

  less_r   <= sum_r(SUM_R_W - 1 downto DROP_RHO);
  y_9      <= sum_y_9(y_9'length - 1 + DROP_Y downto DROP_Y);
  moved_11 <= sum_x_11(PROD_X_W downto DROP_X);
  total_12 <= plus_rounded(sum_u_12(TOTAL_W - 1 + DROP_U downto DROP_U), x_other, FLUX_MERGE_X_TO_STATE);

  -- lambda_c - rounded flux, with one carry: the first bit of flux below the LSB, unless flux is at its end.
  diff_5 <= (lambda_c_1(FLUX_W - 1) & lambda_c_1 & '0')
            - (resize(flux(FLUX_STATE_W - 1 downto FLUX_TO_STATE), FLUX_W + 1)
               & (flux(FLUX_TO_STATE - 1) and not (and top)));

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- The axis that enters: alpha at clock 0, beta at clock TURN
      if valid(TURN - 1) = '1' then
        beta <= '1';
      end if;
      if valid(TURN) = '1' then
        beta <= '0';
      end if;

      -- Stage 1: the inputs of the axis;  local copies of settings, whose registers are far away
      t_s_1     <= t_s;
      omega_0_1 <= omega_0;
      if step(0) = '1' then
        i_1        <= i_beta when beta = '1' else i_alpha;
        lambda_c_1 <= lambda_c_beta when beta = '1' else lambda_c_alpha;
        u_1        <= u_applied_beta when beta = '1' else u_applied_alpha;
      end if;

      -- Stage 2: prod_r = -rho*i;  prod_u = t_s*u_applied
      if step(1) = '1' then
        prod_r_2 <= i_1 * minus_rho;
        prod_u_2 <= u_1 * signed('0' & t_s_1);
      end if;

      -- Stages 3, 14: sum_r = flux + prod_r: carried - rho*i, total - rho*i
      if step(2) = '1' or step(13) = '1' then
        sum_r <= resize(flux & HALF_DOWN, SUM_R_W) + prod_r_2;
      end if;

      -- Stage 4: flux = lambda: sum_r, narrowed, or lambda_c;  stage 13: the total;  stage 15: sum_r, narrowed;
      -- stage 16: the flux of the other axis
      source <= LESS_DROP;
      if step(2) = '1' and trusted = '0' then
        source <= MODEL;
      end if;
      if step(11) = '1' then
        source <= TOTAL;
      end if;
      if step(14) = '1' then
        source <= OTHER;
      end if;
      moves <= step(2) or step(11) or step(13) or step(14);
      if moves = '1' then
        if source(1) = '0' then
          flux <= resize(saturate(less_r, FLUX_STATE_W), TOTAL_W);
          if source(0) = '1' then
            flux <= shift_left(resize(lambda_c_1, TOTAL_W), FLUX_TO_STATE);
          end if;
        else
          flux <= total_12;
          if source(0) = '1' then
            flux <= flux_other;
          end if;
        end if;
      end if;
      if step(15) = '1' then
        flux_other <= flux;
      end if;
      limits(0) <= ((step(3) and trusted) or step(14)) and exceeds(less_r, FLUX_STATE_W);

      -- Stages 5, 16: at the end of the range rounding would overflow, so it is suppressed there.
      top(1) <= not flux(FLUX_STATE_W - 1) and (and flux(FLUX_STATE_W - 2 downto FLUX_STATE_W / 2));
      top(0) <= and flux(FLUX_STATE_W / 2 - 1 downto FLUX_TO_STATE - 1);

      -- Stages 6, 7: eps = lambda_c - lambda
      if step(5) = '1' then
        eps_6 <= diff_5(FLUX_W + 1 downto 1);
      end if;
      if step(6) = '1' then
        eps_7 <= saturate(eps_6, FLUX_W);
      end if;
      limits(1) <= step(6) and exceeds(eps_6, FLUX_W);

      -- Stages 8, 9: y = omega_0*eps; |eps| <= 2 and omega_0 < 1/4, so it fits
      if step(7) = '1' then
        prod_y_8 <= eps_7 * signed('0' & omega_0_1);
      end if;
      if step(8) = '1' then
        sum_y_9 <= rounding_base("0", DROP_Y, PROD_Y_W) + prod_y_8;
      end if;

      -- Stage 10: prod_x = omega_0*y;  prod_xi = xi*y
      if step(9) = '1' then
        prod_x_10  <= y_9 * signed('0' & omega_0);
        prod_xi_10 <= y_9 * signed('0' & xi);
      end if;

      -- Stage 11: sum_x = x + prod_x;  sum_xi = lambda + 2*prod_xi
      if step(10) = '1' then
        sum_x_11  <= rounding_base(x, DROP_X, PROD_X_W + 1) + prod_x_10;
        sum_xi_11 <= rounding_base(flux(FLUX_STATE_W - 1 downto 0), DROP_XI, PROD_X_W + 1) + prod_xi_10;
      end if;

      -- Stage 12: x = sum_x, narrowed;  sum_u = sum_xi + prod_u;  stage 1: x = 0 if lambda is not known
      if step(11) = '1' then
        x        <= x_other;
        x_other  <= saturate(moved_11, X_W);
        sum_u_12 <= rounding_base(sum_xi_11(PROD_X_W downto DROP_XI), DROP_U, SUM_U_W) + prod_u_2;
      end if;
      limits(2) <= step(11) and exceeds(moved_11, X_W);
      limited   <= (or limits) or (limited and not valid(0));
      if valid(0) = '1' and trusted = '0' then
        x       <= (others => '0');
        x_other <= (others => '0');
      end if;

      -- Stage 17: lambda_m = the carried flux, narrowed; alpha at clock 17, beta at 31
      if valid(16) = '1' then
        lambda_m_alpha <= rounded(FLUX_STATE_W - 1 downto FLUX_TO_STATE);
      end if;
      if valid(LATENCY - 1) = '1' then
        lambda_m_beta <= rounded(FLUX_STATE_W - 1 downto FLUX_TO_STATE);
        merge_known   <= voltage_known;
        merge_limited <= limited;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        beta                <= '0';
        flux                <= (others => '0');
        flux_other          <= (others => '0');
        x                   <= (others => '0');
        x_other             <= (others => '0');
        lambda_m_alpha      <= (others => '0');
        lambda_m_beta       <= (others => '0');
        merge_known         <= '0';
      end if;
    end if;
  end process;

  rounded <= signed'('0' & (flux_other(FLUX_TO_STATE - 1) and not (and top)))
             + resize(flux_other(FLUX_STATE_W - 1 downto FLUX_TO_STATE), rounded'length);

  out_valid <= valid(LATENCY);

end architecture rtl;
