-- Purpose: plausibility checks of a raw sample, one bit each, evaluated with every sample.
--   0  overcurrent    |i_x| >= i_trip in any phase
--   1  current sum    |i_a + i_b + i_c| >= sum_trip
--   2  at the rail    a code at its end in rail_samples consecutive samples
--   3  bus low        u_dc < u_dc_min
--   4  bus high       u_dc >= u_dc_max
--   5  position       |code - (2*code' - code'')| >= jump_max, from the third sample after a reset on
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
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    i_a             : in  signed(PU_W - 1 downto 0);
    i_b             : in  signed(PU_W - 1 downto 0);
    i_c             : in  signed(PU_W - 1 downto 0);
    current_at_rail : in  unsigned(2 downto 0);
    u_dc            : in  unsigned(DUTY_W - 1 downto 0);
    u_dc_at_rail    : in  std_logic;
    code_theta      : in  unsigned(POSITION_BITS - 1 downto 0);
    i_trip          : in  unsigned(LIMIT_W - 1 downto 0);
    sum_trip        : in  unsigned(LIMIT_W - 1 downto 0);
    rail_samples    : in  unsigned(3 downto 0);
    u_dc_min        : in  unsigned(LIMIT_W - 1 downto 0);
    u_dc_max        : in  unsigned(LIMIT_W - 1 downto 0);
    jump_max        : in  unsigned(11 downto 0);
    fault_ignore    : in  unsigned(6 downto 0);
    out_valid       : out std_logic;
    sample_faults   : out unsigned(5 downto 0);
    sample_trip     : out std_logic
  );
end entity sample_checks;

architecture rtl of sample_checks is
  constant LATENCY : positive := SAMPLE_CHECKS_LATENCY;
  constant DROP    : natural  := SAMPLE_CHECKS_DROP_LIMIT;

  -- State
  signal code     : unsigned(TURN_W - 1 downto 0);
  signal expected : unsigned(TURN_W - 1 downto 0);
  signal seen     : unsigned(1 downto 0);
  signal railed   : unsigned(3 downto 0);

  signal valid     : std_logic_vector(0 to LATENCY);
  signal a_0       : signed(LIMIT_W downto 0);
  signal b_0       : signed(LIMIT_W downto 0);
  signal c_0       : signed(LIMIT_W downto 0);
  signal bus_0     : unsigned(LIMIT_W - 1 downto 0);
  signal code_0    : unsigned(TURN_W - 1 downto 0);
  signal at_rail_0 : std_logic;
  signal at_rail_1 : std_logic;
  signal railed_1  : unsigned(3 downto 0);
  signal pair_1    : signed(LIMIT_W + 2 downto 0);
  signal away_1    : signed(TURN_W - 1 downto 0);
  signal known_1   : std_logic;
  signal sum_2     : signed(LIMIT_W + 2 downto 0);
  signal off_2     : signed(TURN_W - 1 - SAMPLE_CHECKS_DROP_JUMP downto 0);
  signal over_3    : unsigned(2 downto 0);
  signal checks_3  : unsigned(5 downto 1);
  signal faults_3  : unsigned(5 downto 0);

  function reaches (x : signed; limit : unsigned) return std_logic is
    variable magnitude : signed(x'length - 1 downto 0);
  begin
    magnitude := x;
    if magnitude(magnitude'high) = '1' then
      magnitude := not magnitude;
    end if;
    if limit <= unsigned(magnitude) then
      return '1';
    end if;
    return '0';
  end function;

  -- The same for wide numbers, only the sign of the difference: nothing follows the carry chain
  function reaches_wide (x : signed; limit : unsigned) return std_logic is
    variable magnitude : signed(x'length downto 0);
    variable beyond    : signed(x'length downto 0);
  begin
    magnitude := resize(x, x'length + 1);
    if x(x'high) = '1' then
      magnitude := not magnitude;
    end if;
    beyond := magnitude - signed(resize(limit, x'length + 1));
    return not beyond(beyond'high);
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
  railed_1  <= railed when railed = 15 else railed + 1;

  off_2    <= away_1(TURN_W - 1 downto SAMPLE_CHECKS_DROP_JUMP);
  faults_3 <= checks_3 & (or over_3);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: deviation of the code from the expected one; expected = 2*code - code' for the next sample;  i_a + i_b
      if valid(0) = '1' then
        pair_1    <= resize(a_0, LIMIT_W + 3) + b_0;
        away_1    <= signed(code_0 - expected);
        known_1   <= '1' when seen = SAMPLE_CHECKS_WARM else '0';
        code      <= code_0;
        expected  <= shift_left(code_0, 1) - code;
        at_rail_1 <= at_rail_0;
        if seen /= SAMPLE_CHECKS_WARM then
          seen <= seen + 1;
        end if;
      end if;

      -- Stage 2: i_a + i_b + i_c;  consecutive samples at the rail
      if valid(1) = '1' then
        sum_2  <= pair_1 + c_0;
        railed <= (others => '0');
        if at_rail_1 = '1' then
          railed <= railed_1;
        end if;
      end if;

      -- Stage 3: comparisons with the limits
      if valid(2) = '1' then
        over_3(0)   <= reaches(a_0, i_trip);
        over_3(1)   <= reaches(b_0, i_trip);
        over_3(2)   <= reaches(c_0, i_trip);
        checks_3(1) <= reaches_wide(sum_2, sum_trip);
        checks_3(2) <= '1' when railed > 0 and railed >= rail_samples else '0';
        checks_3(3) <= less(bus_0, u_dc_min);
        checks_3(4) <= not less(bus_0, u_dc_max);
        checks_3(5) <= reaches_wide(off_2, jump_max) and known_1;
      end if;

      -- Stage 4: faults of this sample
      if valid(3) = '1' then
        sample_faults <= faults_3;
        sample_trip   <= or (faults_3 and not fault_ignore(5 downto 0));
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        code                <= (others => '0');
        expected            <= (others => '0');
        seen                <= (others => '0');
        railed              <= (others => '0');
        sample_faults       <= (others => '0');
        sample_trip         <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
