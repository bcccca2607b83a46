-- Purpose: the PI of paper 001 eq. (17) on delta_lambda, or the plain addition of eq. (16); d first, then q.
--   integral = limit(integral + flux_ki*delta_lambda)                                     flux_mode 3
--   integral = integral - integral/2**8 while delta_lambda is held: an unverified compensation decays
--   lambda_pi = limit(flux_kp*delta_lambda + integral)                                    flux_mode 3
--   lambda_add = limit(delta_lambda)                                                      flux_mode 2
-- limit: to +-delta_max, reported.  The addition is the PI with a gain of one and no integral.
-- Formats: flux_kp U(7,10), flux_ki U(0,17), products and integral S(1,30), delta_max U(0,16), out FLUX.
-- Latency: 12 (d, then q).  Interval: 12.  Rounding: half up; the limit is a multiple of FLUX's LSB.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_compensation is
  port (
    clk                  : in  std_logic;
    rst                  : in  std_logic;
    in_valid             : in  std_logic;
    delta_lambda_d       : in  signed(FLUX_W - 1 downto 0);
    delta_lambda_q       : in  signed(FLUX_W - 1 downto 0);
    delta_held           : in  std_logic;
    flux_mode            : in  unsigned(1 downto 0);
    flux_kp              : in  unsigned(16 downto 0);
    flux_ki              : in  unsigned(16 downto 0);
    delta_max            : in  unsigned(15 downto 0);
    out_valid            : out std_logic;
    lambda_pi_d          : out signed(FLUX_W - 1 downto 0);
    lambda_pi_q          : out signed(FLUX_W - 1 downto 0);
    lambda_add_d         : out signed(FLUX_W - 1 downto 0);
    lambda_add_q         : out signed(FLUX_W - 1 downto 0);
    compensation_limited : out std_logic
  );
end entity flux_compensation;

