-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: trajectory to a target with limited speed, acceleration and jerk, and what the loops below are fed forward.
--   a += change;  v += a;  late_a += late_change;  late_v += late_a;  way += late_v
--   omega_ff += k_filter*(k_speed*late_v - omega_ff);  torque_ff = k_inertia*a + k_viscous*v + coulomb*sign(v)
-- The profile gives the change of each section of M = 8*2**jerk_bits samples:
--   faster   if speed + move_step <= move_speed  and  stop + 2*speed + move_step <= room:  stop += speed
--   as fast  if speed             <= move_speed  and  stop + speed               <= room
--   slower   else:  stop -= speed;  at speed zero: the rest of the way
-- Without position_mode or run the profile follows the measured speed and position_ref the position; torque_ff is zero.
-- The gear's way of a section is added to the profile of the next one, all of it to the target; at_stop: a stop limits
-- that.
-- One adder, one memory and one multiplier run the program of position_program_pkg.
-- Formats: way S(13,44) turns, half an LSB of a position above position_ref; v and a S(-3,44); profile in units of
--   M**2 * 2**-44 turns per sample; products of upper and lower halves, torque_ff and the filter 33 fraction bits.
-- Latency: 54.  Interval: 56.
-- Rounding: everything is floored; the filter's error, omega_ff and torque_ff saturate; the way wraps.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;
use work.position_program_pkg.all;

entity position_trajectory is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    shaft_position  : in  signed(31 downto 0);  -- 7 clocks late
    led             : in  signed(31 downto 0);  -- 42 clocks late
    run             : in  std_logic;
    position_mode   : in  std_logic;
    position_target : in  signed(31 downto 0);
    move_speed      : in  unsigned(30 downto 0);
    move_step       : in  unsigned(30 downto 0);
    jerk_bits       : in  unsigned(2 downto 0);
    use_stops       : in  std_logic;
    stop_low        : in  signed(31 downto 0);
    stop_high       : in  signed(31 downto 0);
    torque_lead     : in  unsigned(2 downto 0);
    k_speed         : in  unsigned(23 downto 0);
    k_filter        : in  unsigned(16 downto 0);
    k_inertia       : in  unsigned(23 downto 0);
    k_viscous       : in  unsigned(23 downto 0);
    coulomb         : in  signed(PU_W - 1 downto 0);
    out_valid       : out std_logic;
    position_ref    : out signed(31 downto 0);
    omega_ff        : out signed(INTEGRAL_W - 1 downto 0);
    torque_ff       : out signed(PU_W - 1 downto 0);
    at_rest         : out std_logic;
    gear_free       : out std_logic;
    at_stop         : out std_logic
  );
end entity position_trajectory;

architecture rtl of position_trajectory is
  constant LATENCY  : positive := POSITION_TRAJECTORY_LATENCY;
  constant WAY_W    : positive := POSITION_TRAJECTORY_WAY_W;
  constant SMALL    : positive := POSITION_TRAJECTORY_SMALL;
  constant DROP     : positive := POSITION_TRAJECTORY_DROP;
  constant HALF_W   : positive := POSITION_TRAJECTORY_LOW;  -- bits of a factor's lower half
  constant SPEED_UP : positive := POSITION_TRAJECTORY_SPEED_UP - 4;  -- without the two shifts that the loop lacks
  constant TO_PU    : positive := POSITION_TRAJECTORY_TO_PU;
  constant TO_INT   : positive := POSITION_TRAJECTORY_TO_INTEGRAL;
  constant WORDS    : program_t := program;
  constant BEGIN_AT : begins_t  := begins(WORDS);

  subtype acc_t is signed(WAY_W - 1 downto 0);
  type memory_t is array (0 to 31) of acc_t;

  -- A position in turns, half an LSB above: floors round
  function turns_of (position : signed(31 downto 0)) return signed is
  begin
    return position & '1' & (SMALL - 2 downto 0 => '0');
  end function;

  signal age     : unsigned(5 downto 0);  -- of the sample in clocks
  signal pc      : unsigned(6 downto 0);
  signal running : std_logic;
  signal plans   : std_logic;
  signal word    : word_t;
  signal count   : unsigned(2 downto 0);
  signal holds   : std_logic;

  signal part  : unsigned(2 downto 0);  -- sample of eight
  signal left  : unsigned(4 downto 0);  -- eights of the section that are left after this one
  signal first : std_logic;
  signal bits  : unsigned(2 downto 0);
  signal lead  : unsigned(2 downto 0);

  signal memory    : memory_t;
  signal written   : std_logic_vector(15 downto 0);
  signal acc       : acc_t;
  signal below     : std_logic;  -- acc < 0, with the bit that acc lacks
  signal met       : std_logic;
  signal puts      : std_logic;
  signal moves_acc : std_logic;  -- the word changes acc
  signal x         : acc_t;
  signal which     : unsigned(3 downto 0);
  signal picked    : unsigned(3 downto 0);
  signal is_picked : std_logic;  -- a stop

  signal factor_x : signed(24 downto 0);
  signal factor_y : signed(17 downto 0);
  signal of_error : std_logic;
  signal goes_on  : std_logic;
  signal p        : signed(42 downto 0);
  signal narrow   : signed(INTEGRAL_W - 1 downto 0);

  signal is_active    : std_logic;
  signal is_follower  : std_logic;
  signal v_below      : std_logic;
  signal moves        : std_logic;
  signal down         : std_logic;
  signal turned       : std_logic;
  signal stands       : std_logic;  -- speed = 0
  signal went         : std_logic;  -- the last profile was not zero without the gear
  signal busy         : unsigned(POSITION_TRAJECTORY_BUSY_W - 1 downto 0);
  signal is_still     : std_logic;
  signal fits_speed   : std_logic;
  signal fits_faster  : std_logic;
  signal fits_way     : std_logic;
  signal fits_further : std_logic;
  signal held         : std_logic;
  signal is_faster    : std_logic;
  signal is_as_fast   : std_logic;
  signal is_slower    : std_logic;
  signal goes_speed   : std_logic;
