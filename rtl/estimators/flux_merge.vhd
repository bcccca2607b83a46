-- Purpose: merge of voltage and current models in the stator frame, paper 001 eq. (7); alpha first, then beta.
--   lambda = carried - rho*i;  eps = lambda_c - lambda;  y = omega_0*eps;  x += omega_0*y
--   carried = lambda_m = lambda + 2*xi*y + x + t_s*u_applied - rho*i
-- Where the voltage of the last period is not known or the gates are off: lambda = lambda_c, x = 0.
-- Formats: carried S(1,30), eps and u FLUX, y S(-1,25), x S(-3,36); products exact.
-- Latency: 10 (alpha, beta follow each other).  Interval: 10.
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
  constant LATENCY : positive := FLUX_MERGE_LATENCY;
  constant Y_W     : positive := FLUX_MERGE_Y_W;
  constant X_W     : positive := FLUX_MERGE_X_W;
  constant SUM_W   : positive := FLUX_STATE_W + 3;

  -- State, with merge_known; the axes take turns: the one that comes next, and the other
  signal carried       : signed(FLUX_STATE_W - 1 downto 0);
  signal carried_other : signed(FLUX_STATE_W - 1 downto 0);
  signal x             : signed(X_W - 1 downto 0);
  signal x_other       : signed(X_W - 1 downto 0);

  signal valid       : std_logic_vector(0 to LATENCY);
  signal trusted     : std_logic;
  signal limited     : std_logic;  -- by any stage of either axis
  signal i_0         : signed(PU_W - 1 downto 0);
  signal prod_r_1    : signed(PU_W + RESISTANCE_W downto 0);
  signal lambda_c_1  : signed(FLUX_W - 1 downto 0);
  signal now_1       : signed(FLUX_STATE_W downto 0);
  signal prod_r_2    : signed(PU_W + RESISTANCE_W downto 0);
  signal lambda_c_2  : signed(FLUX_W - 1 downto 0);
  signal lambda_2    : signed(FLUX_STATE_W - 1 downto 0);
  signal flux_2      : signed(FLUX_STATE_W - 1 downto 0);
  signal eps_2       : signed(FLUX_W downto 0);
  signal u_2         : signed(FLUX_W - 1 downto 0);
  signal eps_3       : signed(FLUX_W - 1 downto 0);
  signal prod_u_3    : signed(FLUX_W + SAMPLE_TIME_W downto 0);
  signal sum_3       : signed(SUM_W - 1 downto 0);
  signal prod_y_4    : signed(FLUX_W + omega_0'length downto 0);
  signal sum_4       : signed(SUM_W - 1 downto 0);
  signal y_5         : signed(Y_W - 1 downto 0);
  signal sum_5       : signed(SUM_W - 1 downto 0);
  signal prod_x_6    : signed(Y_W + omega_0'length downto 0);
  signal prod_xi_6   : signed(Y_W + xi'length downto 0);
  signal sum_6       : signed(SUM_W - 1 downto 0);
  signal moved_6     : signed(X_W downto 0);
  signal sum_7       : signed(SUM_W - 1 downto 0);
  signal following_7 : signed(SUM_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  trusted  <= merge_known and run;

  i_0        <= i_beta when valid(1) = '1' else i_alpha;
  lambda_c_1 <= lambda_c_beta when valid(2) = '1' else lambda_c_alpha;
  u_2        <= u_applied_beta when valid(3) = '1' else u_applied_alpha;

  now_1       <= minus_rounded(resize(carried, FLUX_STATE_W + 1), prod_r_1, FLUX_MERGE_DROP_RHO);
  eps_2       <= minus_rounded(resize(lambda_c_2, FLUX_W + 1), flux_2, FLUX_TO_STATE);
  moved_6     <= plus_rounded(resize(x, X_W + 1), prod_x_6, FLUX_MERGE_DROP_X);
  following_7 <= plus_rounded(sum_7, x_other, FLUX_MERGE_X_TO_STATE);

  -- Next to the end of the range the flux would be rounded past it: saturated before it is rounded.
  process (all)
  begin
    flux_2 <= lambda_2;
    if lambda_2(FLUX_STATE_W - 1) = '0' and (and lambda_2(FLUX_STATE_W - 2 downto FLUX_TO_STATE - 1)) = '1' then
      flux_2(FLUX_TO_STATE - 1) <= '0';
    end if;
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod_r = rho*i;  x = 0 where lambda is not known
      if valid(0) = '1' or valid(1) = '1' then
        prod_r_1 <= i_0 * signed('0' & rho);
      end if;
      if valid(0) = '1' then
        limited <= '0';
        if trusted = '0' then
          x       <= (others => '0');
          x_other <= (others => '0');
        end if;
      end if;

      -- Stage 2: lambda = carried - prod_r, or lambda_c
      if valid(1) = '1' then
        carried <= carried_other;
      end if;
      if valid(1) = '1' or valid(2) = '1' then
        prod_r_2   <= prod_r_1;
        lambda_c_2 <= lambda_c_1;
        lambda_2   <= saturate(now_1, FLUX_STATE_W);
        if trusted = '0' then
          lambda_2 <= shift_left(resize(lambda_c_1, FLUX_STATE_W), FLUX_TO_STATE);
        elsif exceeds(now_1, FLUX_STATE_W) = '1' then
          limited <= '1';
        end if;
      end if;

      -- Stage 3: eps = lambda_c - lambda;  sum = lambda - prod_r;  prod_u = t_s*u_applied
      if valid(2) = '1' or valid(3) = '1' then
        eps_3    <= saturate(eps_2, FLUX_W);
        sum_3    <= minus_rounded(resize(lambda_2, SUM_W), prod_r_2, FLUX_MERGE_DROP_RHO);
        prod_u_3 <= u_2 * signed('0' & t_s);
        if exceeds(eps_2, FLUX_W) = '1' then
          limited <= '1';
        end if;
      end if;

      -- Stage 4: prod_y = omega_0*eps;  sum += prod_u
      if valid(3) = '1' or valid(4) = '1' then
        prod_y_4 <= eps_3 * signed('0' & omega_0);
        sum_4    <= plus_rounded(sum_3, prod_u_3, FLUX_MERGE_DROP_U);
      end if;

      -- Stage 5: y = prod_y, narrowed; |eps| <= 2 and omega_0 < 1/4, so it fits
      if valid(4) = '1' or valid(5) = '1' then
        y_5   <= resize(round_half_up(prod_y_4, FLUX_MERGE_DROP_Y), Y_W);
        sum_5 <= sum_4;
      end if;

      -- Stage 6: prod_x = omega_0*y, prod_xi = xi*y
      if valid(5) = '1' or valid(6) = '1' then
        prod_x_6  <= y_5 * signed('0' & omega_0);
        prod_xi_6 <= y_5 * signed('0' & xi);
        sum_6     <= sum_5;
      end if;

      -- Stage 7: x += prod_x;  sum += 2*prod_xi
      if valid(6) = '1' or valid(7) = '1' then
        x       <= x_other;
        x_other <= saturate(moved_6, X_W);
        sum_7   <= plus_rounded(sum_6, prod_xi_6, FLUX_MERGE_DROP_XI);
        if exceeds(moved_6, X_W) = '1' then
          limited <= '1';
        end if;
      end if;

      -- Stage 8: carried = sum + x
      if valid(7) = '1' or valid(8) = '1' then
        carried_other <= saturate(following_7, FLUX_STATE_W);
        if exceeds(following_7, FLUX_STATE_W) = '1' then
          limited <= '1';
        end if;
      end if;
      if valid(8) = '1' then
        carried <= carried_other;
      end if;

      -- Stage 9: lambda_m = carried, narrowed; alpha at clock 9, beta at 10
      if valid(8) = '1' then
        lambda_m_alpha <= round_sat(carried_other, FLUX_TO_STATE, FLUX_W);
      end if;
      if valid(9) = '1' then
        lambda_m_beta <= round_sat(carried_other, FLUX_TO_STATE, FLUX_W);
        merge_known   <= voltage_known;
        merge_limited <= limited;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        carried             <= (others => '0');
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
