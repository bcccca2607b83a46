-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the angle between the edges of Hall sensors, by the time of the last sector, never outside the sector.
-- t is the time since the last edge, T that of the last sector, d = 1 or -1 the direction of the edge:
--   theta = middle of the sector + d * place * turn/6
--   two edges in one direction, T below the longest time:  place = t/T - 1/2 up to t = T,  then (T/t)/2
--   else, the speed is not known:                          place = (t/T - 1)/2 up to t = T,  then 0
-- Without two edges in one direction T is the longer one of the last sector and the time since the edge before, a
-- quarter of the longest time at most.  Before the first edge and after a skipped sector the angle is the middle.
-- Formats: angles TURN, times TIME_W bits, saturating; t/T has QUOTIENT_W bits.
-- Latency: 1 (every clock is a sample); sample to theta QUOTIENT_W + 2 clocks, a sample before that is ignored.
-- Rounding: the quotient is cut, the angle half up; it wraps.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity hall_angle is
  generic (
    TIME_W : positive range 4 to 24 := HALL_ANGLE_TIME_W
  );
  port (
    clk        : in  std_logic;
    rst        : in  std_logic;
    step_up    : in  std_logic;
    step_down  : in  std_logic;
    skipped    : in  std_logic;
    theta_hall : in  unsigned(TURN_W - 1 downto 0);
    sample     : in  std_logic;
    theta      : out unsigned(TURN_W - 1 downto 0)
  );
end entity hall_angle;

architecture rtl of hall_angle is
  constant QUOTIENT_W : positive := HALL_ANGLE_QUOTIENT_W;
  constant GUARD      : positive := HALL_ANGLE_GUARD;
  constant PLACE_W    : positive := TURN_W + GUARD;

  constant TIME_MAX    : unsigned(TIME_W - 1 downto 0) := (others => '1');
  constant SLOW        : unsigned(TIME_W - 1 downto 0) := to_unsigned(2 ** (TIME_W - 2), TIME_W);
  constant HALF_SECTOR : signed(PLACE_W - 1 downto 0)  := to_signed(HALL_ANGLE_HALF_SECTOR, PLACE_W);

  signal seen        : std_logic;  -- 1: an edge, no skipped sector since
  signal forward     : std_logic;  -- direction of the last edge
  signal known       : std_logic;  -- 1: sector_time is that of a whole sector
  signal since       : unsigned(TIME_W - 1 downto 0);  -- clocks since the last edge
  signal sector_time : unsigned(TIME_W - 1 downto 0);
  signal middle      : unsigned(TURN_W - 1 downto 0);  -- of the sector that the values above belong to

  -- Engine
  signal clock     : unsigned(4 downto 0);  -- 0: idle
  signal remainder : unsigned(TIME_W - 1 downto 0);
  signal divisor   : unsigned(TIME_W - 1 downto 0);
  signal part      : signed(PLACE_W - 1 downto 0);  -- what the next bit of the quotient is worth
  signal place     : signed(PLACE_W - 1 downto 0);
  signal backward  : std_logic;
  signal begin_at  : unsigned(TURN_W - 1 downto 0);  -- the middle at the sample

  signal edge, whole, within : std_logic;
  signal longer              : unsigned(TIME_W - 1 downto 0);
  signal left                : signed(TIME_W + 1 downto 0);  -- twice the remainder, less the divisor
  signal offset              : signed(PLACE_W - 1 downto 0);
begin
  edge   <= step_up or step_down;
  whole  <= seen and (step_up xnor forward) when since /= TIME_MAX else '0';
  longer <= maximum(sector_time, since);
  within <= '1' when since <= sector_time else '0';
  left   <= signed(resize(remainder, TIME_W + 1) & '0') - signed(resize(divisor, TIME_W + 2));
  offset <= -place when backward = '1' else place;

  process (clk)
  begin
    if rising_edge(clk) then
      middle <= theta_hall;
      if since /= TIME_MAX then
        since <= since + 1;
      end if;
      if edge = '1' then
        forward <= step_up;
      end if;
      if skipped = '1' then
        seen <= '0';
      elsif edge = '1' then
        seen        <= '1';
        since       <= to_unsigned(1, TIME_W);
        known       <= whole;
        sector_time <= since when whole = '1' else minimum(longer, SLOW);
      end if;

      -- t/T or T/t, each bit of the quotient worth half the one before
      if (sample = '1') and clock = 0 then
        clock     <= to_unsigned(1, 5);
        remainder <= since when within = '1' else sector_time;
        divisor   <= sector_time when within = '1' else since;
        part      <= HALF_SECTOR when (within and known) = '1' else shift_right(HALF_SECTOR, 1);
        place     <= -HALF_SECTOR when within = '1' else (others => '0');
        if (seen and (within or known)) = '0' then
          part  <= (others => '0');
          place <= (others => '0');
        end if;
        backward <= not forward;
        begin_at <= middle;
      elsif clock /= 0 and clock <= QUOTIENT_W then
        clock     <= clock + 1;
        remainder <= shift_left(remainder, 1);
        part      <= shift_right(part, 1);
        if left >= 0 then
          remainder <= unsigned(left(TIME_W - 1 downto 0));
          place     <= place + part;
        end if;
      elsif clock /= 0 then
        clock <= (others => '0');
        theta <= begin_at + unsigned(resize(shift_right(offset + 2 ** (GUARD - 1), GUARD), TURN_W));
      end if;

      if rst = '1' then
        seen        <= '0';
        forward     <= '0';
        known       <= '0';
        since       <= to_unsigned(1, TIME_W);
        sector_time <= to_unsigned(1, TIME_W);
        middle      <= (others => '0');
        clock       <= (others => '0');
        theta       <= (others => '0');
      end if;
    end if;
  end process;

end architecture rtl;