begin
  is_active  <= position_mode and run;
  is_still   <= '1' when busy = 0 else '0';
  held       <= turned and went;
  is_faster  <= fits_faster and (fits_further or is_follower) and not held;
  is_as_fast <= fits_speed and (fits_way or is_follower) and not held and not is_faster;
  is_slower  <= not (is_faster or is_as_fast or held);
  goes_speed <= is_faster or (not held and not stands and not (is_as_fast and is_follower));
  holds      <= word.loops when count /= bits + unsigned'('0' & not word.less & '0') else '0';
  is_picked  <= '1' when picked /= X_PICKED else '0';

  with word.only select met <=
    first and (part ?= lead)     when AT_LEAD,
    is_active                    when ACTIVE,
    is_still                     when STILL,
    is_follower                  when FOLLOWS,
    not is_follower              when LEADS,
    is_picked                    when STOPPED,
    below                        when NEGATIVE,
    not below                    when NOT_NEGATIVE,
    moves                        when MOVING,
    is_faster                    when FASTER,
    is_slower                    when SLOWER,
    is_faster or is_slower       when CHANGES,
    goes_speed                   when GOES,
    not (goes_speed or held)     when RESTS,
    '1'                          when others;
  puts      <= word.puts and met;
  moves_acc <= word.acts and (met or word.puts);

  which <= picked when word.m(3 downto 0) = X_PICKED else word.m(3 downto 0);
  with to_integer(which) select x <=
    led & (SMALL - 1 downto 0 => '0')                        when X_GEAR,
    turns_of(shaft_position)                                 when X_SHAFT,
    turns_of(position_target)                                when X_PICKED,
    turns_of(stop_low)                                       when X_LOW,
    turns_of(stop_high)                                      when X_HIGH,
    resize(p, WAY_W)                                         when X_PRODUCT,
    signed(shift_left(resize(move_speed, WAY_W), SPEED_UP))  when X_SPEED,
    signed(resize(move_step, WAY_W))                         when X_STEP,
    shift_left(resize(coulomb, WAY_W), TO_PU)                when others;

  narrow <= saturate(acc(WAY_W - 1 downto TO_INT), INTEGRAL_W);

  process (clk)
    variable takes_x : std_logic;
    variable less    : std_logic;
    variable b      : acc_t;
    variable sum    : signed(WAY_W + 1 downto 0);
    variable does   : event_t;
  begin
    if rising_edge(clk) then
      -- The next word;  behind a sample's own words the plan's part, in the last eight samples of a section
      count <= (others => '0');
      if holds = '1' then
        count <= count + 1;
      else
        word <= NO_WORD;
        if in_valid = '1' or running = '1' then
          word    <= WORDS(to_integer(pc));
          pc      <= pc + 1;
          running <= '1';
          if WORDS(to_integer(pc)).ends = '1' then
            if plans = '0' and left = 0 then
              pc    <= BEGIN_AT(to_integer(part) + 1);
              plans <= '1';
            else
              pc      <= (others => '0');
              running <= '0';
              plans   <= '0';
              part    <= part + 1;
              if part = 7 then
                first <= '0';
                left  <= left - 1;
                if left = 0 then
                  first <= '1';
                  left  <= resize(shift_left(to_unsigned(1, 6), to_integer(bits)) - 1, 5);
                end if;
              end if;
            end if;
          end if;
        end if;
      end if;

      -- The adder
      takes_x := '0';
      if word.from = FROM_X or (word.from = FROM_WAY and is_active = '0') then
        takes_x := '1';
      end if;
      case word.sign is
        when PLUS          => less := '0';
        when MINUS         => less := '1';
        when IF_DOWN       => less := down;
        when IF_NEGATIVE_V => less := v_below;
        when IF_SLOWER     => less := is_slower;
      end case;
      b := memory(to_integer(word.m));
      if word.m(4) = '0' and written(to_integer(word.m(3 downto 0))) = '0' then
        b := (others => '0');
      end if;
      if takes_x = '1' then
        b := x;
      end if;
      b   := b xor (b'range => less);
      sum := (resize(acc, WAY_W + 1) & '1') + (resize(b, WAY_W + 1) & less);  -- the last bit carries in
      if moves_acc = '1' then
        case word.op is
          when LEFT_3  => acc <= shift_left(acc, 3);
          when RIGHT_3 => acc <= shift_right(acc, 3);
          when RIGHT_2 => acc <= shift_right(acc, 2);
          when ADD     =>
            acc   <= sum(WAY_W downto 1);
            below <= sum(WAY_W + 1);
        end case;
      end if;
      if rst = '1' or (moves_acc and word.clears) = '1' then
        acc   <= (others => '0');
        below <= '0';
      end if;
      if puts = '1' then
        memory(to_integer(word.put)) <= acc;
        if word.put(4) = '0' then
          written(to_integer(word.put(3 downto 0))) <= '1';
        end if;
      end if;

      -- The multiplier: the lower half, then the upper one and the lower product
      does    := word.does;
      goes_on <= '0';
      if goes_on = '1' then
        p <= factor_x * factor_y + shift_right(p, HALF_W);
      end if;
      if does = LOWER_HALF then
        p        <= (others => '0');
        goes_on  <= '1';
        of_error <= word.m(0) and word.m(1);
        factor_y <= signed('0' & acc(DROP + HALF_W - 1 downto DROP));
        if word.m(1 downto 0) = BY_FILTER then
          factor_y <= signed('0' & acc(HALF_W - 1 downto 0));
        end if;
        case to_integer(word.m(1 downto 0)) is
          when BY_INERTIA => factor_x <= signed('0' & k_inertia);
          when BY_VISCOUS => factor_x <= signed('0' & k_viscous);
          when BY_SPEED   => factor_x <= signed('0' & k_speed);
          when others     => factor_x <= signed(resize(k_filter & '0', 25));
        end case;
      elsif does = UPPER_HALF then
        goes_on  <= '1';
        factor_y <= acc(DROP + HALF_W + 17 downto DROP + HALF_W);
        if of_error = '1' then
          factor_y <= narrow(INTEGRAL_W - 1 downto INTEGRAL_W - 18);
        end if;
      end if;

      case does is
        when SIGN_OF_V =>
          v_below <= below;
          moves   <= '1' when acc /= 0 else '0';
        when POSITION_OUT =>
          position_ref <= acc(WAY_W - 1 downto SMALL);
        when TORQUE_OUT =>
          torque_ff <= narrow(INTEGRAL_W - 1 downto INTEGRAL_W - PU_W);
          if is_active = '0' then
            torque_ff <= (others => '0');
          end if;
        when OMEGA_OUT =>
          omega_ff <= narrow;
        when PICK_HIGH =>
          if use_stops = '1' and below = '1' then
            picked <= to_unsigned(X_HIGH, 4);
          end if;
        when PICK_LOW =>
          if use_stops = '1' and below = '1' then
            picked <= to_unsigned(X_LOW, 4);
          end if;
        when SETTINGS =>
          at_stop <= is_picked and not is_follower;
          picked  <= to_unsigned(X_PICKED, 4);
          if is_still = '1' then
            bits <= jerk_bits;
            lead <= torque_lead;
          end if;
        when TURN =>
          is_follower <= not is_active;
          turned      <= stands and (acc(WAY_W - 1) xor down);
          down        <= down xor (stands and (acc(WAY_W - 1) xor down));
        when SPEED_FITS      => fits_speed   <= not below;
        when FASTER_FITS     => fits_faster  <= not below;
        when WAY_FITS        => fits_way     <= not below;
        when FASTER_WAY_FITS => fits_further <= not below;
        when SPEED_ZERO      => stands       <= '1' when acc = 0 else '0';
        when PROFILE => went <= '1' when acc /= 0 else '0';
        when WITH_GEAR =>
          busy    <= shift_left(busy, 1);
          busy(0) <= '1' when acc /= 0 else '0';
        when others          => null;
      end case;

      out_valid <= '0';
      if age /= 0 then
        age <= age + 1;
        if age = LATENCY - 1 then
          age       <= (others => '0');
          out_valid <= '1';
        end if;
      end if;
      if in_valid = '1' then
        age <= to_unsigned(1, 6);
      end if;

      if rst = '1' then
        age       <= (others => '0');
        out_valid <= '0';
        pc        <= (others => '0');
        running   <= '0';
        plans     <= '0';
        word      <= NO_WORD;
        part      <= (others => '0');
        left      <= (others => '0');
        first     <= '1';
        bits      <= (others => '0');
        lead      <= (others => '0');
        written   <= (others => '0');
        picked    <= to_unsigned(X_PICKED, 4);
        goes_on   <= '0';
        down      <= '0';
        stands    <= '1';
        went      <= '0';
        busy      <= (others => '0');
        at_stop   <= '0';

        is_follower <= '1';
      end if;
    end if;
  end process;

  at_rest   <= is_still;
  gear_free <= is_follower;

end architecture rtl;
