-- Purpose: steps to the count within a turn of counts and to the position code; an index finds and mends lost counts.
--   code = round((count + 1/2) * 2**POSITION_BITS / counts), modulo one turn
-- Nothing is multiplied: code and rest are quotient and remainder of a division by 2*counts, and a step adds that of
-- 2*2**POSITION_BITS, which software writes as code_step = floor(2**POSITION_BITS / counts) and code_rest, its remainder.
-- code_theta is latched by sample.
-- The first index makes the count 0; the correction takes a count a clock (moving), and so does a start before it.
-- A later index counts what was lost and corrects it by one count a sample, or flags it if it is above correct_max.
-- A new setting starts again; an impossible one is refused and the count stays 0.
-- Formats: counts.  Latency: 1 (every clock is a sample).  Rounding: half up, exact; code and count wrap.

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
    index           : in  std_logic;
    sample          : in  std_logic;
    start           : in  std_logic;
    start_count     : in  unsigned(17 downto 0);
    clear_faults    : in  std_logic;
    counts          : in  unsigned(18 downto 0);
    code_step       : in  unsigned(16 downto 0);
    code_rest       : in  unsigned(17 downto 0);
    correct_max     : in  unsigned(11 downto 0);
    code_theta      : out unsigned(POSITION_BITS - 1 downto 0);
    count           : out unsigned(17 downto 0);
    referenced      : out std_logic;
    moving          : out std_logic;
    index_count     : out unsigned(17 downto 0);
    lost_counts     : out unsigned(11 downto 0);
    index_lost      : out std_logic;
    index_wrong     : out std_logic;
    setting_refused : out std_logic
  );
end entity turn_counter;

architecture rtl of turn_counter is
  type state_t is record
    counts      : unsigned(18 downto 0);
    code_step   : unsigned(16 downto 0);
    code_rest   : unsigned(17 downto 0);
    count       : unsigned(17 downto 0);
    code        : unsigned(POSITION_BITS - 1 downto 0);
    rest        : unsigned(19 downto 0);
    pending     : signed(19 downto 0);  -- counts still to be added by the correction
    moving      : std_logic;
    referenced  : std_logic;
    lost_counts : unsigned(11 downto 0);
    index_lost  : std_logic;
    index_wrong : std_logic;
  end record state_t;

  constant STATE_0 : state_t := (
    moving      => '0',
    referenced  => '0',
    index_lost  => '0',
    index_wrong => '0',
    counts      => (others => '0'),
    code_step   => (others => '0'),
    code_rest   => (others => '0'),
    count       => (others => '0'),
    code        => (others => '0'),
    rest        => (others => '0'),
    pending     => (others => '0'),
    lost_counts => (others => '0')
  );

  signal state : state_t;

  signal index_1 : std_logic;
  signal index_2 : std_logic;
  signal index_3 : std_logic;
  signal found_2 : signed(20 downto 0);  -- count at the index, as if the correction were complete
  signal off_3   : signed(20 downto 0);  -- the same, the shorter way round

  signal good    : std_logic;
  signal begin_0 : std_logic;
  signal stepped : std_logic;
  signal correct : std_logic;
  signal up      : std_logic;
  signal down    : std_logic;
  signal lost    : unsigned(20 downto 0);
  signal first   : std_logic;
  signal off     : std_logic;
  signal mend    : std_logic;
  signal wrong   : std_logic;
  signal start_0 : std_logic;
