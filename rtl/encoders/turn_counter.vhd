-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: steps to the count within a turn of counts and to the position code; corrections that do not jump.
--   code = round((count + 1/2) * 2**POSITION_BITS / counts), modulo one turn
-- Nothing is multiplied: code and rest are quotient and remainder of a division by 2*counts, and a step adds that of
-- 2*2**POSITION_BITS; software writes code_step = floor(2**POSITION_BITS / counts) and its remainder, code_rest.
-- code_theta is latched by sample; it follows the count by a clock.
-- correct adds correction to pending; its counts are added one by one between the steps of the encoder, one at each
-- sample, or with fast one at each clock until none is left (moving).
-- A new setting starts again at count 0; an impossible one is refused and the count stays 0.
-- Formats: counts.  Latency: 1 (every clock is a sample).
-- Rounding: half up, exact; code and count wrap, pending saturates.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;

entity turn_counter is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    step_up         : in  std_logic;
    step_down       : in  std_logic;
    sample          : in  std_logic;
    correct         : in  std_logic;
    correction      : in  signed(19 downto 0);
    fast            : in  std_logic;
    counts          : in  unsigned(18 downto 0);
    code_step       : in  unsigned(16 downto 0);
    code_rest       : in  unsigned(17 downto 0);
    code_theta      : out unsigned(POSITION_BITS - 1 downto 0);
    count           : out unsigned(17 downto 0);
    pending         : out signed(19 downto 0);
    moving          : out std_logic;
    restarted       : out std_logic;
    setting_refused : out std_logic
  );
end entity turn_counter;

architecture rtl of turn_counter is
  type state_t is record
    counts    : unsigned(18 downto 0);
    code_step : unsigned(16 downto 0);
    code_rest : unsigned(17 downto 0);
    count     : unsigned(17 downto 0);
    code      : unsigned(POSITION_BITS - 1 downto 0);
    rest      : unsigned(19 downto 0);
    pending   : signed(19 downto 0);
    moving    : std_logic;
  end record state_t;

  signal state : state_t;

  signal good       : std_logic;
  signal kept       : std_logic;
  signal restart    : std_logic;
  signal stepped    : std_logic;
  signal mend       : std_logic;
  signal up         : std_logic;
  signal down       : std_logic;
  signal total      : signed(21 downto 0);  -- rest after the step
  signal mended     : signed(21 downto 0);  -- the same, a turn nearer
  signal past       : std_logic;            -- 1: rest has passed its end
  signal code_first : unsigned(17 downto 0);

  signal moved_1 : std_logic;
  signal down_1  : std_logic;
  signal past_1  : std_logic;

  -- a + b + carry, or a - b - carry, with one carry chain
  function plus_minus (a : signed; b : unsigned; minus : std_logic; carry : std_logic) return signed is
    variable sum : signed(a'length downto 0);
  begin
    sum := (a & '1') + signed((b xor (b'range => minus)) & (minus xor carry));
    return sum(a'length downto 1);
  end function;
begin
  good    <= '1' when counts >= 4 and counts <= 2 ** 18 and resize(code_rest, 19) < counts else '0';
  restart <= not (good and kept);
  kept    <= '1' when counts = state.counts and code_step = state.code_step and code_rest = state.code_rest else '0';

  -- A step of the encoder, else one count of the correction
  stepped <= step_up or step_down;
  mend    <= (sample or state.moving) and not stepped and not correct when state.pending /= 0 else '0';
  up      <= step_up or (mend and not state.pending(19));
  down    <= not up and (step_down or mend);

  total  <= plus_minus(signed(resize(state.rest, 22)), resize(state.code_rest & '0', 22), down, '0');
  mended <= plus_minus(total, resize(state.counts & '0', 22), up, '0');
  past   <= total(21) when down = '1' else not mended(21);

  code_first <= shift_right(resize(code_step, 18) + 1, 1);

  process (clk)
    variable code : signed(POSITION_BITS - 1 downto 0);
    variable owed : signed(19 downto 0);
  begin
    if rising_edge(clk) then
      -- Stage 1: count, rest and the carry to the code
      moved_1 <= up or down;
      down_1  <= down;
      past_1  <= past;
      if (up or down) = '1' then
        state.count <= unsigned(plus_minus(signed(state.count), to_unsigned(1, 18), down, '0'));
        if up = '1' and resize(state.count, 19) = state.counts - 1 then
          state.count <= (others => '0');
        elsif up = '0' and state.count = 0 then
          state.count <= resize(state.counts - 1, 18);
        end if;
        state.rest <= unsigned(total(19 downto 0));
        if past = '1' then
          state.rest <= unsigned(mended(19 downto 0));
        end if;
      end if;

      -- Stage 2: code
      if moved_1 = '1' then
        code       := plus_minus(signed(state.code), resize(state.code_step, POSITION_BITS), down_1, past_1);
        state.code <= unsigned(code);
      end if;
      if sample = '1' then
        code_theta <= state.code;
      end if;

      -- The correction: a new one, or a count of the last one
      owed := correction when correct = '1' else resize(signed'(not state.pending(19) & '1'), 20);
      if (correct or mend) = '1' then
        state.pending <= saturate(resize(state.pending, 21) + owed, 20);
      end if;
      state.moving <= (correct and fast) or (state.moving and (or state.pending));

      -- A new setting
      restarted       <= restart;
      setting_refused <= not good;
      if good = '1' then
        state.counts    <= counts;
        state.code_step <= code_step;
        state.code_rest <= code_rest;
      end if;
      if restart = '1' then
        state.count   <= (others => '0');
        state.code    <= resize(code_first, POSITION_BITS);
        state.rest    <= resize(code_rest, 20);
        state.pending <= (others => '0');
        state.moving  <= '0';
        moved_1       <= '0';
        if code_step(0) = '0' then
          state.rest <= resize(code_rest, 20) + counts;
        end if;
      end if;

      if rst = '1' then
        state.counts    <= (others => '0');
        state.code_step <= (others => '0');
        state.code_rest <= (others => '0');
        state.count     <= (others => '0');
        state.code      <= (others => '0');
        state.rest      <= (others => '0');
        state.pending   <= (others => '0');
        state.moving    <= '0';
        moved_1         <= '0';
        code_theta      <= (others => '0');
        restarted       <= '0';
        setting_refused <= '0';
      end if;
    end if;
  end process;

  count   <= state.count;
  pending <= state.pending;
  moving  <= state.moving;

end architecture rtl;
