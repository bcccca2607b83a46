-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: plausibility checks of a raw sample, one bit each, evaluated with every sample.
--   0  overcurrent    |i_x| >= i_trip in any phase
--   1  current sum    |i_a + i_b + i_c| >= sum_trip
--   2  at the rail    a code at its end in rail_samples consecutive samples
--   3  bus low        u_dc < u_dc_min
--   4  bus high       u_dc >= u_dc_max
--   5  position       |code - (2*code' - code'')| >= jump_max, from the third sample after a reset on; a sample with
--                     position_restart is the first one again
-- sample_trip: at least one fault that fault_ignore does not mask.
-- Formats: limits U(1,8), jump_max U(-1,13), codes in 1/2**18 turn, differences as the shorter angle.
-- Latency: 4.  Interval: 3.  Rounding: values are cut (floor) to the limits' formats; |x| is the one's complement where
-- x is negative: a negative current trips one LSB later, the sum up to 3/256 later or earlier.  No overflow: the sum
-- has two bits more than its terms, the rail counter saturates.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity sample_checks is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk              : in  std_logic;
    rst              : in  std_logic;
    in_valid         : in  std_logic;
    i_a              : in  signed(PU_W - 1 downto 0);
    i_b              : in  signed(PU_W - 1 downto 0);
    i_c              : in  signed(PU_W - 1 downto 0);
    current_at_rail  : in  unsigned(2 downto 0);
    u_dc             : in  unsigned(DUTY_W - 1 downto 0);
    u_dc_at_rail     : in  std_logic;
    code_theta       : in  unsigned(POSITION_BITS - 1 downto 0);
    i_trip           : in  unsigned(LIMIT_W - 1 downto 0);
    sum_trip         : in  unsigned(LIMIT_W - 1 downto 0);
    rail_samples     : in  unsigned(3 downto 0);
    u_dc_min         : in  unsigned(LIMIT_W - 1 downto 0);
    u_dc_max         : in  unsigned(LIMIT_W - 1 downto 0);
    jump_max         : in  unsigned(11 downto 0);
    fault_ignore     : in  unsigned(15 downto 0);
    position_restart : in  std_logic;
    out_valid        : out std_logic;
    sample_faults    : out unsigned(5 downto 0);
    sample_trip      : out std_logic
  );
end entity sample_checks;

architecture rtl of sample_checks is
  constant LATENCY : positive := SAMPLE_CHECKS_LATENCY;
  constant DROP    : natural  := SAMPLE_CHECKS_DROP_LIMIT;

  type state_t is record
    code     : unsigned(TURN_W - 1 downto 0);
    expected : unsigned(TURN_W - 1 downto 0);
    seen     : unsigned(1 downto 0);
    railed   : unsigned(3 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid        : std_logic_vector(0 to LATENCY);
  signal a_0          : signed(LIMIT_W downto 0);
  signal b_0          : signed(LIMIT_W downto 0);
  signal c_0          : signed(LIMIT_W downto 0);
  signal bus_0        : unsigned(LIMIT_W - 1 downto 0);
  signal code_0       : unsigned(TURN_W - 1 downto 0);
  signal at_rail_0    : std_logic;
  signal pair_1       : signed(LIMIT_W + 2 downto 0);
  signal at_rail_1    : std_logic;
  signal away_1       : signed(TURN_W - 1 downto 0);
  signal known_1      : std_logic;
  signal sum_2        : signed(LIMIT_W + 2 downto 0);
  signal off_2        : signed(TURN_W - 1 - SAMPLE_CHECKS_DROP_JUMP downto 0);
  signal over_a_3     : std_logic;
  signal over_b_3     : std_logic;
  signal over_c_3     : std_logic;
  signal unbalanced_3 : std_logic;
  signal stuck_3      : std_logic;
  signal low_3        : std_logic;
  signal high_3       : std_logic;
  signal jumped_3     : std_logic;
  signal faults_3     : unsigned(5 downto 0);

  -- '1' if |x| >= limit, |x| being the one's complement where x is negative
  function reaches (x : signed; limit : unsigned) return std_logic is
    variable size : signed(x'length - 1 downto 0);
  begin
    size := x xor x(x'high);
    if unsigned(size) >= limit then
      return '1';
    end if;
    return '0';
  end function;

  -- The same for wide numbers, only the sign of the difference: nothing follows the carry chain
  function reaches_wide (x : signed; limit : unsigned) return std_logic is
    variable room : signed(x'length downto 0);
  begin
    room := resize(x xor x(x'high), x'length + 1) - signed(resize(limit, x'length + 1));
    return not room(room'high);
  end function;

  function less (x : unsigned; limit : unsigned) return std_logic is
  begin
    if x < limit then
      return '1';
    end if;
    return '0';
  end function;
begin
  valid(0) <= in_valid;

  a_0       <= i_a(PU_W - 1 downto DROP);
  b_0       <= i_b(PU_W - 1 downto DROP);
  c_0       <= i_c(PU_W - 1 downto DROP);
  bus_0     <= u_dc(DUTY_W - 1 downto DROP);
  code_0    <= shift_left(resize(code_theta, TURN_W), TURN_W - POSITION_BITS);
  at_rail_0 <= (or current_at_rail) or u_dc_at_rail;
  off_2     <= away_1(TURN_W - 1 downto SAMPLE_CHECKS_DROP_JUMP);

  faults_3 <= jumped_3 & high_3 & low_3 & stuck_3 & unbalanced_3 & (over_a_3 or over_b_3 or over_c_3);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: pair = a + b;  away = code - expected;  expected = 2*code - code' for the next sample
      if valid(0) = '1' then
        pair_1         <= resize(a_0, LIMIT_W + 3) + b_0;
        at_rail_1      <= at_rail_0;
        away_1         <= signed(code_0 - state.expected);
        known_1        <= '1' when state.seen = SAMPLE_CHECKS_WARM and position_restart = '0' else '0';
        state.code     <= code_0;
        state.expected <= shift_left(code_0, 1) - state.code;
        if position_restart = '1' then
          state.seen <= to_unsigned(1, 2);
        elsif state.seen /= SAMPLE_CHECKS_WARM then
          state.seen <= state.seen + 1;
        end if;
      end if;

      -- Stage 2: sum = a + b + c;  railed = consecutive samples at the rail, 15 at most
      if valid(1) = '1' then
        sum_2 <= pair_1 + c_0;
        if at_rail_1 = '0' then
          state.railed <= (others => '0');
        elsif state.railed /= 15 then
          state.railed <= state.railed + 1;
        end if;
      end if;

      -- Stage 3: comparisons with the limits
      if valid(2) = '1' then
        over_a_3     <= reaches(a_0, i_trip);
        over_b_3     <= reaches(b_0, i_trip);
        over_c_3     <= reaches(c_0, i_trip);
        unbalanced_3 <= reaches_wide(sum_2, sum_trip);
        stuck_3      <= '1' when state.railed > 0 and state.railed >= rail_samples else '0';
        low_3        <= less(bus_0, u_dc_min);
        high_3       <= not less(bus_0, u_dc_max);
        jumped_3     <= reaches_wide(off_2, jump_max) and known_1;
      end if;

      -- Stage 4: faults of this sample
      if valid(3) = '1' then
        sample_faults <= faults_3;
        sample_trip   <= or (faults_3 and not fault_ignore(5 downto 0));
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (others => (others => '0'));
        sample_faults       <= (others => '0');
        sample_trip         <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
