-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: electronic gearing, the way of this shaft that the turning of a second encoder, the master, asks for.
--   acting moves by gear_step a sample towards gear_numerator while the gear acts, else towards zero
--   way   += floor((rest + wrap(gear_code - last code)*acting) / gear_denominator);  rest: what the division left
--   speed += (change of way - speed) / 2**gear_smooth;    led = way + gear_lead*speed
-- The gear acts with gear_on until at_stop, which gear_on = 0 clears; with gear_free all is zero.
-- Formats: gear_way and led S(13,18) turns, wrap; acting S(15,9), rest U(16,9), speed S(-3,39) turns per sample.
-- Latency: 42.  Interval: 54.  One multiplier for both products; the division takes a clock a digit.
-- Rounding: way and speed are floored, the way's rest is kept; the lead half up.  The change of way that speed takes
-- saturates at an eighth of a turn, by which led changes in a sample at most.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity gear is
  port (
    clk              : in  std_logic;
    rst              : in  std_logic;
    in_valid         : in  std_logic;
    gear_free        : in  std_logic;
    at_stop          : in  std_logic;
    gear_code        : in  unsigned(TURN_W - 1 downto 0);
    gear_on          : in  std_logic;
    gear_numerator   : in  signed(15 downto 0);
    gear_denominator : in  unsigned(15 downto 0);
    gear_step        : in  unsigned(24 downto 0);
    gear_lead        : in  unsigned(9 downto 0);
    gear_smooth      : in  unsigned(3 downto 0);
    out_valid        : out std_logic;
    gear_way         : out signed(31 downto 0);
    led              : out signed(31 downto 0);
    gear_engaged     : out std_logic;
    gear_stopped     : out std_logic
  );
end entity gear;

architecture rtl of gear is
  constant LATENCY  : positive := GEAR_LATENCY;
  constant PART     : positive := GEAR_PART;
  constant ACTING_W : positive := GEAR_ACTING_W;
  constant REST_W   : positive := GEAR_REST_W;
  constant CHANGE_W : positive := GEAR_CHANGE_W;
  constant FINER    : positive := GEAR_SMOOTH_MOST;  -- bits of speed that the multiplier leaves out
  constant SPEED_W  : positive := CHANGE_W + GEAR_SPEED_UP;
  constant X_W      : positive := GEAR_X_W;
  constant DIGITS   : positive := GEAR_DIGITS;
  constant MOST     : unsigned(CHANGE_W - 1 downto 0) := (CHANGE_W - 1 => '1', others => '0');

  type state_t is record
    code    : unsigned(TURN_W - 1 downto 0);
    seen    : std_logic;
    acting  : signed(ACTING_W - 1 downto 0);
    rest    : unsigned(REST_W - 1 downto 0);
    way     : signed(31 downto 0);
    speed   : signed(SPEED_W - 1 downto 0);
    led     : signed(31 downto 0);
    stopped : std_logic;
  end record state_t;

  signal state : state_t;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal stopped_0 : std_logic;
  signal acts_0    : std_logic;
  signal asked_0   : signed(ACTING_W - 1 downto 0);
  signal delta_1   : signed(TURN_W - 1 downto 0);
  signal acts_1    : std_logic;
  signal gap_1     : signed(ACTING_W downto 0);
  signal moved_1   : signed(ACTING_W downto 0);
  signal reached_2 : std_logic;

  signal factor_a : signed(ACTING_W - 1 downto 0);
  signal factor_b : signed(TURN_W - 1 downto 0);
  signal summand  : signed(REST_W downto 0);
  signal y        : signed(X_W - 1 downto 0);

  signal divides  : std_logic;
  signal negative : std_logic;
  signal low      : unsigned(PART - 1 downto 0);
  signal quotient : unsigned(DIGITS - 1 downto 0);  -- what is left of the dividend above the digits found
  signal left     : unsigned(15 downto 0);
  signal trial    : unsigned(16 downto 0);
  signal less     : unsigned(17 downto 0);
  signal change   : signed(DIGITS downto 0);

  signal off_40    : signed(SPEED_W downto 0);
  signal shifts    : unsigned(3 downto 0);
  signal smooths   : std_logic;
  signal behind_41 : signed(31 downto 0);
