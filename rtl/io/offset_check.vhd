-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the zero of the current sensors: mean of each phase's current while the gates are off and the shaft stands.
--   mean_x = sum of 2**WINDOW_BITS samples of i_x / 2**WINDOW_BITS;  current_offset = |mean_x| >= offset_max in any phase
-- Evaluated after each window of consecutive samples with run = 0 and |omega_me| < omega_stall; otherwise the last
-- verdict stays.
-- Formats: currents cut to 12 fraction bits, sums exact, offset_max U(-2,12).
-- One adder serves the three phases in sequence: their sums go round, one place a clock.
-- Latency: 4.  Interval: 4.  Rounding: currents and mean are floored, together up to 2/4096 per unit too low; |x| is the
-- one's complement where x is negative.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity offset_check is
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    in_valid       : in  std_logic;
    i_a            : in  signed(PU_W - 1 downto 0);
    i_b            : in  signed(PU_W - 1 downto 0);
    i_c            : in  signed(PU_W - 1 downto 0);
    omega_me       : in  signed(PU_W - 1 downto 0);
    run            : in  std_logic;
    omega_stall    : in  unsigned(LIMIT_W - 1 downto 0);
    offset_max     : in  unsigned(9 downto 0);
    out_valid      : out std_logic;
    current_offset : out std_logic
  );
end entity offset_check;

architecture rtl of offset_check is
  constant LATENCY : positive := OFFSET_CHECK_LATENCY;
  constant FINE_W  : positive := PU_W - OFFSET_CHECK_DROP_FINE;
  constant SUM_W   : positive := FINE_W + OFFSET_CHECK_WINDOW_BITS;

  type state_t is record
    sum_a : signed(SUM_W - 1 downto 0);  -- after each sample; in between the next phase's sum is here
    sum_b : signed(SUM_W - 1 downto 0);
    sum_c : signed(SUM_W - 1 downto 0);
    count : unsigned(OFFSET_CHECK_WINDOW_BITS - 1 downto 0);
    found : std_logic;
  end record state_t;

  signal state : state_t;

  signal valid   : std_logic_vector(0 to LATENCY);
  signal adds    : std_logic;
  signal sample  : signed(PU_W - 1 downto 0);
  signal before  : signed(SUM_W - 1 downto 0);
  signal sum     : signed(SUM_W - 1 downto 0);
  signal mean    : signed(FINE_W - 1 downto 0);
  signal off     : std_logic;
  signal still_1 : std_logic;
  signal any     : std_logic;

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
begin
  valid(0) <= in_valid;

  -- Stages 1 to 3: sum_x = sum_x + i_x, of phase a, b, c in sequence
  adds   <= valid(0) or valid(1) or valid(2);
  sample <= i_a when valid(0) = '1' else i_b when valid(1) = '1' else i_c;
  before <= (others => '0') when state.count = 0 else state.sum_a;
  sum    <= before + sample(PU_W - 1 downto OFFSET_CHECK_DROP_FINE);
  mean   <= sum(SUM_W - 1 downto OFFSET_CHECK_WINDOW_BITS);
  off    <= reaches(mean, offset_max);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: still = gates off and |omega_me| < omega_stall
      if valid(0) = '1' then
        still_1 <= not run and not reaches(omega_me(PU_W - 1 downto PU_W - 1 - LIMIT_W), omega_stall);
      end if;

      -- Stages 1 to 3: the sums go round;  any = a mean beyond the limit
      if adds = '1' then
        state.sum_a <= state.sum_b;
        state.sum_b <= state.sum_c;
        state.sum_c <= sum;
        any         <= off or (any and not valid(0));
      end if;

      -- Stage 4: the verdict at the end of a window;  count = samples in the sums
      if valid(3) = '1' then
        state.count <= (others => '0');
        if still_1 = '1' then
          state.count <= state.count + 1;
          if (and state.count) = '1' then
            state.found <= any;
          end if;
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.count         <= (others => '0');
        state.found         <= '0';
      end if;
    end if;
  end process;

  current_offset <= state.found;
  out_valid      <= valid(LATENCY);

end architecture rtl;
