-- Purpose: predicted directions of the phase currents when the next sample's voltage acts, paper 000 eq. (6).
--   turn = k_ahead*omega_me;  x = i_alpha - turn*i_beta;  y = i_beta + turn*i_alpha
--   s_a = limit(k_sign*x, +-1)
--   s_b = limit(k_sign*(-x + sqrt(3)*y)/2, +-1);  s_c = limit(k_sign*(-x - sqrt(3)*y)/2, +-1)
--   s_alpha, s_beta: their Clarke transform
-- Thirteen products one after the other, through one multiplier and the adder behind it: sum = addend + mul_a*mul_b.
-- The last five are the Clarke transform of transforms/clarke, alternating between alpha and beta; it cannot saturate
-- here.  The outputs are state: the next sample starts with them.
-- Formats: PU in and out; k_ahead U(1,16), sqrt(3) U(1,16), k_sign U(12,12); products exact.
-- Latency: 31.  Interval: 31.
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

  -- One LSB less than half: a value that is negated after rounding half up is rounded half down before.
  constant HALF_DOWN : signed(TURN_BY - 1 downto 0) := (TURN_BY - 1 => '0', others => '1');

  signal valid      : std_logic_vector(0 to LATENCY);
  signal by_sign    : std_logic;                          -- the factor is k_sign
  signal by_current : std_logic;                          -- the factor is a current
  signal by_third   : std_logic;                          -- the factor is -1/3 in the next clock
  signal by_phase   : std_logic;                          -- the other factor is a direction
  signal on_sum     : std_logic;                          -- the sum is accumulated
  signal on_sign    : std_logic;                          -- half an LSB of a direction
  signal s_moves    : std_logic;
  signal current_a  : signed(PU_W - 1 downto 0);
  signal constant_0 : signed(WIDE_W - 1 downto 0);        -- next value of constant_a
  signal constant_a : signed(WIDE_W - 1 downto 0);
  signal factor_a   : signed(WIDE_W - 1 downto 0);
  signal factor_b   : signed(PU_W - 1 downto 0);
  signal mul_a      : signed(WIDE_W - 1 downto 0);
  signal mul_b      : signed(PU_W - 1 downto 0);
  signal product    : signed(SUM_W - 1 downto 0);         -- next values of prod, sum and past
  signal total      : signed(SUM_W - 1 downto 0);
  signal past_0     : std_logic;
  signal prod       : signed(SUM_W - 1 downto 0);
  signal base       : signed(SUM_W - 1 downto 0);
  signal addend     : signed(SUM_W - 1 downto 0);
  signal sum        : signed(SUM_W - 1 downto 0);
  signal cut        : signed(SUM_W - 1 - TURN_BY downto 0);  -- the sum a clock ago; past: it exceeds PU
  signal past       : std_logic;
  signal narrow     : signed(PU_W - 1 downto 0);          -- turn at clock 5, not x at 10, y at 11, b at 16, c at 17
  signal minus_x_11 : signed(PU_W downto 0);
  signal twice_a_11 : signed(PU_W - 1 downto 0);
  signal s          : signed(SUM_W - 1 - DROP downto 0);  -- a direction; any, all: OR, AND of its bits >= 1
  signal s_any      : std_logic;
  signal s_all      : std_logic;
  signal s_next     : signed(PU_W - 1 downto 0);          -- the directions as a shift register
  signal s_then     : signed(PU_W - 1 downto 0);
  signal s_last     : signed(PU_W - 1 downto 0);

  -- v if sel is '1', else zero
  function when_set (v : signed; sel : std_logic) return signed is
    alias u : signed(v'length - 1 downto 0) is v;
  begin
    return u and (v'length - 1 downto 0 => sel);
  end function;
begin
  valid(0) <= in_valid;

  -- An AND-OR selection with one select bit per operand, without priority, which keeps the path short.
  factor_a <= when_set(signed(resize(k_ahead, WIDE_W)), valid(0))
              or when_set(resize(current_a, WIDE_W), by_current)
              or when_set(signed('0' & k_sign), by_sign)
              or constant_a;
  factor_b <= omega_me when valid(0) = '1' else
              twice_a_11 when valid(18) = '1' else
              s_next when by_phase = '1' else
              narrow;

  -- x is calculated as its complement, because the adder behind the multiplier can only add.
  base <= when_set(rounding_base(not i_alpha, TURN_BY, SUM_W), valid(6))
          or when_set(rounding_base(i_beta, TURN_BY, SUM_W), valid(7))
          or when_set(rounding_base(minus_x_11, TURN_BY, SUM_W), valid(12))
          or when_set(resize(minus_x_11 & HALF_DOWN, SUM_W), valid(13))
          or when_set(sum, on_sum)
          or when_set(rounding_base("0", CLARKE_DROP_ALPHA, SUM_W), valid(24))
          or when_set(rounding_base("0", CLARKE_DROP_BETA, SUM_W), valid(25))
          or when_set(rounding_base("0", TURN_BY, SUM_W), valid(1))
          or when_set(rounding_base("0", DROP, SUM_W), on_sign);

  -- Outside the clocked process, so that a simulator computes them only when an operand changes.
  product    <= mul_a * mul_b;
  total      <= addend + prod;
  past_0     <= exceeds(sum(SUM_W - 1 downto TURN_BY), PU_W);
  constant_0 <= when_set(ROOT, valid(10)) or when_set(-ROOT, valid(11)) or when_set(-THIRD, by_third)
                or when_set(BY_BETA, valid(23)) or when_set(-BY_BETA, valid(25))
                or when_set(shift_left(THIRD, 1), valid(26));

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Select bits that depend on several clocks are registered one clock before their use.
      by_sign    <= or valid(15 to 17);
      by_current <= valid(4) or valid(5);
      by_third   <= valid(21) or valid(23);
      by_phase   <= or valid(22 to 26);
      on_sum     <= or valid(25 to 27);
      on_sign    <= by_sign;
      s_moves    <= valid(19) or valid(20) or valid(21) or valid(23) or valid(25);
      current_a  <= i_beta when valid(4) = '1' else i_alpha;
      constant_a <= constant_0;

      -- Stages 1, 6, 7, 12, 13, 17 to 19, 24 to 28: the factors
      mul_a <= factor_a;
      mul_b <= factor_b;

      -- Stages 2, 7, 8, 13, 14, 18 to 20: prod = omega_me*k_ahead, turn*i_beta, turn*i_alpha, sqrt(3)*y, -sqrt(3)*y,
      -- then k_sign times twice the currents of b, c, a;  stages 25 to 29: -1/3*s_b, s_b/sqrt(3), -1/3*s_c,
      -- -s_c/sqrt(3), 2/3*s_a;  addend: the other operand of the sum
      prod   <= product;
      addend <= base;

      -- Stages 3, 8, 9, 14, 15, 19 to 21, 26 to 30: sum = turn, not x, y, twice b, twice c, s_b, s_c, s_a, then s_alpha
      -- and s_beta alternately
      sum <= total;

      -- Stages 4, 5, 9 to 11, 15 to 17: narrow = sum, narrowed
      cut  <= sum(SUM_W - 1 downto TURN_BY);
      past <= past_0;
      if (valid(4) or valid(9) or valid(10) or valid(15) or valid(16)) = '1' then
        narrow <= narrowed(cut, past, PU_W);
      end if;

      -- Stage 11: minus_x = not_x + 1;  twice_a = 2*x, narrowed
      if valid(10) = '1' then
        minus_x_11 <= resize(narrow, PU_W + 1) + 1;
        twice_a_11 <= saturate((not narrow) & '0', PU_W);
      end if;

      -- Stages 20 to 23: s = sum, narrowed and limited: beyond +-1 if its bits from that of 1 on are not all equal;
      -- stages 25, 27: the next phase
      s     <= sum(SUM_W - 1 downto DROP);
      s_any <= or sum(SUM_W - 1 downto DROP + PU_W - 2);
      s_all <= and sum(SUM_W - 1 downto DROP + PU_W - 2);
      if s_moves = '1' then
        s_next <= s_then;
        s_then <= s_last;
        s_last <= s(PU_W - 1 downto 0);
        if s_any = '1' and s_all = '0' then
          s_last <= -ONE when s < 0 else ONE;
        end if;
      end if;

      -- Stages 30, 31: s_beta, s_alpha = sum, narrowed
      if valid(29) = '1' then
        s_beta <= sum(PU_W - 1 + CLARKE_DROP_BETA downto CLARKE_DROP_BETA);
      end if;
      if valid(30) = '1' then
        s_alpha <= sum(PU_W - 1 + CLARKE_DROP_ALPHA downto CLARKE_DROP_ALPHA);
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
