-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: what the motor does beside its description: the flux that a sample should show, and the one that it shows.
--   lambda  = e^(j theta)(model_d + j model_q);  carried = lambda + t_s*u - rho*i, integrated to the next sample
--   u       = u_applied - residual_leg*s, with the directions s of two samples ago
--   e       = e^(-j theta)(lambda + rho*i - carried of the last sample);  sixth = e*e^(j 6 theta);  power = |e|**2
--   mean   += (x - mean)/128 of e, sixth, power and |i_a + i_b + i_c|
--   moved   = |i| >= residual_light and |omega_me| >= residual_slow
--   over    = moved and |mean of e| > residual_min + residual_w*|omega_me| + residual_i*|i|
--             or mean of |sum| > residual_sum_max + residual_sum_i*|i|
-- motor_differs when residual_samples more samples were over than not; 0: never.  A sample counts if the voltage since
-- the last one was known and not at its limit and no current is at its rail; otherwise e is zero, means and counter stay.
-- While not moved the means of e, sixth and power stay.  run = 0: means and counter are zero.
-- |x| of a vector is the larger component and half the smaller one.  One multiplier makes the 31 products in turn: n
-- numbers the clocks of a sample, the product whose factors clock n selects is there at clock n + 2.
-- Formats: fluxes S(1,30), rotated ones saturated; carried S(2,30); e S(-3,20) saturated; power U(-4,36), cut.
-- Latency: 38.  Interval: 38.
-- Rounding: products half up, those of the limits cut; means are cut from seven bits below; the counter saturates.
-- Multiples of theta saturate at 2, which the cosines of 2 and 3 theta do not reach for any two numbers up to 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_residual is
  port (
    clk              : in  std_logic;
    rst              : in  std_logic;
    in_valid         : in  std_logic;
    model_d          : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    model_q          : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    cos_theta        : in  signed(PU_W - 1 downto 0);
    sin_theta        : in  signed(PU_W - 1 downto 0);
    i_a              : in  signed(PU_W - 1 downto 0);
    i_b              : in  signed(PU_W - 1 downto 0);
    i_c              : in  signed(PU_W - 1 downto 0);
    i_alpha          : in  signed(PU_W - 1 downto 0);
    i_beta           : in  signed(PU_W - 1 downto 0);
    i_d              : in  signed(PU_W - 1 downto 0);
    i_q              : in  signed(PU_W - 1 downto 0);
    omega_me         : in  signed(PU_W - 1 downto 0);
    u_applied_alpha  : in  signed(FLUX_W - 1 downto 0);
    u_applied_beta   : in  signed(FLUX_W - 1 downto 0);
    s_alpha          : in  signed(PU_W - 1 downto 0);
    s_beta           : in  signed(PU_W - 1 downto 0);
    rho              : in  unsigned(RHO_W - 1 downto 0);
    sat_d            : in  signed(1 downto 0);
    sat_q            : in  signed(1 downto 0);
    voltage_known    : in  std_logic;
    current_at_rail  : in  unsigned(2 downto 0);
    run              : in  std_logic;
    t_s              : in  unsigned(SAMPLE_TIME_W - 1 downto 0);
    residual_leg     : in  unsigned(16 downto 0);
    residual_min     : in  unsigned(16 downto 0);
    residual_w       : in  unsigned(23 downto 0);
    residual_i       : in  unsigned(23 downto 0);
    residual_light   : in  signed(PU_W - 1 downto 0);
    residual_slow    : in  signed(PU_W - 1 downto 0);
    residual_sum_max : in  unsigned(17 downto 0);
    residual_sum_i   : in  unsigned(21 downto 0);
    residual_samples : in  unsigned(11 downto 0);
    out_valid        : out std_logic;
    residual_d       : out signed(MOTOR_RESIDUAL_RESIDUAL_W - 1 downto 0);
    residual_q       : out signed(MOTOR_RESIDUAL_RESIDUAL_W - 1 downto 0);
    residual_mean_d  : out signed(MOTOR_RESIDUAL_RESIDUAL_W - 1 downto 0);
    residual_mean_q  : out signed(MOTOR_RESIDUAL_RESIDUAL_W - 1 downto 0);
    residual_sixth_d : out signed(MOTOR_RESIDUAL_RESIDUAL_W - 1 downto 0);
    residual_sixth_q : out signed(MOTOR_RESIDUAL_RESIDUAL_W - 1 downto 0);
    residual_power   : out unsigned(MOTOR_RESIDUAL_POWER_W - 1 downto 0);
    residual_sum     : out unsigned(20 downto 0);
    motor_differs    : out std_logic
  );
end entity motor_residual;

