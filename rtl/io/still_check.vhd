-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: whether the position code stands although the shaft cannot have stopped: a frozen sensor, or a jammed shaft.
--   turned = code(k) - code(k-1);  least = the one of turned and mean nearer to zero;  mean += (turned - mean)/4
--   v(k)   = v(k-1) + (least - v(k-1), at most slow_turn either way)
--   moved  = |code - anchor| >= still_turn: then anchor = code
--   owed   = 0 if moved or v turns against it, else owed + v
--   stands = |owed| >= 3*still_turn + 2*slow_turn with gates on, for 1,022 samples at most; still_turn = 0: off
-- v is the least speed of a shaft that was braked by slow_turn since its code moved last, owed its least angle.
-- omega_was = |omega_me| of the sample in which the code moved last.  After a reset and with position_restart all
-- begins anew.
-- Formats: codes in 2**-18 turn, v and owed in 2**-26 turn.  Latency: 8.  Interval: 8.
-- Rounding: mean is cut (floor); |x| is the one's complement where x is negative; owed saturates at two turns, the samples at 1,023.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity still_check is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk              : in  std_logic;
    rst              : in  std_logic;
    in_valid         : in  std_logic;
    code_theta       : in  unsigned(POSITION_BITS - 1 downto 0);
    omega_me         : in  signed(PU_W - 1 downto 0);
    run              : in  std_logic;
    position_restart : in  std_logic;
    still_turn       : in  unsigned(16 downto 0);
    slow_turn        : in  unsigned(19 downto 0);
    out_valid        : out std_logic;
    stands           : out std_logic;
    omega_was        : out unsigned(PU_W - 2 downto 0)
  );
end entity still_check;

architecture rtl of still_check is
  constant LATENCY : positive := STILL_CHECK_LATENCY;
  constant SHIFT   : natural  := STILL_CHECK_SHIFT;
  constant OWED_W  : positive := STILL_CHECK_OWED_W;
  constant V_W     : positive := TURN_W + SHIFT;

  type state_t is record
    seen   : std_logic;
    code   : unsigned(TURN_W - 1 downto 0);
    anchor : unsigned(TURN_W - 1 downto 0);
    mean   : signed(V_W - 1 downto 0);
    v      : signed(V_W - 1 downto 0);
    owed   : signed(OWED_W - 1 downto 0);
    was    : unsigned(PU_W - 2 downto 0);
    age    : unsigned(9 downto 0);
  end record state_t;

  constant EMPTY : state_t := ('0', (others => '0'), (others => '0'), (others => '0'), (others => '0'),
                               (others => '0'), (others => '0'), (others => '0'));

  signal state : state_t;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal code_0   : unsigned(TURN_W - 1 downto 0);
  signal begins_1 : std_logic;
  signal turned_1 : signed(TURN_W - 1 downto 0);
  signal away_1   : signed(TURN_W - 1 downto 0);
  signal scaled_1 : signed(V_W - 1 downto 0);
  signal least_2  : signed(V_W - 1 downto 0);
  signal moved_2  : std_logic;
  signal change_3 : signed(V_W downto 0);
  signal change_4 : signed(V_W downto 0);
  signal limit_5  : unsigned(OWED_W - 2 downto 0);
  signal back_5   : std_logic;
  signal off_7    : std_logic;

  constant STILL_TIMES : positive := STILL_CHECK_STILL_TIMES;
  constant SLOW_TIMES  : positive := STILL_CHECK_SLOW_TIMES;
begin
  valid(0) <= in_valid;
  code_0   <= shift_left(resize(code_theta, TURN_W), TURN_W - POSITION_BITS);
  scaled_1 <= shift_left(resize(turned_1, V_W), SHIFT);
  back_5   <= '1' when (state.owed > 0 and state.v < 0) or (state.owed < 0 and state.v > 0) else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: turned = code - code';  away = code - anchor
      if valid(0) = '1' then
        begins_1   <= position_restart or not state.seen;
        turned_1   <= signed(code_0 - state.code);
        away_1     <= signed(code_0 - state.anchor);
        state.seen <= '1';
        state.code <= code_0;
      end if;

      -- Stage 2: least = turned or mean, the nearer to zero;  mean;  moved
      if valid(1) = '1' then
        least_2 <= scaled_1;
        if (state.mean >= 0 and scaled_1 > state.mean) or (state.mean < 0 and scaled_1 < state.mean) then
          least_2 <= state.mean;
        end if;
        state.mean <= state.mean + resize(shift_right(resize(scaled_1, V_W + 1) - state.mean, STILL_CHECK_MEAN), V_W);
        if begins_1 = '1' then
          state.mean <= (others => '0');
        end if;
        moved_2 <= '1' when begins_1 = '1' or unsigned(size(away_1)) >= still_turn else '0';
      end if;

      -- Stage 3: change = least - v;  what the code moved to
      if valid(2) = '1' then
        change_3 <= resize(least_2, V_W + 1) - state.v;
        if moved_2 = '1' then
          state.anchor <= state.code;
          state.was    <= unsigned(omega_me(PU_W - 2 downto 0) xor omega_me(PU_W - 1));
        end if;
      end if;

      -- Stage 4: change, at most slow_turn
      if valid(3) = '1' then
        change_4 <= within(change_3, slow_turn, 0);
      end if;

      -- Stage 5: v = v + change;  limit = 3*still_turn + 2*slow_turn
      if valid(4) = '1' then
        state.v <= resize(state.v + change_4, V_W);
        if begins_1 = '1' then
          state.v <= (others => '0');
        end if;
        limit_5 <= resize(STILL_TIMES * shift_left(resize(still_turn, OWED_W - 1), SHIFT), OWED_W - 1)
                   + resize(SLOW_TIMES * resize(slow_turn, OWED_W - 1), OWED_W - 1);
      end if;

      -- Stage 6: owed = owed + v
      if valid(5) = '1' then
        state.owed <= saturate(resize(state.owed, OWED_W + 1) + state.v, OWED_W);
        if (moved_2 or back_5) = '1' then
          state.owed <= (others => '0');
        end if;
      end if;

      -- Stage 7: off = |owed| >= limit
      if valid(6) = '1' then
        off_7 <= '1' when still_turn /= 0 and unsigned(size(state.owed)) >= limit_5 else '0';
      end if;

      -- Stage 8: age = samples since then;  the verdict
      if valid(7) = '1' then
        stands    <= '0';
        omega_was <= state.was;
        if off_7 = '0' or run = '0' then
          state.age <= (others => '0');
        elsif (and state.age) = '0' then
          state.age <= state.age + 1;
          stands    <= '1' when (and state.age(9 downto 1)) = '0' else '0';
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state               <= EMPTY;
        stands              <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