begin
  good    <= '1' when counts >= 4 and counts <= 2 ** 18 and resize(code_rest, 19) < counts else '0';
  begin_0 <= '0' when good = '1' and counts = state.counts and code_step = state.code_step and
             code_rest = state.code_rest else '1';

  -- A step of the encoder, else one count of the correction
  stepped <= step_up or step_down;
  correct <= (sample or state.moving) and not stepped and not start when state.pending /= 0 else '0';
  up      <= step_up or (correct and not state.pending(19));
  down    <= not up and (step_down or correct);

  -- Stage 4: the first index, or a count that is off
  lost    <= magnitude(off_3);
  first   <= index_3 and not state.referenced;
  off     <= index_3 and state.referenced when off_3 /= 0 else '0';
  mend    <= off when lost <= correct_max else '0';
  wrong   <= off and not mend;
  start_0 <= start and not state.referenced;

  process (clk)
    variable rest       : signed(21 downto 0);
    variable past       : std_logic;
    variable pending    : signed(20 downto 0);
    variable counted    : unsigned(21 downto 0);
    variable code_first : unsigned(17 downto 0);
  begin
    if rising_edge(clk) then
      -- count, code and rest
      past := '0';
      if up = '1' then
        state.count <= state.count + 1;
        if resize(state.count, 19) = state.counts - 1 then
          state.count <= (others => '0');
        end if;
        rest := signed(resize(state.rest, 22)) + signed(resize(state.code_rest & '0', 22));
        past := '1' when rest >= signed(resize(state.counts & '0', 22)) else '0';
        if past = '1' then
          rest := rest - signed(resize(state.counts & '0', 22));
        end if;
        state.rest <= unsigned(rest(19 downto 0));
        state.code <= resize(resize(state.code, 18) + state.code_step + unsigned'(0 => past), POSITION_BITS);
      elsif down = '1' then
        state.count <= state.count - 1;
        if state.count = 0 then
          state.count <= resize(state.counts - 1, 18);
        end if;
        rest := signed(resize(state.rest, 22)) - signed(resize(state.code_rest & '0', 22));
        past := rest(21);
        if past = '1' then
          rest := rest + signed(resize(state.counts & '0', 22));
        end if;
        state.rest <= unsigned(rest(19 downto 0));
        state.code <= resize(resize(state.code, 18) - state.code_step - unsigned'(0 => past), POSITION_BITS);
      end if;
      if sample = '1' then
        code_theta <= state.code;
      end if;

      -- Stage 1: the index came with a step, which the count has now.  Stage 2: found = count at the index
      index_1 <= index and not (index_1 or index_2 or index_3);
      index_2 <= index_1;
      index_3 <= index_2;
      if index_1 = '1' then
        index_count <= state.count;
      end if;
      found_2 <= signed(resize(state.count, 21)) + state.pending;

      -- Stage 3: off = found, the shorter way round
      off_3 <= found_2;
      if found_2 & '0' > signed(resize(state.counts, 22)) then
        off_3 <= found_2 - signed(resize(state.counts, 21));
      end if;

      -- The correction; what an index asks for and a count of it may come at the same clock
      pending := resize(state.pending, 21);
      if correct = '1' then
        pending := pending + signed'(not state.pending(19) & '1');
      end if;
      if (first or mend) = '1' then
        pending := pending - off_3;
      end if;
      if start_0 = '1' then
        pending := signed(resize(start_count, 21)) - signed(resize(state.count, 21));
      end if;
      state.pending    <= pending(19 downto 0);
      state.moving     <= first or start_0 or (state.moving and (or state.pending));
      state.referenced <= first or (state.referenced and not (state.index_wrong and clear_faults));

      -- Lost counts
      counted := resize(state.lost_counts, 22);
      if clear_faults = '1' then
        counted := (others => '0');
      end if;
      if mend = '1' then
        counted := counted + lost;
      end if;
      state.lost_counts <= saturate_u(signed(counted), 12);
      state.index_lost  <= mend or (state.index_lost and not clear_faults);
      state.index_wrong <= wrong or (state.index_wrong and not clear_faults);

      -- A new setting
      setting_refused <= not good;
      if good = '1' then
        state.counts    <= counts;
        state.code_step <= code_step;
        state.code_rest <= code_rest;
      end if;
      if begin_0 = '1' then
        code_first       := shift_right(resize(code_step, 18) + 1, 1);
        state.code       <= resize(code_first, POSITION_BITS);
        state.rest       <= resize(code_rest, 20);
        state.count      <= (others => '0');
        state.pending    <= (others => '0');
        state.moving     <= '0';
        state.referenced <= '0';
        index_1          <= '0';
        index_2          <= '0';
        index_3          <= '0';
        if code_step(0) = '0' then
          state.rest <= resize(code_rest, 20) + counts;
        end if;
      end if;

      if rst = '1' then
        state           <= STATE_0;
        code_theta      <= (others => '0');
        index_count     <= (others => '0');
        index_1         <= '0';
        index_2         <= '0';
        index_3         <= '0';
        setting_refused <= '0';
      end if;
    end if;
  end process;

  count       <= state.count;
  referenced  <= state.referenced;
  moving      <= state.moving;
  lost_counts <= state.lost_counts;
  index_lost  <= state.index_lost;
  index_wrong <= state.index_wrong;

end architecture rtl;
