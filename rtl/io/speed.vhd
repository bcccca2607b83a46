-- Purpose: speed from two consecutive position codes, then a first-order filter.
--   raw(k)      = k_speed * wrap(code(k) - code(k-1))
--   omega_me(k) = omega_me(k-1) + k_filter*(raw(k) - omega_me(k-1))
-- Formats: difference S(-1,18) of a turn, k_speed U(12,12), k_filter U(1,16) up to 1, state S(1,28), output PU.
-- Latency: 6.  Interval: 4 (the state is read from stage 3 on and written at stage 6).
-- Rounding: half up; raw saturates at 2 per unit.  The state is stored with a bias of half an LSB of PU, so that
-- truncation rounds omega_me.  It moves towards raw by at most their distance, so it cannot leave its range.
-- The first sample after reset has no predecessor: its difference is zero.
-- The difference is one sum of the code, inverted if reverse = 1, and minus the previous code, which is stored negated.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity speed is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk        : in  std_logic;
    rst        : in  std_logic;
    in_valid   : in  std_logic;
    code_theta : in  unsigned(POSITION_BITS - 1 downto 0);
    reverse    : in  std_logic;
    k_speed    : in  unsigned(23 downto 0);
    k_filter   : in  unsigned(16 downto 0);
    out_valid  : out std_logic;
    omega_me   : out signed(PU_W - 1 downto 0)
  );
end entity speed;

architecture rtl of speed is
  constant LATENCY : positive := SPEED_LATENCY;
  constant SUM_W   : positive := INTEGRAL_W + SPEED_DROP_STATE;
  constant REST_W  : positive := PU_TO_INTEGRAL + SPEED_DROP_STATE;

  -- State, with minus_last and seen: omega_me and the bits below it in the sum.  Two registers, because the register of
  -- a DSP48 resets to zero only and yosys would use it for a state with another reset value
  signal omega_6 : signed(PU_W - 1 downto 0);
  signal rest_6  : signed(REST_W - 1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal minus_last : unsigned(POSITION_BITS - 1 downto 0);
  signal seen       : std_logic;
  signal delta_1    : signed(TURN_W - 1 downto 0);
  signal prod_raw_2 : signed(TURN_W + 24 downto 0);
  signal sum_raw_3  : signed(TURN_W + 24 downto 0);
  signal falls_2    : std_logic;
  signal raw_3      : signed(TURN_W + 24 - SPEED_DROP_RAW downto 0);
  signal err_end_3  : signed(PU_W downto 0);  -- err if raw is beyond its range
  signal err_4      : signed(PU_W downto 0);
  signal prod_err_5 : signed(PU_W + 18 downto 0);

  -- The code, or its complement; the bit below the LSB adds the one that the complement lacks.
  function turned (code : unsigned; minus : std_logic) return unsigned is
  begin
    return (code xor (code'range => minus)) & minus;
  end function;
begin
  valid(0) <= in_valid;
  raw_3    <= sum_raw_3(sum_raw_3'high downto SPEED_DROP_RAW);

  process (clk)
    variable code  : unsigned(POSITION_BITS downto 0);
    variable minus : unsigned(POSITION_BITS downto 0);
    variable delta : unsigned(POSITION_BITS downto 0);
    variable state : signed(INTEGRAL_W - 1 downto 0);
    variable sum   : signed(SUM_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: delta = code - last code, the shorter angle
      if valid(0) = '1' then
        code       := turned(code_theta, reverse);
        minus      := turned(code_theta, not reverse) + 1;
        delta      := (code and (code'range => seen)) + (minus_last & '1');
        delta_1    <= shift_left(resize(signed(delta(POSITION_BITS downto 1)), TURN_W), TURN_W - POSITION_BITS);
        minus_last <= minus(POSITION_BITS downto 1);
        seen       <= '1';
      end if;

      -- Stage 2: prod_raw = delta * k_speed
      if valid(1) = '1' then
        prod_raw_2 <= delta_1 * signed('0' & k_speed);
        falls_2    <= delta_1(delta_1'high);
      end if;

      -- Stage 3: raw plus half an LSB for the rounding;  err for a saturated raw, with the sign of delta
      if valid(2) = '1' then
        sum_raw_3 <= prod_raw_2 + half(SPEED_DROP_RAW, prod_raw_2'length);
        err_end_3 <= resize(signed'(falls_2 & (PU_W - 2 downto 0 => not falls_2)), PU_W + 1) - omega_6;
      end if;

      -- Stage 4: err = raw - omega_me, raw narrowed
      if valid(3) = '1' then
        err_4 <= resize(raw_3(PU_W - 1 downto 0), PU_W + 1) - omega_6;
        if exceeds(raw_3, PU_W) = '1' then
          err_4 <= err_end_3;
        end if;
      end if;

      -- Stage 5: prod_err = err * k_filter
      if valid(4) = '1' then
        prod_err_5 <= err_4 * signed('0' & k_filter);
      end if;

      -- Stage 6: omega + prod_err plus half an LSB for the rounding
      if valid(5) = '1' then
        state   := omega_6 & rest_6(REST_W - 1 downto SPEED_DROP_STATE);
        sum     := prod_err_5(SUM_W - 1 downto 0) + (state & half(SPEED_DROP_STATE, SPEED_DROP_STATE));
        omega_6 <= sum(SUM_W - 1 downto REST_W);
        rest_6  <= sum(REST_W - 1 downto 0);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        seen                <= '0';
        minus_last          <= (others => '0');
        omega_6             <= (others => '0');
        rest_6              <= half(REST_W, REST_W);
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);
  omega_me  <= omega_6;

end architecture rtl;