begin
  valid(0)  <= in_valid;
  stopped_0 <= gear_on and (state.stopped or at_stop);
  acts_0    <= gear_on and not stopped_0 and not gear_free;
  asked_0   <= shift_left(resize(gear_numerator, ACTING_W), PART) and acts_0;

  -- Stages 3 to 5: rest + delta*acting;  at all other times half an LSB + gear_lead*speed
  factor_a <= state.acting when valid(2) = '1' else state.speed(SPEED_W - 1 downto FINER);
  factor_b <= delta_1 when valid(2) = '1' else signed(resize(gear_lead, TURN_W));
  summand  <= signed('0' & state.rest) when valid(2) = '1' else to_signed(2 ** (PART - 1), REST_W + 1);

  product : entity work.multiply_add
    generic map (DROP => 0)
    port map (clk => clk, a => factor_a, b => factor_b, c => summand, y => y, limited => open);

  moved_1 <= within(gap_1, gear_step, 0);

  trial  <= left & quotient(DIGITS - 1);
  less   <= ('0' & trial) - gear_denominator;
  change <= signed('0' & quotient) xor negative;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: delta = wrap(code - last code), and what acting lacks
      if valid(0) = '1' then
        delta_1       <= signed(gear_code - state.code) and state.seen;
        state.code    <= gear_code;
        state.seen    <= '1';
        state.stopped <= stopped_0;
        acts_1        <= acts_0;
        gap_1         <= difference(asked_0, state.acting);
      end if;

      -- Stage 2: acting moves by gear_step at most
      if valid(1) = '1' then
        state.acting <= state.acting + moved_1(ACTING_W - 1 downto 0);
        reached_2    <= acts_1 and not beyond(gap_1, gear_step, 0);
        if gear_free = '1' then
          state.acting <= (others => '0');
        end if;
      end if;

      -- Stage 6: the dividend; of a negative one the complement, floor(x/d) = not floor((not x)/d)
      -- Stages 7 to 39: a digit of the quotient each
      if valid(5) = '1' then
        divides  <= '1';
        negative <= y(X_W - 1);
        low      <= unsigned(y(PART - 1 downto 0));
        quotient <= unsigned(y(X_W - 2 downto PART) xor y(X_W - 1));
        left     <= (others => '0');
      elsif divides = '1' then
        quotient    <= shift_left(quotient, 1);
        quotient(0) <= not less(17);
        left      <= less(15 downto 0);
        if less(17) = '1' then
          left <= trial(15 downto 0);
        end if;
      end if;
      if valid(5 + DIGITS) = '1' then
        divides <= '0';
      end if;

      -- Stage 40: way, rest, what speed lacks;  then speed, after a clock for each of gear_smooth bits
      if smooths = '1' then
        off_40 <= shift_right(off_40, 1);
        shifts <= shifts - 1;
        if shifts = 0 then
          state.speed <= state.speed + off_40(SPEED_W - 1 downto 0);
          smooths     <= '0';
        end if;
      end if;
      if valid(6 + DIGITS) = '1' then
        state.way  <= state.way + change(31 downto 0);
        state.rest <= ((left xor negative) + (gear_denominator and negative)) & low;
        off_40     <= (resize(saturate(change, CHANGE_W), CHANGE_W + 1) & (GEAR_SPEED_UP - 1 downto 0 => '0'))
                      - state.speed;
        shifts     <= gear_smooth;
        smooths    <= '1';
        if gear_free = '1' then
          state.way   <= (others => '0');
          state.speed <= (others => '0');
          smooths     <= '0';
        end if;
      end if;

      -- Stage 41: what led lacks;  stage 42: led moves by an eighth of a turn at most
      if valid(7 + DIGITS) = '1' then
        behind_41 <= state.way + y(PART + 31 downto PART) - state.led;
      end if;
      if valid(8 + DIGITS) = '1' then
        state.led    <= state.led + within(behind_41, MOST, 0);
        gear_engaged <= reached_2 and not beyond(behind_41, MOST, 0);
        gear_stopped <= state.stopped;
        if gear_free = '1' then
          state.led <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.code          <= (others => '0');
        state.seen          <= '0';
        state.acting        <= (others => '0');
        state.rest          <= (others => '0');
        state.way           <= (others => '0');
        state.speed         <= (others => '0');
        state.led           <= (others => '0');
        state.stopped       <= '0';
        divides             <= '0';
        smooths             <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);
  gear_way  <= state.way;
  led       <= state.led;

end architecture rtl;
