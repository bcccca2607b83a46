-- Purpose: the PI of paper 001 eq. (17) on delta_lambda, or the plain addition of eq. (16); d first, then q.
--   integral = limit(integral + flux_ki*delta_lambda)                                     flux_mode 3
--   integral = integral - integral/2**8 while delta_lambda is held: what cannot be verified is forgotten
--   lambda_pi = limit(flux_kp*delta_lambda + integral)                                    flux_mode 3
--   lambda_add = limit(delta_lambda)                                                      flux_mode 2
-- limit: to +-delta_max, and told.  The addition is the PI with a gain of one and no integral.
-- Formats: flux_kp U(7,10), flux_ki U(0,17), products and integral S(1,30), delta_max U(0,16), out FLUX.
-- Latency: 6 (d, q follow each other).  Interval: 6.  Rounding: half up; the limit is a multiple of FLUX's LSB.

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
  constant EARLIER     : natural               := FLUX_ESTIMATE_EARLIER;
  constant PROPOSED    : natural               := FLUX_ESTIMATE_PROPOSED;
  constant KP_ONE      : unsigned(16 downto 0) := to_unsigned(2 ** (DROP_P + FLUX_TO_STATE), 17);
  constant LIMIT_W     : positive              := delta_max'length + 2;
  constant TOTAL_W     : positive              := FLUX_W + flux_kp'length + 2 - DROP_P;

  -- State: the axes take turns: the one that comes next, and the other
  signal integral       : signed(FLUX_STATE_W - 1 downto 0);
  signal integral_other : signed(FLUX_STATE_W - 1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal lower      : signed(LIMIT_W - 1 downto 0);
  signal upper      : signed(LIMIT_W - 1 downto 0);
  signal delta_0    : signed(FLUX_W - 1 downto 0);
  signal integral_0 : signed(FLUX_STATE_W downto 0);
  signal kp_2       : unsigned(flux_kp'range);
  signal prod_i_1   : signed(FLUX_W + flux_ki'length downto 0);
  signal sum_2      : signed(FLUX_STATE_W + 1 downto 0);
  signal prod_p_3   : signed(FLUX_W + flux_kp'length downto 0);
  signal moved_2    : signed(FLUX_STATE_W - 1 downto 0);
  signal total_4    : signed(TOTAL_W - 1 downto 0);
  signal side_4     : signed(1 downto 0);
  signal lambda_4   : signed(FLUX_W - 1 downto 0);
  signal limited_5  : std_logic;

  -- +1 above, -1 below +-limit, which counts from bit SHIFT_LIMIT on: only x has bits below that.
  function side (x : signed; limit : signed) return signed is
    alias v       : signed(x'length - 1 downto 0) is x;
    variable more : std_logic;
    variable room : signed(x'length - SHIFT_LIMIT downto 0);
  begin
    more := or v(SHIFT_LIMIT - 1 downto 0);
    room := resize(v(v'high downto SHIFT_LIMIT), room'length) + limit;
    if (v(v'high downto SHIFT_LIMIT) & more) > (limit & '0') then
      return "01";
    elsif room < 0 then
      return "11";
    end if;
    return "00";
  end function;
begin
  valid(0)   <= in_valid;
  upper      <= signed(resize(delta_max, LIMIT_W));
  lower      <= -signed(resize(delta_max, LIMIT_W));
  delta_0    <= delta_lambda_q when valid(1) = '1' or valid(3) = '1' else delta_lambda_d;
  kp_2       <= flux_kp when flux_mode = PROPOSED else KP_ONE;
  side_4     <= side(total_4, upper);
  integral_0 <= resize(integral_other, FLUX_STATE_W + 1) when valid(1) = '1' else resize(integral, FLUX_STATE_W + 1);

  -- The next integral of the axis
  process (all)
    variable out_of : signed(1 downto 0);
  begin
    out_of  := side(sum_2, upper);
    moved_2 <= sum_2(FLUX_STATE_W - 1 downto 0);
    if flux_mode /= PROPOSED then
      moved_2 <= (others => '0');
    elsif out_of > 0 then
      moved_2 <= shift_left(resize(upper, FLUX_STATE_W), SHIFT_LIMIT);
    elsif out_of < 0 then
      moved_2 <= shift_left(resize(lower, FLUX_STATE_W), SHIFT_LIMIT);
    end if;
  end process;

  -- The limited total; the limit is put in behind the rounding, which cannot move anything past it.
  process (all)
    variable rounded : signed(TOTAL_W - FLUX_TO_STATE downto 0);
  begin
    rounded  := round_half_up(total_4, FLUX_TO_STATE);
    lambda_4 <= rounded(FLUX_W - 1 downto 0);
    if side_4 > 0 then
      lambda_4 <= shift_left(resize(upper, FLUX_W), PU_TO_FLUX);
    elsif side_4 < 0 then
      lambda_4 <= shift_left(resize(lower, FLUX_W), PU_TO_FLUX);
    end if;
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod_i = flux_ki*delta_lambda, or what is forgotten while it is held
      if valid(0) = '1' or valid(1) = '1' then
        prod_i_1 <= delta_0 * signed('0' & flux_ki);
        if delta_held = '1' then
          prod_i_1 <= shift_left(resize(-integral_0, prod_i_1'length), DROP_I - FLUX_COMPENSATION_FORGET);
        end if;
      end if;

      -- Stage 2: sum = integral + prod_i
      if valid(1) = '1' or valid(2) = '1' then
        sum_2 <= plus_rounded(resize(integral, FLUX_STATE_W + 2), prod_i_1, DROP_I);
      end if;
      if valid(1) = '1' then
        integral <= integral_other;
      end if;

      -- Stage 3: integral = sum, limited;  prod_p = flux_kp*delta_lambda
      if valid(2) = '1' or valid(3) = '1' then
        integral_other <= moved_2;
        prod_p_3       <= delta_0 * signed('0' & kp_2);
      end if;
      if valid(3) = '1' then
        integral <= integral_other;
      end if;

      -- Stage 4: total = integral + prod_p
      if valid(3) = '1' or valid(4) = '1' then
        total_4 <= plus_rounded(resize(integral_other, TOTAL_W), prod_p_3, DROP_P);
      end if;

      -- Stage 5: lambda = total, narrowed and limited; d at clock 5, q at 6
      if valid(4) = '1' then
        limited_5    <= side_4(0);
        lambda_pi_d  <= lambda_4;
        lambda_add_d <= lambda_4;
        if flux_mode /= PROPOSED then
          lambda_pi_d <= (others => '0');
        end if;
        if flux_mode /= EARLIER then
          lambda_add_d <= (others => '0');
        end if;
      end if;
      if valid(5) = '1' then
        compensation_limited <= (limited_5 or side_4(0)) when flux_mode = EARLIER or flux_mode = PROPOSED else '0';
        lambda_pi_q          <= lambda_4;
        lambda_add_q         <= lambda_4;
        if flux_mode /= PROPOSED then
          lambda_pi_q <= (others => '0');
        end if;
        if flux_mode /= EARLIER then
          lambda_add_q <= (others => '0');
        end if;
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
