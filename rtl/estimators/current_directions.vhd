-- Purpose: directions that the phase currents will have when the next sample's voltage acts, paper 000 eq. (6).
--   turn = k_ahead*omega_me;  x = i_alpha - turn*i_beta;  y = i_beta + turn*i_alpha
--   s_a = limit(k_sign*x, +-1)
--   s_b = limit(k_sign*(-x + sqrt(3)*y)/2, +-1);  s_c = limit(k_sign*(-x - sqrt(3)*y)/2, +-1)
--   s_alpha, s_beta: their Clarke transform
-- Thirteen products one after the other, through one multiplier and the adder behind it: sum = addend + mul_a*mul_b.
-- The last five are transforms/clarke, which cannot saturate here.  The outputs are state: the next sample starts with
-- them.
-- Formats: PU in and out; k_ahead U(1,16), sqrt(3) U(1,16), k_sign U(12,12); products exact.
-- Latency: 24.  Interval: 24.
-- Rounding: every product half up.  turn, x, y and twice each phase current saturate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity current_directions is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    i_alpha   : in  signed(PU_W - 1 downto 0);
    i_beta    : in  signed(PU_W - 1 downto 0);
    omega_me  : in  signed(PU_W - 1 downto 0);
    k_ahead   : in  unsigned(16 downto 0);
    k_sign    : in  unsigned(23 downto 0);
    out_valid : out std_logic;
    s_alpha   : out signed(PU_W - 1 downto 0);
    s_beta    : out signed(PU_W - 1 downto 0)
  );
end entity current_directions;

