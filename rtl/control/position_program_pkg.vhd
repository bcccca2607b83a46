-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the program of position_trajectory: its memory, what a word says, and the words.
--   acc is the accumulator, m a word of the memory, x one of the ports;  a word does in one clock
--     acc := acc +- m or x,  or acc shifted;  put := acc as it was;  does an event that reads acc as it was
--   clears: acc is zero after the word;  only: a condition of the put, or of acc in a word without one.
-- Every sample runs the first words; each of the last eight of a section a part of the plan behind them.
-- All of them end with acc = 0.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package position_program_pkg is
  -- The memory: below 16 what stays from sample to sample, zero until it is written
  constant CHANGE      : natural := 0;
  constant A           : natural := 1;
  constant V           : natural := 2;
  constant LATE_CHANGE : natural := 3;
  constant LATE_A      : natural := 4;
  constant LATE_V      : natural := 5;
  constant AHEAD       : natural := 6;
  constant OMEGA       : natural := 7;
  constant WAY         : natural := 8;  -- plus_way reads X_SHAFT, of the same number, instead
  constant MARK        : natural := 9;
  constant GAIN        : natural := 10;
  constant SPEED       : natural := 11;
  constant STOP        : natural := 12;
  constant LAST        : natural := 13;
  constant SLOPE       : natural := 14;
  constant GIVEN       : natural := 15;
  constant TORQUE      : natural := 16;
  constant GOAL        : natural := 17;
  constant D           : natural := 18;
  constant ROOM        : natural := 19;
  constant MOST        : natural := 20;
  constant REST        : natural := 21;
  constant GEARED      : natural := 22;
  constant NOWHERE     : natural := 31;

  -- What x is
  constant X_GEAR    : natural := 0;
  constant X_PICKED  : natural := 1;  -- the target, or the stop that is nearer
  constant X_LOW     : natural := 2;
  constant X_HIGH    : natural := 3;
  constant X_PRODUCT : natural := 4;
  constant X_SPEED   : natural := 5;
  constant X_STEP    : natural := 6;
  constant X_COULOMB : natural := 7;
  constant X_SHAFT   : natural := 8;

  -- What a factor, v, a or the filter's error, is multiplied by
  constant BY_INERTIA : natural := 0;
  constant BY_VISCOUS : natural := 1;
  constant BY_SPEED   : natural := 2;
  constant BY_FILTER  : natural := 3;

  type operation_t is (ADD, LEFT_3, RIGHT_3, RIGHT_2);
  type source_t is (FROM_MEMORY, FROM_X, FROM_WAY);
  type sign_t is (PLUS, MINUS, IF_DOWN, IF_NEGATIVE_V, IF_SLOWER);
  type condition_t is (ALWAYS, AT_LEAD, ACTIVE, STILL, FOLLOWS, LEADS, STOPPED, NEGATIVE, NOT_NEGATIVE, MOVING, FASTER, SLOWER, CHANGES,
                       GOES, RESTS);
  type event_t is (NOTHING, LOWER_HALF, UPPER_HALF, SIGN_OF_V, POSITION_OUT,
                   TORQUE_OUT, OMEGA_OUT, PICK_HIGH, PICK_LOW, SETTINGS, TURN, SPEED_FITS, FASTER_FITS, WAY_FITS,
                   FASTER_WAY_FITS, SPEED_ZERO, PROFILE, WITH_GEAR);

  type word_t is record
    op     : operation_t;
    from   : source_t;
    m      : unsigned(4 downto 0);
    sign   : sign_t;
    put    : unsigned(4 downto 0);
    puts   : std_logic;
    acts   : std_logic;  -- acc changes
    only   : condition_t;
    does   : event_t;
    clears : std_logic;
    loops  : std_logic;  -- repeated 3 + jerk_bits times
    less   : std_logic;  -- or twice less
    ends   : std_logic;
  end record word_t;
  type program_t is array (0 to 127) of word_t;

  constant NO_WORD : word_t := (ADD, FROM_MEMORY, (others => '0'), PLUS, (others => '1'), '0', '0', ALWAYS, NOTHING, '0', '0', '0', '0');

  -- Where the program of a sample begins, and the part of the plan that each sample of eight runs behind it
  type begins_t is array (0 to 8) of unsigned(6 downto 0);

  function program return program_t;
  function begins (words : program_t) return begins_t;
end package position_program_pkg;

