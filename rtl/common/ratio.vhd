-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the ratio of two magnitudes, two quotient bits per clock.
--   ratio = dividend/divisor;  its largest value and full = 1 where dividend >= divisor
-- Method: restoring division.
-- Formats: dividend and divisor are integers of one scale; ratio U(0,16).  Latency: 9.  Interval: 9.
-- Rounding: floored.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity ratio is
  generic (
    DIVIDEND_W : positive range PU_W to 24 := PU_W
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    dividend  : in  unsigned(DIVIDEND_W - 1 downto 0);
    divisor   : in  unsigned(PU_W - 1 downto 0);
    out_valid : out std_logic;
    ratio     : out unsigned(15 downto 0);
    full      : out std_logic
  );
end entity ratio;

architecture rtl of ratio is
  constant LATENCY : positive := RATIO_LATENCY;

  subtype size_t is unsigned(PU_W - 1 downto 0);

  signal valid    : std_logic_vector(0 to LATENCY);
  signal rest     : size_t;
  signal dividing : std_logic;
  signal step_1   : unsigned(PU_W downto 0);  -- bit of the quotient, rest
  signal step_2   : unsigned(PU_W downto 0);

  -- One step of the division: bit of the quotient, and the new rest below it.
  function divided (remainder : size_t; by : size_t) return unsigned is
    constant TRIAL : unsigned(PU_W + 1 downto 0) := ('0' & remainder & '0') - ("00" & by);
  begin
    if TRIAL(PU_W + 1) = '1' then
      return '0' & remainder(PU_W - 2 downto 0) & '0';
    end if;
    return '1' & TRIAL(PU_W - 1 downto 0);
  end function;
begin
  valid(0) <= in_valid;

  step_1 <= divided(rest, divisor);
  step_2 <= divided(step_1(PU_W - 1 downto 0), divisor);

  process (clk)
    variable difference : unsigned(DIVIDEND_W downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 2 to 9: two bits of the ratio
      if dividing = '1' then
        rest     <= step_2(PU_W - 1 downto 0);
        ratio    <= ratio(13 downto 0) & step_1(PU_W) & step_2(PU_W);
      end if;
      if valid(LATENCY - 1) = '1' then
        dividing <= '0';
      end if;

      -- Stage 1: full = dividend >= divisor, as the borrow of a subtraction, and then the largest ratio
      difference := resize(dividend, DIVIDEND_W + 1) - divisor;
      if valid(0) = '1' then
        rest     <= dividend(PU_W - 1 downto 0);
        full     <= not difference(DIVIDEND_W);
        dividing <= difference(DIVIDEND_W);
        ratio    <= (others => '1');
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        dividing            <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