architecture rtl of motor_residual is
  constant LATENCY : positive := MOTOR_RESIDUAL_LATENCY;
  constant MEAN    : positive := MOTOR_RESIDUAL_MEAN;
  constant E_W     : positive := MOTOR_RESIDUAL_RESIDUAL_W;
  constant SUM_W   : positive := MOTOR_RESIDUAL_SUM_W;
  constant STATE_W : positive := FLUX_STATE_W + 1;
  constant PROD_W  : positive := PU_W + FLUX_W;

  subtype pu_t is signed(PU_W - 1 downto 0);
  subtype wide_t is signed(FLUX_W - 1 downto 0);
  subtype state_t is signed(STATE_W - 1 downto 0);
  subtype e_t is signed(E_W - 1 downto 0);
  subtype mean_t is signed(E_W + MEAN - 1 downto 0);
  subtype limit_t is signed(20 downto 0);

  constant ONE : signed(PU_W + 1 downto 0) := to_signed(2**MOTOR_RESIDUAL_DROP_TRIG, PU_W + 2);

  -- State
  signal carried_alpha, carried_beta            : state_t;
  signal known                                  : std_logic;
  signal s_before_alpha, s_before_beta          : pu_t;
  signal sum_d, sum_q, sum_sixth_d, sum_sixth_q : mean_t;
  signal sum_power                              : signed(MOTOR_RESIDUAL_POWER_W + MEAN downto 0);
  signal sum_sum                                : signed(SUM_W + MEAN downto 0);
  signal count                                  : unsigned(11 downto 0);

  signal n                         : natural range 0 to LATENCY;
  signal a                         : pu_t;
  signal b                         : wide_t;
  signal prod                      : signed(PROD_W - 1 downto 0);
  signal first                     : signed(PROD_W - 1 downto 0);
  signal sum_2, diff_2             : signed(PROD_W downto 0);
  signal flux_d, flux_q            : wide_t;
  signal u_alpha, u_beta           : wide_t;
  signal less_1, less_34, over     : std_logic;
  signal current                   : pu_t;
  signal total                     : signed(PU_W + 1 downto 0);
  signal cos_2, sin_2              : pu_t;
  signal cos_3, sin_3              : pu_t;
  signal cos_6, sin_6              : pu_t;
  signal lambda_alpha, lambda_beta : signed(FLUX_STATE_W - 1 downto 0);
  signal error_alpha, error_beta   : e_t;
  signal sixth_d, sixth_q          : e_t;
  signal e_d, e_q                  : e_t;
  signal power                     : signed(MOTOR_RESIDUAL_POWER_W downto 0);
  signal most, sum_most, size_35   : limit_t;
  signal used, limited, moved      : std_logic;

  -- Twice a product of sines
  function twice (x : signed) return signed is
  begin
    return round_half_up(x, MOTOR_RESIDUAL_DROP_TWICE);
  end function;

  -- 2**MEAN times the mean, with a new value
  function averaged (sum : signed; x : signed) return signed is
  begin
    return sum + x - shift_right(sum, MEAN);
  end function;

  function cut (x : signed; drop : natural) return limit_t is
  begin
    return resize(shift_right(x, drop), limit_t'length);
  end function;

  function counted (is_over : std_logic; so_far : unsigned) return unsigned is
  begin
    if is_over = '1' and (and so_far) = '0' then
      return so_far + 1;
    elsif is_over = '0' and so_far /= 0 then
      return so_far - 1;
    end if;
    return so_far;
  end function;
begin
  flux_d <= saturate(model_d(model_d'high downto FLUX_MODELS_DROP_MODEL), FLUX_W);
  flux_q <= saturate(model_q(model_q'high downto FLUX_MODELS_DROP_MODEL), FLUX_W);
  sum_2  <= resize(first, PROD_W + 1) + prod;
  diff_2 <= resize(first, PROD_W + 1) - prod;
  used   <= '1' when known = '1' and run = '1' and current_at_rail = 0 else '0';

  process (clk)
    variable drop_14 : signed(STATE_W downto 0);
  begin
    if rising_edge(clk) then
      if in_valid = '1' then
        n <= 1;
      elsif n = LATENCY then
        n <= 0;
      elsif n /= 0 then
        n <= n + 1;
      end if;
      prod  <= a * b;
      first <= prod;

      -- The factors: 0, 1 cos, sin of 2 theta; 2 to 5 lambda; 6 to 9 of 3 theta; 10, 11 leg loss; 12, 13 rho*i; 14,
      -- 15 t_s*u
      a <= cos_theta;
      b <= resize(cos_theta, FLUX_W);
      case n is
        when 1      => a <= sin_theta;
        when 2      => b <= flux_d;
        when 3      => a <= sin_theta; b <= flux_q;
        when 4      => a <= sin_theta; b <= flux_d;
        when 5      => b <= flux_q;
        when 6      => b <= resize(cos_2, FLUX_W);
        when 7      => a <= sin_theta; b <= resize(sin_2, FLUX_W);
        when 8      => a <= sin_theta; b <= resize(cos_2, FLUX_W);
        when 9      => b <= resize(sin_2, FLUX_W);
        when 10     => a <= s_before_alpha; b <= signed(resize(residual_leg, FLUX_W));
        when 11     => a <= s_before_beta; b <= signed(resize(residual_leg, FLUX_W));
        when 12     => a <= i_alpha; b <= signed(resize(rho, FLUX_W));
        when 13     => a <= i_beta; b <= signed(resize(rho, FLUX_W));
        when 14     => a <= signed(resize(t_s, PU_W)); b <= u_alpha;
        when 15     => a <= signed(resize(t_s, PU_W)); b <= u_beta;
        -- 16 to 17 of 6 theta; 18 to 21 e; 22 to 23 the limit; 24 to 25 power; 26 to 29 sixth; 30 the limit of the sum
        when 16     => a <= cos_3; b <= resize(cos_3, FLUX_W);
        when 17     => a <= sin_3; b <= resize(cos_3, FLUX_W);
        when 18     => b <= resize(error_alpha, FLUX_W);
        when 19     => a <= sin_theta; b <= resize(error_beta, FLUX_W);
        when 20     => b <= resize(error_beta, FLUX_W);
        when 21     => a <= sin_theta; b <= resize(error_alpha, FLUX_W);
        when 22     => a <= size(omega_me); b <= signed(resize(residual_w, FLUX_W));
        when 23     => a <= current; b <= signed(resize(residual_i, FLUX_W));
        when 24     => a <= e_d; b <= resize(e_d, FLUX_W);
        when 25     => a <= e_q; b <= resize(e_q, FLUX_W);
        when 26     => a <= e_d; b <= resize(cos_6, FLUX_W);
        when 27     => a <= e_q; b <= resize(sin_6, FLUX_W);
        when 28     => a <= e_q; b <= resize(cos_6, FLUX_W);
        when 29     => a <= e_d; b <= resize(sin_6, FLUX_W);
        when 30     => a <= current; b <= signed(resize(residual_sum_i, FLUX_W));
        when others => null;
      end case;
      less_1  <= smaller_is(i_d, i_q);
      current <= saturate(length(i_d, i_q, less_1), PU_W);
      moved   <= '1' when current >= residual_light and size(omega_me) >= residual_slow else '0';
      total   <= size(resize(i_a, PU_W + 2) + i_b + i_c);

      -- The products, two clocks later
      case n is
        when 2 => cos_2 <= resize(twice(prod) - ONE, PU_W);
        when 3 => sin_2 <= saturate(twice(prod), PU_W);
        when 5 => lambda_alpha <= round_sat(diff_2, MOTOR_RESIDUAL_DROP_LAMBDA, FLUX_STATE_W);
        when 7 => lambda_beta <= round_sat(sum_2, MOTOR_RESIDUAL_DROP_LAMBDA, FLUX_STATE_W);
        when 9 => cos_3 <= resize(round_half_up(diff_2, MOTOR_RESIDUAL_DROP_TRIG), PU_W);
        when 11 => sin_3 <= round_sat(sum_2, MOTOR_RESIDUAL_DROP_TRIG, PU_W);
        when 12 =>
          u_alpha        <= saturate(u_applied_alpha - round_half_up(prod, MOTOR_RESIDUAL_DROP_LEG), FLUX_W);
          s_before_alpha <= s_alpha;
          limited        <= or (sat_d or sat_q);
        when 13 =>
          u_beta        <= saturate(u_applied_beta - round_half_up(prod, MOTOR_RESIDUAL_DROP_LEG), FLUX_W);
          s_before_beta <= s_beta;
        when 14 =>
          drop_14       := resize(round_half_up(prod, MOTOR_RESIDUAL_DROP_RHO), STATE_W + 1);
          error_alpha   <= round_sat(drop_14 + lambda_alpha - carried_alpha, MOTOR_RESIDUAL_DROP_E, E_W);
          carried_alpha <= resize(lambda_alpha - drop_14, STATE_W);
        when 15 =>
          drop_14      := resize(round_half_up(prod, MOTOR_RESIDUAL_DROP_RHO), STATE_W + 1);
          error_beta   <= round_sat(drop_14 + lambda_beta - carried_beta, MOTOR_RESIDUAL_DROP_E, E_W);
          carried_beta <= resize(lambda_beta - drop_14, STATE_W);
        when 16 => carried_alpha <= resize(carried_alpha + round_half_up(prod, MOTOR_RESIDUAL_DROP_U), STATE_W);
        when 17 => carried_beta <= resize(carried_beta + round_half_up(prod, MOTOR_RESIDUAL_DROP_U), STATE_W);
        when 18 => cos_6 <= saturate(twice(prod) - ONE, PU_W);
        when 19 => sin_6 <= saturate(twice(prod), PU_W);
        when 21 =>
          e_d <= (others => '0');
          if used = '1' then
            e_d <= round_sat(sum_2, MOTOR_RESIDUAL_DROP_TRIG, E_W);
          end if;
        when 23 =>
          e_q <= (others => '0');
          if used = '1' then
            e_q <= round_sat(diff_2, MOTOR_RESIDUAL_DROP_TRIG, E_W);
          end if;
        when 24 => most <= signed(resize(residual_min, limit_t'length)) + cut(prod, MOTOR_RESIDUAL_DROP_OMEGA);
        when 25 => most <= most + cut(prod, MOTOR_RESIDUAL_DROP_I);
        when 27 => power <= resize(shift_right(sum_2, MOTOR_RESIDUAL_DROP_POWER), power'length);
        when 29 => sixth_d <= round_sat(diff_2, MOTOR_RESIDUAL_DROP_TRIG, E_W);
        when 31 => sixth_q <= round_sat(sum_2, MOTOR_RESIDUAL_DROP_TRIG, E_W);

        -- The limit of the sum; the means
        when 32 =>
          sum_most <= signed(resize(residual_sum_max, limit_t'length)) + cut(prod, MOTOR_RESIDUAL_DROP_SUM_I);
          if run = '0' then
            sum_d       <= (others => '0');
            sum_q       <= (others => '0');
            sum_sixth_d <= (others => '0');
            sum_sixth_q <= (others => '0');
            sum_power   <= (others => '0');
            sum_sum     <= (others => '0');
          elsif used = '1' then
            if moved = '1' then
              sum_d       <= averaged(sum_d, e_d);
              sum_q       <= averaged(sum_q, e_q);
              sum_sixth_d <= averaged(sum_sixth_d, sixth_d);
              sum_sixth_q <= averaged(sum_sixth_q, sixth_q);
              sum_power   <= averaged(sum_power, power);
            end if;
            sum_sum     <= averaged(sum_sum, signed(resize(saturate_u(total, SUM_W), SUM_W + 1)));
          end if;
        when 36 =>
          if used = '1' then
            count <= counted(over, count);
          end if;
          if run = '0' or residual_samples = 0 then
            count <= (others => '0');
          end if;
          known <= voltage_known and run and not (or current_at_rail) and not limited;
        when 37 => motor_differs <= '1' when count >= residual_samples and count /= 0 else '0';
        when others => null;
      end case;

      -- Clocks 33 to 35: |mean of e| against the limits
      less_34 <= smaller_is(shift_right(sum_d, MEAN), shift_right(sum_q, MEAN));
      size_35 <= resize(length(resize(shift_right(sum_d, MEAN), E_W), resize(shift_right(sum_q, MEAN), E_W), less_34),
                        limit_t'length);
      over    <= '1' when (moved = '1' and size_35 > most) or shift_right(sum_sum, MOTOR_RESIDUAL_DROP_SUM) > sum_most else '0';

      if rst = '1' then
        n              <= 0;
        known          <= '0';
        s_before_alpha <= (others => '0');
        s_before_beta  <= (others => '0');
        carried_alpha  <= (others => '0');
        carried_beta   <= (others => '0');
        sum_d          <= (others => '0');
        sum_q          <= (others => '0');
        sum_sixth_d    <= (others => '0');
        sum_sixth_q    <= (others => '0');
        sum_power      <= (others => '0');
        sum_sum        <= (others => '0');
        count          <= (others => '0');
      end if;
    end if;
  end process;

  out_valid        <= '1' when n = LATENCY else '0';
  residual_d       <= e_d;
  residual_q       <= e_q;
  residual_mean_d  <= resize(shift_right(sum_d, MEAN), E_W);
  residual_mean_q  <= resize(shift_right(sum_q, MEAN), E_W);
  residual_sixth_d <= resize(shift_right(sum_sixth_d, MEAN), E_W);
  residual_sixth_q <= resize(shift_right(sum_sixth_q, MEAN), E_W);
  residual_power   <= unsigned(sum_power(sum_power'high - 1 downto MEAN));
  residual_sum     <= unsigned(sum_sum(SUM_W + MEAN - 1 downto MOTOR_RESIDUAL_DROP_SUM));

end architecture rtl;
