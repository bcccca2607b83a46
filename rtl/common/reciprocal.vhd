-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: 1/x as m * 2**n, one quotient bit per clock, outside the data path.
--   1/x = m * 2**n * 2**-17, m in (2**16, 2**17), n in 0..N_MAX
-- Method: n shifts bring x into [1, 2), first by multiples of four, then by the remainder; m is the quotient.
-- Formats: x U(1,16); m U(0,17).  Latency: 21.  Interval: 21.
-- Rounding: quotient half up; 2**17 is stored as 2**17 - 1.  Relative error of m <= 2**-17.
-- An x below 2**-N_MAX is replaced by 2**-N_MAX and low is 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity reciprocal is
  generic (
    N_MAX : positive range 1 to 15 := 5
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    x         : in  unsigned(U_DC_W - 1 downto 0);
    out_valid : out std_logic;
    m         : out unsigned(RECIPROCAL_W - 1 downto 0);
    n         : out unsigned(3 downto 0);
    low       : out std_logic
  );
end entity reciprocal;

architecture rtl of reciprocal is
  constant LATENCY : positive := RECIPROCAL_LATENCY;
  constant BITS    : positive := RECIPROCAL_QUOTIENT_BITS;
  constant FOURS   : natural  := N_MAX / 4;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal fours_0   : natural range 0 to FOURS;
  signal fours_1   : natural range 0 to FOURS;
  signal shifted_1 : unsigned(U_DC_W - 1 downto 0);
  signal shifted_0 : unsigned(U_DC_W - 1 downto 0);
  signal low_0     : std_logic_vector(1 downto 0);  -- x < 2**-N_MAX, one bit for each half of its bits
  signal low_1     : std_logic_vector(1 downto 0);
  signal low_2     : std_logic;
  signal mantissa  : unsigned(U_DC_W - 1 downto 0);
  signal shift     : natural range 0 to N_MAX;
  signal remainder : unsigned(U_DC_W - 1 downto 0);
  signal trial     : unsigned(U_DC_W downto 0);
  signal rest      : unsigned(U_DC_W downto 0);
  signal quotient  : unsigned(BITS - 1 downto 0);
  signal dividing  : std_logic;
  signal whole     : std_logic;  -- the mantissa is 1, so m would be 2**17
  signal one       : std_logic;

  -- Number of leading groups of group_w zero bits, at most most.
  function leading_zeros (v : unsigned; group_w : positive; most : natural) return natural is
    alias u : unsigned(v'length - 1 downto 0) is v;
  begin
    for k in 0 to most - 1 loop
      if (or u(u'high - k * group_w downto u'high - k * group_w - group_w + 1)) = '1' then
        return k;
      end if;
    end loop;
    return most;
  end function;
begin
  valid(0) <= in_valid;
  fours_0  <= leading_zeros(x, 4, FOURS);
  low_0(1) <= not (or x(U_DC_W - 1 downto U_DC_W - 1 - N_MAX / 2));
  low_0(0) <= not (or x(U_DC_W - 2 - N_MAX / 2 downto U_DC_W - 1 - N_MAX));
  whole    <= '1' when mantissa(U_DC_W - 2 downto 0) = 0 else '0';

  trial <= remainder & '0';
  rest  <= trial - mantissa;

  -- The first group that contains a one selects the shift directly, without encoding the number of zeros first.
  process (all)
  begin
    shifted_0 <= shift_left(x, 4 * FOURS);
    for k in FOURS - 1 downto 0 loop
      if x(U_DC_W - 1 - 4 * k downto U_DC_W - 4 - 4 * k) /= 0 then
        shifted_0 <= shift_left(x, 4 * k);
      end if;
    end loop;
  end process;

  process (clk)
    variable rounded : unsigned(BITS - 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: shifted = x * 2**(4*fours); x is constant during the interval, so no enable is needed
      low_1     <= low_0;
      fours_1   <= fours_0;
      shifted_1 <= shifted_0;

      -- Stage 2: mantissa = x * 2**shift, in [1, 2); 1 for an x below the range
      if valid(1) = '1' then
        low_2    <= and low_1;
        shift    <= N_MAX;
        mantissa <= (U_DC_W - 1 => '1', others => '0');
        if low_1 /= "11" then
          shift    <= 4 * fours_1 + leading_zeros(shifted_1, 1, 3);
          mantissa <= shift_left(shifted_1, leading_zeros(shifted_1, 1, 3));
        end if;
      end if;

      -- Stages 3 to 20: one bit per clock of quotient = 2**34 / mantissa
      one <= whole;
      if valid(0) = '1' then
        dividing <= '1';
      elsif valid(BITS + 1) = '1' then
        dividing <= '0';
      end if;
      if dividing = '1' then
        quotient  <= quotient(BITS - 2 downto 0) & not rest(U_DC_W);
        remainder <= trial(U_DC_W - 1 downto 0);
        if rest(U_DC_W) = '0' then
          remainder <= rest(U_DC_W - 1 downto 0);
        end if;
        remainder(0) <= mantissa(0) and not rest(U_DC_W);
        if valid(1) = '1' then
          remainder <= (U_DC_W - 1 => '1', others => '0');
        end if;
      end if;

      -- Stage 21: m = quotient, half up, 2**17 stored as 2**17 - 1
      if valid(20) = '1' then
        rounded := (quotient(BITS - 1 downto 1) & (quotient(0) and not one)) + 1;
        m       <= rounded(RECIPROCAL_W downto 1);
        n       <= to_unsigned(shift, 4);
        low     <= low_2;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        dividing            <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
