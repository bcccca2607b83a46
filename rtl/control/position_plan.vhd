-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the profile of speeds to a target, one section of M = 8*2**jerk_bits samples at a time.
--   faster   if speed + move_step <= move_speed  and  stop + 2*speed + move_step <= room:  stop += speed
--   as fast  if speed             <= move_speed  and  stop + speed               <= room
--   slower   else:  stop -= speed;  at speed zero: the rest of the way
--   jerk = second difference of the profile;  advance = M*profile, the way of the section
-- active = 0: the profile follows the shaft's speed in the section before, up to move_speed.
-- New move_step and jerk_bits wait for rest (still).  Shifts by jerk_bits go bit by bit, in STEPS clocks.
-- Formats: way S(13,44) turns, ahead S(7,44); profile in units of M**2 * 2**-44 turns per sample.
-- Latency: 20.  Interval: 20.
-- Rounding: room and move_speed are floored to the profile's units; the way wraps.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity position_plan is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    shaft_position  : in  signed(31 downto 0);
    active          : in  std_logic;
    way             : in  signed(57 downto 0);
    ahead           : in  signed(51 downto 0);
    position_target : in  signed(31 downto 0);
    move_speed      : in  unsigned(30 downto 0);
    move_step       : in  unsigned(30 downto 0);
    jerk_bits       : in  unsigned(2 downto 0);
    use_stops       : in  std_logic;
    stop_low        : in  signed(31 downto 0);
    stop_high       : in  signed(31 downto 0);
    out_valid       : out std_logic;
    jerk            : out signed(37 downto 0);
    advance         : out signed(51 downto 0);
    last_sample     : out unsigned(7 downto 0);
    still           : out std_logic;
    at_rest         : out std_logic
  );
end entity position_plan;