architecture rtl of flux_compensation is
  constant LATENCY     : positive              := FLUX_COMPENSATION_LATENCY;
  constant SHIFT_LIMIT : positive              := FLUX_COMPENSATION_SHIFT_LIMIT;
  constant DROP_P      : positive              := FLUX_COMPENSATION_DROP_P;
  constant DROP_I      : positive              := FLUX_COMPENSATION_DROP_I;
  constant FORGET      : positive              := FLUX_COMPENSATION_FORGET;
  constant EARLIER     : natural               := FLUX_MODELS_EARLIER;
  constant PROPOSED    : natural               := FLUX_MODELS_PROPOSED;
  constant KP_ONE      : unsigned(16 downto 0) := to_unsigned(2 ** (DROP_P + FLUX_TO_STATE), 17);
  constant SUM_W       : positive              := FLUX_W + flux_kp'length + 2;
  constant TURN        : positive              := 4;  -- delay of q behind d, clocks

  -- State: a shift register of the two axes' integrals, the next one first
  signal integral       : signed(FLUX_STATE_W - 1 downto 0);
  signal integral_other : signed(FLUX_STATE_W - 1 downto 0);

  signal valid     : std_logic_vector(0 to LATENCY);
  signal step      : std_logic_vector(0 to LATENCY - TURN);  -- valid bits of both axes
  signal upper     : signed(FLUX_STATE_W - 1 downto 0);
  signal lower     : signed(FLUX_STATE_W - 1 downto 0);
  signal kp        : unsigned(flux_kp'range);
  signal delta_0   : signed(FLUX_W - 1 downto 0);
  signal delta_1   : signed(FLUX_W - 1 downto 0);
  signal down_0    : std_logic;
  signal mul_a_1   : signed(FLUX_W - 1 downto 0);
  signal mul_b_1   : signed(flux_ki'length downto 0);
  signal prod_i_2  : signed(FLUX_W + flux_ki'length downto 0);
  signal sum_i_3   : signed(SUM_W - 1 downto 0);
  signal moved_3   : signed(SUM_W - 1 - DROP_I downto 0);
  signal past_4    : std_logic;
  signal under_4   : std_logic;
  signal prod_p_4  : signed(FLUX_W + flux_kp'length downto 0);
  signal sum_p_6   : signed(SUM_W - 1 downto 0);
  signal total_6   : signed(SUM_W - 1 - DROP_P downto 0);
  signal past_7    : std_logic;
  signal under_7   : std_logic;
  signal rounded_7 : signed(FLUX_W - 1 downto 0);
  signal lambda_7  : signed(FLUX_W - 1 downto 0);
  signal limited_8 : std_logic;
begin
  valid(0) <= in_valid;
  step     <= valid(0 to LATENCY - TURN) or valid(TURN to LATENCY);
  upper    <= shift_left(signed(resize(delta_max, FLUX_STATE_W)), SHIFT_LIMIT);
  lower    <= shift_left(-signed(resize(delta_max, FLUX_STATE_W)), SHIFT_LIMIT);
  delta_0  <= delta_lambda_q when valid(TURN) = '1' else delta_lambda_d;
  moved_3  <= sum_i_3(SUM_W - 1 downto DROP_I);
  total_6  <= sum_p_6(SUM_W - 1 downto DROP_P);

  -- -integral/2**FORGET, half up: the complement of the upper bits, plus one unless the lower bits exceed half.
  down_0 <= integral(FORGET - 1) and (or integral(FORGET - 2 downto 0));

  -- The limited total; the limit is applied after the rounding, which cannot move a value beyond it.
  lambda_7 <= rounded_7 when past_7 = '0' else
              lower(FLUX_STATE_W - 1 downto FLUX_TO_STATE) when under_7 = '1' else
              upper(FLUX_STATE_W - 1 downto FLUX_TO_STATE);

  process (clk)
    variable rounded : signed(SUM_W - DROP_P - FLUX_TO_STATE downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the factors of flux_ki*delta_lambda, or of the decay while delta_lambda is held
      if step(0) = '1' then
        delta_1 <= delta_0;
        mul_a_1 <= delta_0;
        mul_b_1 <= signed('0' & flux_ki);
        if delta_held = '1' then
          mul_a_1 <= (not integral(FLUX_STATE_W - 1 downto FORGET)) & (not down_0);
          mul_b_1 <= to_signed(2 ** (DROP_I - 1), mul_b_1'length);
        end if;
      end if;

      -- Stages 2, 3: sum_i = integral + prod_i
      if step(1) = '1' then
        prod_i_2 <= mul_a_1 * mul_b_1;
      end if;
      if step(2) = '1' then
        sum_i_3 <= rounding_base(integral, DROP_I, SUM_W) + prod_i_2;
      end if;

      -- Stage 4: prod_p = kp*delta_lambda, kp selected by flux_mode;  stages 4, 5: integral = sum_i, limited
      kp <= flux_kp when flux_mode = PROPOSED else KP_ONE;
      if step(3) = '1' then
        prod_p_4       <= delta_1 * signed('0' & kp);
        past_4         <= beyond(moved_3, delta_max, SHIFT_LIMIT);
        under_4        <= moved_3(moved_3'high);
        integral       <= integral_other;
        integral_other <= moved_3(FLUX_STATE_W - 1 downto 0);
      end if;
      if step(4) = '1' and past_4 = '1' then
        integral_other <= lower when under_4 = '1' else upper;
      end if;
      if step(4) = '1' and flux_mode /= PROPOSED then
        integral_other <= (others => '0');
      end if;

      -- Stage 6: sum_p = integral + prod_p
      if step(5) = '1' then
        sum_p_6 <= rounding_base(integral_other, DROP_P, SUM_W) + prod_p_4;
      end if;

      -- Stages 7, 8: lambda = sum_p, narrowed and limited; d at clock 8, q at 12
      if step(6) = '1' then
        rounded   := round_half_up(total_6, FLUX_TO_STATE);
        rounded_7 <= rounded(FLUX_W - 1 downto 0);
        past_7    <= beyond(total_6, delta_max, SHIFT_LIMIT);
        under_7   <= total_6(total_6'high);
      end if;
      if valid(7) = '1' then
        limited_8    <= past_7;
        lambda_pi_d  <= lambda_7;
        lambda_add_d <= lambda_7;
      end if;
      if valid(LATENCY - 1) = '1' then
        compensation_limited <= (limited_8 or past_7) when flux_mode = EARLIER or flux_mode = PROPOSED else '0';
        lambda_pi_q          <= lambda_7;
        lambda_add_q         <= lambda_7;
      end if;
      if valid(7) = '1' and flux_mode /= PROPOSED then
        lambda_pi_d <= (others => '0');
      end if;
      if valid(7) = '1' and flux_mode /= EARLIER then
        lambda_add_d <= (others => '0');
      end if;
      if valid(LATENCY - 1) = '1' and flux_mode /= PROPOSED then
        lambda_pi_q <= (others => '0');
      end if;
      if valid(LATENCY - 1) = '1' and flux_mode /= EARLIER then
        lambda_add_q <= (others => '0');
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        integral            <= (others => '0');
        integral_other      <= (others => '0');
        lambda_pi_d         <= (others => '0');
        lambda_pi_q         <= (others => '0');
        lambda_add_d        <= (others => '0');
        lambda_add_q        <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
