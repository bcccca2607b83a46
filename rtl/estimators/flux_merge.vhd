-- Purpose: merge of voltage and current models in the stator frame, paper 001 eq. (7); alpha first, then beta.
--   lambda = carried - rho*i;  eps = lambda_c - lambda;  y = omega_0*eps;  x += omega_0*y
--   carried = lambda_m = lambda + 2*xi*y + x + t_s*u_applied - rho*i
-- Where the voltage of the last period is not known or the gates are off: lambda = lambda_c, x = 0.
-- Formats: carried S(1,30), eps and u FLUX, y S(-1,25), x S(-3,36); products exact.
-- Latency: 25 (alpha, then beta).  Interval: 25.
-- Each sum with a product is formed by the adder behind the multiplier, which only adds: what is less a product
-- comes as a complement.
-- Rounding: half up, each product and x by itself.  lambda, eps, x and the carried flux saturate and tell.

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
    rho             : in  unsigned(RESISTANCE_W - 1 downto 0);
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
  constant TURN     : positive := 11;  -- clocks that beta comes behind alpha

  -- State, with merge_known; the axes take turns: the one that comes next (as its complement), and the other
  signal not_carried   : signed(TOTAL_W - 1 downto 0);
  signal carried_other : signed(FLUX_STATE_W - 1 downto 0);
  signal x             : signed(X_W - 1 downto 0);
  signal x_other       : signed(X_W - 1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal step       : std_logic_vector(0 to LATENCY - TURN);    -- of either axis
  signal beta       : std_logic;
  signal trusted    : std_logic;
  signal limited    : std_logic;                                -- by any stage of either axis
  signal i_1        : signed(PU_W - 1 downto 0);
  signal lambda_c_1 : signed(FLUX_W - 1 downto 0);
  signal u_1        : signed(FLUX_W - 1 downto 0);
  signal prod_r_2   : signed(PU_W + RESISTANCE_W downto 0);
  signal prod_u_2   : signed(FLUX_W + SAMPLE_TIME_W downto 0);
  signal sum_r      : signed(SUM_R_W - 1 downto 0);             -- not_carried + prod_r: at clock 3, then at clock 12
  signal less_r     : signed(TOTAL_W downto 0);
  signal lambda_4   : signed(FLUX_STATE_W - 1 downto 0);
  signal flux_4     : signed(FLUX_STATE_W - 1 downto 0);
  signal eps_4      : signed(FLUX_W downto 0);
  signal eps_5      : signed(FLUX_W - 1 downto 0);
  signal prod_y_6   : signed(PROD_Y_W - 1 downto 0);
  signal sum_y_7    : signed(PROD_Y_W - 1 downto 0);
  signal y_7        : signed(FLUX_MERGE_Y_W - 1 downto 0);
  signal prod_x_8   : signed(PROD_X_W - 1 downto 0);
  signal prod_xi_8  : signed(PROD_X_W - 1 downto 0);
  signal sum_x_9    : signed(PROD_X_W downto 0);
  signal moved_9    : signed(PROD_X_W - DROP_X downto 0);
  signal sum_xi_9   : signed(PROD_X_W downto 0);
  signal sum_u_10   : signed(SUM_U_W - 1 downto 0);
  signal total_10   : signed(TOTAL_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  step     <= valid(0 to LATENCY - TURN) or valid(TURN to LATENCY);
  trusted  <= merge_known and run;

  less_r   <= not sum_r(SUM_R_W - 1 downto DROP_RHO);
  eps_4    <= minus_rounded(resize(lambda_c_1, FLUX_W + 1), flux_4, FLUX_TO_STATE);
  y_7      <= sum_y_7(y_7'length - 1 + DROP_Y downto DROP_Y);
  moved_9  <= sum_x_9(PROD_X_W downto DROP_X);
  total_10 <= plus_rounded(sum_u_10(TOTAL_W - 1 + DROP_U downto DROP_U), x_other, FLUX_MERGE_X_TO_STATE);

  -- Next to the end of the range the flux would be rounded past it: saturated before it is rounded.
  process (all)
  begin
    flux_4 <= lambda_4;
    if lambda_4(FLUX_STATE_W - 1) = '0' and (and lambda_4(FLUX_STATE_W - 2 downto FLUX_TO_STATE - 1)) = '1' then
      flux_4(FLUX_TO_STATE - 1) <= '0';
    end if;
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Which axis enters: alpha at clock 0, beta at clock TURN
      if valid(TURN - 1) = '1' then
        beta <= '1';
      end if;
      if valid(TURN) = '1' then
        beta <= '0';
      end if;

      -- Stage 1: the axis' inputs;  x = 0 where lambda is not known
      if step(0) = '1' then
        i_1        <= i_beta when beta = '1' else i_alpha;
        lambda_c_1 <= lambda_c_beta when beta = '1' else lambda_c_alpha;
        u_1        <= u_applied_beta when beta = '1' else u_applied_alpha;
      end if;
      if valid(0) = '1' then
        limited <= '0';
      end if;
      if valid(0) = '1' and trusted = '0' then
        x       <= (others => '0');
        x_other <= (others => '0');
      end if;

      -- Stage 2: prod_r = rho*i;  prod_u = t_s*u_applied
      if step(1) = '1' then
        prod_r_2 <= i_1 * signed('0' & rho);
        prod_u_2 <= u_1 * signed('0' & t_s);
      end if;

      -- Stages 3, 12: sum_r = carried - prod_r, total - prod_r
      if step(2) = '1' or step(11) = '1' then
        sum_r <= rounding_base(not_carried, DROP_RHO, SUM_R_W) + prod_r_2;
      end if;

      -- Stage 4: lambda = sum_r, or lambda_c
      if step(3) = '1' then
        lambda_4 <= saturate(less_r, FLUX_STATE_W);
        if trusted = '0' then
          lambda_4 <= shift_left(resize(lambda_c_1, FLUX_STATE_W), FLUX_TO_STATE);
        elsif exceeds(less_r, FLUX_STATE_W) = '1' then
          limited <= '1';
        end if;
      end if;

      -- Stage 5: eps = lambda_c - lambda
      if step(4) = '1' then
        eps_5 <= saturate(eps_4, FLUX_W);
        if exceeds(eps_4, FLUX_W) = '1' then
          limited <= '1';
        end if;
      end if;

      -- Stages 6, 7: y = omega_0*eps; |eps| <= 2 and omega_0 < 1/4, so it fits
      if step(5) = '1' then
        prod_y_6 <= eps_5 * signed('0' & omega_0);
      end if;
      if step(6) = '1' then
        sum_y_7 <= rounding_base("0", DROP_Y, PROD_Y_W) + prod_y_6;
      end if;

      -- Stage 8: prod_x = omega_0*y;  prod_xi = xi*y
      if step(7) = '1' then
        prod_x_8  <= y_7 * signed('0' & omega_0);
        prod_xi_8 <= y_7 * signed('0' & xi);
      end if;

      -- Stage 9: sum_x = x + prod_x;  sum_xi = lambda + 2*prod_xi
      if step(8) = '1' then
        sum_x_9  <= rounding_base(x, DROP_X, PROD_X_W + 1) + prod_x_8;
        sum_xi_9 <= rounding_base(lambda_4, DROP_XI, PROD_X_W + 1) + prod_xi_8;
      end if;

      -- Stage 10: x = sum_x, narrowed;  sum_u = sum_xi + prod_u
      if step(9) = '1' then
        x        <= x_other;
        x_other  <= saturate(moved_9, X_W);
        sum_u_10 <= rounding_base(sum_xi_9(PROD_X_W downto DROP_XI), DROP_U, SUM_U_W) + prod_u_2;
        if exceeds(moved_9, X_W) = '1' then
          limited <= '1';
        end if;
      end if;

      -- Stages 11, 13: total = sum_u + x;  carried = sum_r, narrowed
      if step(10) = '1' then
        not_carried <= not total_10;
      end if;
      if step(12) = '1' then
        not_carried   <= not resize(carried_other, TOTAL_W);
        carried_other <= saturate(less_r, FLUX_STATE_W);
        if exceeds(less_r, FLUX_STATE_W) = '1' then
          limited <= '1';
        end if;
      end if;

      -- Stage 14: lambda_m = carried, narrowed; alpha at clock 14, beta at 25
      if valid(13) = '1' then
        lambda_m_alpha <= round_sat(carried_other, FLUX_TO_STATE, FLUX_W);
      end if;
      if valid(LATENCY - 1) = '1' then
        lambda_m_beta <= round_sat(carried_other, FLUX_TO_STATE, FLUX_W);
        merge_known   <= voltage_known;
        merge_limited <= limited;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        beta                <= '0';
        not_carried         <= (others => '1');
        carried_other       <= (others => '0');
        x                   <= (others => '0');
        x_other             <= (others => '0');
        lambda_m_alpha      <= (others => '0');
        lambda_m_beta       <= (others => '0');
        merge_known         <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