architecture rtl of position_plan is
  constant LATENCY   : positive := POSITION_PLAN_LATENCY;
  constant WAY_W     : positive := POSITION_PLAN_WAY_W;
  constant SMALL     : positive := POSITION_PLAN_SMALL;
  constant PROFILE_W : positive := POSITION_PLAN_PROFILE_W;
  constant STEPS     : positive := 5;
  constant ROOM_W    : positive := WAY_W + 1 - 9;
  constant FAR       : signed(ROOM_W - 1 downto 0) := (46 => '1', others => '0');

  subtype profile_t is signed(PROFILE_W downto 0);
  subtype room_t is signed(ROOM_W - 1 downto 0);

  type state_t is record
    bits   : unsigned(2 downto 0);
    gain   : unsigned(30 downto 0);
    mark   : signed(31 downto 0);
    speed  : unsigned(PROFILE_W - 1 downto 0);
    stop   : unsigned(ROOM_W - 2 downto 0);
    down   : std_logic;
    last   : profile_t;
    slope  : signed(PROFILE_W + 1 downto 0);
    change : signed(PROFILE_W + 2 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal still_0   : std_logic;
  signal still_1   : std_logic;
  signal target_1  : signed(31 downto 0);
  signal gone_1    : signed(31 downto 0);
  signal end_1     : signed(WAY_W - 1 downto 0);
  signal d_2       : signed(WAY_W - 1 downto 0);
  signal turns_3   : std_logic;
  signal left      : unsigned(2 downto 0);  -- bits to shift by
  signal room      : room_t;
  signal most      : profile_t;
  signal faster_9  : profile_t;
  signal faster_10 : profile_t;
  signal reach_10  : room_t;  -- way that is needed to be faster
  signal need_10   : room_t;  -- to be as fast
  signal faster_11 : std_logic;
  signal as_fast   : std_logic;
  signal rest_11   : profile_t;
  signal slower_11 : profile_t;
  signal size_12   : profile_t;
  signal moved     : signed(51 downto 0);
begin
  valid(0) <= in_valid;
  still_0  <= '1' when state.speed = 0 and state.last = 0 and state.slope = 0 and state.change = 0 else '0';

  process (clk)
    variable turns   : std_logic;
    variable profile : profile_t;
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the target within its stops;  end of the profile;  what the shaft has gone
      if valid(0) = '1' then
        still_1    <= still_0;
        target_1   <= position_target;
        gone_1     <= shaft_position - state.mark;
        state.mark <= shaft_position;
        end_1      <= way + ahead;
        if use_stops = '1' then
          if position_target > stop_high then
            target_1 <= stop_high;
          end if;
          if position_target < stop_low or stop_high < stop_low then
            target_1 <= stop_low;
          end if;
        end if;
        if still_0 = '1' then
          state.bits <= jerk_bits;
          state.gain <= move_step;
        end if;
      end if;

      -- Stage 2: d
      if active = '1' then
        d_2 <= shift_left(resize(target_1, WAY_W), SMALL) - end_1;
      else
        d_2 <= shift_left(resize(gone_1, WAY_W), SMALL);
      end if;

      -- Stage 3: direction, room;  stages 4 to 8: in the profile's units
      turns := d_2(WAY_W - 1) xor state.down;
      if state.speed /= 0 or d_2 = 0 then
        turns := '0';
      end if;
      if valid(2) = '1' then
        turns_3    <= turns;
        state.down <= state.down xor turns;
        left       <= state.bits;
        room       <= resize(shift_right(negated(resize(d_2, WAY_W + 1), state.down xor turns), 9), ROOM_W);
        most       <= signed(shift_left(resize(move_speed, PROFILE_W + 1), 4));
      elsif left /= 0 then
        left <= left - 1;
        room <= shift_right(room, 3);
        most <= shift_right(most, 2);
      end if;

      -- Stage 9: without a target the speed is limited, not the way
      if valid(8) = '1' and active = '0' then
        if room < 0 then
          most <= (others => '0');
        elsif room < most then
          most <= resize(room, PROFILE_W + 1);
        end if;
        room <= FAR;
      end if;
      faster_9 <= signed('0' & state.speed) + signed(resize(state.gain, PROFILE_W + 1));

      -- Stage 10: ways that are needed;  stage 11: what is possible
      faster_10 <= faster_9;
      reach_10  <= signed('0' & state.stop) + signed(resize(state.speed, ROOM_W)) + faster_9;
      need_10   <= signed('0' & state.stop) + signed(resize(state.speed, ROOM_W));
      slower_11 <= signed('0' & state.speed) - signed(resize(state.gain, PROFILE_W + 1));
      faster_11 <= '1' when faster_10 <= most and reach_10 <= room else '0';
      as_fast   <= '1' when signed('0' & state.speed) <= most and need_10 <= room else '0';
      rest_11   <= resize(room, PROFILE_W + 1) when room < most else most;
      if room < 0 then
        rest_11 <= (others => '0');
      end if;

      -- Stage 12: the profile of the section, its speed and stop
      if valid(11) = '1' then
        size_12 <= (others => '0');
        if turns_3 = '1' and state.last /= 0 then
          null;
        elsif faster_11 = '1' then
          size_12     <= faster_10;
          state.speed <= unsigned(faster_10(PROFILE_W - 1 downto 0));
          state.stop  <= state.stop + state.speed;
        elsif as_fast = '1' then
          size_12 <= signed('0' & state.speed);
          if state.speed = 0 or active = '0' then
            size_12 <= rest_11;
          end if;
        elsif slower_11 <= 0 then
          size_12     <= rest_11;
          state.speed <= (others => '0');
        else
          size_12     <= slower_11;
          state.speed <= unsigned(slower_11(PROFILE_W - 1 downto 0));
          state.stop  <= state.stop - unsigned(slower_11(PROFILE_W - 1 downto 0));
        end if;
      end if;

      -- Stage 13: slope;  stage 14: change;  stages 14 to 19: way of the section
      profile := negated(size_12, state.down);
      if valid(12) = '1' then
        state.last  <= profile;
        state.slope <= resize(profile, PROFILE_W + 2) - state.last;
        at_rest     <= '0';
        if still_1 = '1' and size_12 = 0 then
          at_rest <= '1';
        end if;
        state.change <= resize(state.slope, PROFILE_W + 3);
      end if;
      if valid(13) = '1' then
        state.change <= state.slope - state.change;
        moved        <= shift_left(resize(state.last, 52), 9);
        left         <= state.bits;
      elsif left /= 0 then
        moved <= shift_left(moved, 3);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= (bits => (others => '0'), gain => (others => '0'), mark => (others => '0'),
                                speed => (others => '0'), stop => (others => '0'), down => '0',
                                last => (others => '0'), slope => (others => '0'), change => (others => '0'));
        left                <= (others => '0');
      end if;
    end if;
  end process;

  jerk        <= state.change;
  advance     <= moved;
  still       <= still_1;
  last_sample <= shift_left(to_unsigned(8, 8), to_integer(state.bits)) - 1;
  out_valid   <= valid(LATENCY);

end architecture rtl;