package body position_program_pkg is
  function begins (words : program_t) return begins_t is
    variable found : begins_t := (others => (others => '0'));
    variable part  : natural := 0;
  begin
    for k in words'range loop
      if words(k).ends = '1' and part < 8 then
        part        := part + 1;
        found(part) := to_unsigned(k + 1, 7);
      end if;
    end loop;
    return found;
  end function;

  function made (op : operation_t; from : source_t; m : natural; sign : sign_t; put : natural; only : condition_t;
                 does : event_t; last : natural) return word_t is
    variable word : word_t := NO_WORD;
  begin
    word := (op, from, to_unsigned(m, 5), sign, to_unsigned(put, 5), '0', '1', only, does, '0', '0', '0', '0');
    if put /= NOWHERE then
      word.puts := '1';
    end if;
    if last > 0 then
      word.clears := '1';
    end if;
    if last > 1 then
      word.ends := '1';
    end if;
    return word;
  end function;

  function plus_m (m : natural; put : natural := NOWHERE; only : condition_t := ALWAYS; does : event_t := NOTHING;
                   sign : sign_t := PLUS) return word_t is
  begin
    return made(ADD, FROM_MEMORY, m, sign, put, only, does, 0);
  end function;

  function minus_m (m : natural; put : natural := NOWHERE; only : condition_t := ALWAYS;
                    does : event_t := NOTHING) return word_t is
  begin
    return made(ADD, FROM_MEMORY, m, MINUS, put, only, does, 0);
  end function;

  function plus_x (x : natural; only : condition_t := ALWAYS; sign : sign_t := PLUS) return word_t is
  begin
    return made(ADD, FROM_X, x, sign, NOWHERE, only, NOTHING, 0);
  end function;

  function plus_way (put : natural) return word_t is
  begin
    return made(ADD, FROM_WAY, WAY, PLUS, put, ALWAYS, NOTHING, 0);
  end function;

  function keeps (put : natural := NOWHERE; does : event_t := NOTHING; only : condition_t := ALWAYS) return word_t is
    variable word : word_t := made(ADD, FROM_MEMORY, 0, PLUS, put, only, does, 0);
  begin
    word.acts := '0';
    return word;
  end function;

  function multiplies (x : natural; put : natural := NOWHERE) return word_t is
    variable word : word_t := keeps(put, LOWER_HALF);
  begin
    word.m := to_unsigned(x, 5);
    return word;
  end function;

  function clear (put : natural := NOWHERE; does : event_t := NOTHING; only : condition_t := ALWAYS) return word_t is
  begin
    return made(ADD, FROM_MEMORY, 0, PLUS, put, only, does, 1);
  end function;

  function finish (put : natural := NOWHERE; does : event_t := NOTHING; only : condition_t := ALWAYS) return word_t is
  begin
    return made(ADD, FROM_MEMORY, 0, PLUS, put, only, does, 2);
  end function;

  function shift (op : operation_t) return word_t is
  begin
    return made(op, FROM_MEMORY, 0, PLUS, NOWHERE, ALWAYS, NOTHING, 0);
  end function;

  function shifts (op : operation_t) return word_t is
    variable word : word_t := shift(op);
  begin
    word.loops := '1';
    return word;
  end function;

  function shifts_less (op : operation_t) return word_t is
    variable word : word_t := shifts(op);
  begin
    word.less := '1';
    return word;
  end function;

  function program return program_t is
  begin
    return (
      -- a += change;  v += a;  the late ones;  way += late_v
      0  => plus_m(CHANGE),
      1  => plus_m(A, put => LATE_CHANGE, only => AT_LEAD),
      2  => multiplies(BY_INERTIA, A),
      3  => plus_m(V, does => UPPER_HALF),
      4  => clear(V, SIGN_OF_V),
      5  => plus_m(LATE_CHANGE),
      6  => plus_m(LATE_A),
      7  => plus_m(LATE_V, put => LATE_A),
      8  => plus_way(LATE_V),
      9  => clear(WAY, POSITION_OUT),
      10 => plus_m(AHEAD),
      11 => minus_m(LATE_V),
      12 => clear(AHEAD),
      -- torque_ff = k_inertia*a + k_viscous*v + coulomb*sign(v)
      13 => plus_x(X_PRODUCT),
      14 to 17 => shift(LEFT_3),
      18 => clear(TORQUE),
      19 => plus_m(V),
      20 => multiplies(BY_VISCOUS),
      21 => clear(does => UPPER_HALF),
      22 => plus_m(TORQUE),
      23 => plus_x(X_PRODUCT),
      24 => plus_x(X_COULOMB, MOVING, IF_NEGATIVE_V),
      25 => clear(does => TORQUE_OUT),
      -- omega_ff += k_filter*(k_speed*late_v - omega_ff)
      26 => plus_m(LATE_V),
      27 => multiplies(BY_SPEED),
      28 => clear(does => UPPER_HALF),
      29 => keeps,
      30 => plus_x(X_PRODUCT),
      31 => shift(LEFT_3),
      32 => minus_m(OMEGA),
      33 => multiplies(BY_FILTER),
      34 => clear(does => UPPER_HALF),
      35 => plus_m(OMEGA),
      36 => plus_x(X_PRODUCT),
      37 => finish(OMEGA, OMEGA_OUT),

      -- Part 0: ahead += M*profile
      38 => plus_m(LAST),
      39 => shifts(LEFT_3),
      40 => plus_m(AHEAD),
      41 => finish(AHEAD),
      -- Part 1: the target and the gear's way, within the stops;  move_step
      42 => plus_m(GIVEN),
      43 => plus_x(X_PICKED),
      44 => clear(GOAL),
      45 => plus_x(X_HIGH),
      46 => minus_m(GOAL),
      47 => clear(does => PICK_HIGH),
      48 => plus_x(X_PICKED),
      49 => clear(GOAL, only => STOPPED),
      50 => plus_m(GOAL),
      51 => plus_x(X_LOW, sign => MINUS),
      52 => clear(does => PICK_LOW),
      53 => plus_x(X_PICKED),
      54 => clear(GOAL, only => STOPPED),
      55 => plus_x(X_STEP),
      56 => finish(GAIN, SETTINGS, STILL),
      -- Part 2: d, the way gone or to the goal, and its direction;  the gear's way since the last plan
      57 => plus_x(X_SHAFT),
      58 => minus_m(MARK),
      59 => plus_m(MARK, put => D),
      60 => clear(MARK),
      61 => plus_m(GOAL),
      62 => minus_m(WAY),
      63 => minus_m(AHEAD),
      64 => clear(D, only => ACTIVE),
      65 => plus_m(D),
      66 => clear(does => TURN),
      67 => plus_x(X_GEAR, only => LEADS),
      68 => minus_m(GIVEN, put => GIVEN),
      69 => finish(GEARED),
      -- Part 3: room = d forward in sections
      70 => plus_m(D, sign => IF_DOWN),
      71 => shifts(RIGHT_3),
      72 => finish(ROOM),
      -- Part 4: move_speed and the gear's way in the profile's units
      73 => plus_x(X_SPEED),
      74 => shifts_less(RIGHT_2),
      75 => clear(MOST),
      76 => plus_m(GEARED),
      77 => shifts(RIGHT_3),
      78 => finish(GEARED),
      -- Part 5: rest = min(room, most), which is most of a profile that follows;  is most fast enough
      79 => plus_m(ROOM),
      80 => minus_m(MOST),
      81 => clear(only => NOT_NEGATIVE),
      82 => plus_m(MOST),
      83 => keeps(MOST, only => FOLLOWS),
      84 => clear(only => NEGATIVE),
      85 => clear(REST),
      86 => plus_m(MOST),
      87 => minus_m(SPEED),
      88 => minus_m(GAIN, does => SPEED_FITS),
      89 => finish(does => FASTER_FITS),
      -- Part 6: is the room long enough;  faster: stop += speed, speed += gain;  slower: speed -= gain
      90 => plus_m(ROOM),
      91 => minus_m(STOP),
      92 => minus_m(SPEED),
      93 => minus_m(SPEED, does => WAY_FITS),
      94 => minus_m(GAIN),
      95 => clear(does => FASTER_WAY_FITS),
      96 => plus_m(STOP),
      97 => plus_m(SPEED, only => FASTER),
      98 => clear(STOP),
      99 => plus_m(SPEED),
      100=> plus_m(GAIN, only => CHANGES, sign => IF_SLOWER),
      101=> clear(only => NEGATIVE),
      102=> finish(SPEED, SPEED_ZERO),
      -- Part 7: slower: stop -= speed;  the profile, the gear's part;  its first and second difference
      103=> plus_m(STOP),
      104=> minus_m(SPEED, only => SLOWER),
      105=> clear(STOP),
      106=> plus_m(SPEED, only => GOES, sign => IF_DOWN),
      107=> plus_m(REST, only => RESTS, sign => IF_DOWN),
      108=> plus_m(GEARED, only => LEADS, does => PROFILE),
      109=> minus_m(LAST, does => WITH_GEAR),
      110=> minus_m(SLOPE),
      111=> plus_m(SLOPE, put => CHANGE),
      112=> plus_m(LAST, put => SLOPE),
      113=> finish(LAST),
      others => NO_WORD);
  end function;
end package body position_program_pkg;