architecture rtl of current_directions is
  constant LATENCY : positive                    := CURRENT_DIRECTIONS_LATENCY;
  constant WIDE_W  : positive                    := k_sign'length + 1;
  constant TURN_BY : positive                    := CURRENT_DIRECTIONS_DROP_TURN;
  constant DROP    : positive                    := CURRENT_DIRECTIONS_DROP;
  constant SUM_W   : positive                    := PU_W + WIDE_W;
  constant ONE     : signed(PU_W - 1 downto 0)   := to_signed(CURRENT_DIRECTIONS_ONE, PU_W);
  constant ROOT    : signed(WIDE_W - 1 downto 0) := resize(CURRENT_DIRECTIONS_SQRT3, WIDE_W);
  constant THIRD   : signed(WIDE_W - 1 downto 0) := resize(CLARKE_THIRD, WIDE_W);
  constant BY_BETA : signed(WIDE_W - 1 downto 0) := resize(CLARKE_INV_SQRT3, WIDE_W);

  -- An LSB less than half: what is rounded half up and then negated is half down.
  constant HALF_DOWN : signed(TURN_BY - 1 downto 0) := (TURN_BY - 1 => '0', others => '1');

  signal valid     : std_logic_vector(0 to LATENCY);
  signal factor_a  : signed(WIDE_W - 1 downto 0);
  signal factor_b  : signed(PU_W - 1 downto 0);
  signal mul_a     : signed(WIDE_W - 1 downto 0);
  signal mul_b     : signed(PU_W - 1 downto 0);
  signal prod      : signed(SUM_W - 1 downto 0);
  signal addend    : signed(SUM_W - 1 downto 0);
  signal sum       : signed(SUM_W - 1 downto 0);
  signal narrow    : signed(PU_W - 1 downto 0);
  signal not_x_7   : signed(PU_W - 1 downto 0);
  signal minus_x_8 : signed(PU_W downto 0);
  signal s         : signed(SUM_W - 1 - DROP downto 0);
  signal s_past    : std_logic;
  signal s_end     : signed(PU_W - 1 downto 0);
  signal s_next    : signed(PU_W - 1 downto 0);     -- the phases take turns: the one that comes next, the others
  signal s_then    : signed(PU_W - 1 downto 0);
  signal s_last    : signed(PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  narrow <= saturate(sum(SUM_W - 1 downto TURN_BY), PU_W);

  -- A direction, and whether it is past one: its bits from that of one on are not all alike.
  s      <= sum(SUM_W - 1 downto DROP);
  s_past <= exceeds(s, PU_W - 1);
  s_end  <= -ONE when s < 0 else ONE;

  factor_a <= resize(i_beta, WIDE_W) when valid(3) = '1' else
              resize(i_alpha, WIDE_W) when valid(4) = '1' else
              ROOT when valid(7) = '1' else
              -ROOT when valid(8) = '1' else
              signed('0' & k_sign) when valid(10) = '1' else
              signed(resize(k_ahead, WIDE_W)) when valid(0) = '1' else
              shift_left(THIRD, 1) when valid(18) = '1' else
              -THIRD when valid(16) = '1' else
              -BY_BETA when valid(20) = '1' else
              BY_BETA;
  factor_b <= narrow when (valid(3) or valid(7) or valid(10) or valid(11)) = '1' else
              saturate((not not_x_7) & '0', PU_W) when valid(12) = '1' else
              omega_me when valid(0) = '1' else
              s_next;

  -- x comes as its complement: the adder behind the multiplier only adds.
  addend <= rounding_base(not i_alpha, TURN_BY, SUM_W) when valid(5) = '1' else
            rounding_base(i_beta, TURN_BY, SUM_W) when valid(6) = '1' else
            rounding_base(minus_x_8, TURN_BY, SUM_W) when valid(9) = '1' else
            resize(minus_x_8 & HALF_DOWN, SUM_W) when valid(10) = '1' else
            sum when valid(19) = '1' or valid(20) = '1' or valid(22) = '1' else
            rounding_base("0", CLARKE_DROP_ALPHA, SUM_W) when valid(18) = '1' else
            rounding_base("0", CLARKE_DROP_BETA, SUM_W) when valid(21) = '1' else
            rounding_base("0", TURN_BY, SUM_W) when valid(2) = '1' else
            rounding_base("0", DROP, SUM_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 4, 5, 8, 9, 11 to 13, 17 to 21: the factors; where one of them is missing it stays
      if (valid(0) or valid(3) or valid(4) or valid(7) or valid(8) or valid(10) or valid(16) or valid(18) or valid(19)
          or valid(20)) = '1' then
        mul_a <= factor_a;
      end if;
      if (valid(0) or valid(3) or valid(7) or valid(10) or valid(11) or valid(12) or valid(16) or valid(17) or valid(18)
          or valid(19) or valid(20)) = '1' then
        mul_b <= factor_b;
      end if;

      -- Stages 2, 5, 6, 9, 10, 12 to 14: prod = omega_me*k_ahead, turn*i_beta, turn*i_alpha, sqrt(3)*y, -sqrt(3)*y,
      -- then k_sign times twice the currents of b, c, a;  stages 18 to 22: -1/3*s_b, -1/3*s_c, 2/3*s_a,
      -- s_b/sqrt(3), -s_c/sqrt(3)
      if (valid(1) or valid(4) or valid(5) or valid(8) or valid(9) or valid(11) or valid(12) or valid(13) or valid(17)
          or valid(18) or valid(19) or valid(20) or valid(21)) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stages 3, 6, 7, 10, 11, 13 to 15, 19 to 23: sum = turn, not x, y, twice b, twice c, s_b, s_c, s_a, s_alpha,
      -- s_beta
      if (valid(2) or valid(5) or valid(6) or valid(9) or valid(10) or valid(12) or valid(13) or valid(14) or valid(18)
          or valid(19) or valid(20) or valid(21) or valid(22)) = '1' then
        sum <= addend + prod;
      end if;

      -- Stages 7, 8: not_x = sum, narrowed;  minus_x = not_x + 1
      if valid(6) = '1' then
        not_x_7 <= narrow;
      end if;
      if valid(7) = '1' then
        minus_x_8 <= resize(not_x_7, PU_W + 1) + 1;
      end if;

      -- Stages 14 to 16: s = sum, narrowed and limited;  stages 17 to 21: they take turns as factors
      if (valid(13) or valid(14) or valid(15) or valid(16) or valid(17) or valid(18) or valid(19)) = '1' then
        s_next <= s_then;
        s_then <= s_last;
        s_last <= s_next;
      end if;
      if (valid(13) or valid(14) or valid(15)) = '1' then
        s_last <= s(PU_W - 1 downto 0);
      end if;
      if (valid(13) or valid(14) or valid(15)) = '1' and s_past = '1' then
        s_last <= s_end;
      end if;

      -- Stages 22, 24: s_alpha, s_beta = sum, narrowed
      if valid(21) = '1' then
        s_alpha <= sum(PU_W - 1 + CLARKE_DROP_ALPHA downto CLARKE_DROP_ALPHA);
      end if;
      if valid(23) = '1' then
        s_beta <= sum(PU_W - 1 + CLARKE_DROP_BETA downto CLARKE_DROP_BETA);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        s_alpha             <= (others => '0');
        s_beta              <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
