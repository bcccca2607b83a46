-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: from torque and flux limit to current references at the least current, by a table of the motor.
--   top = TOP(flux_part);  t = torque_gain*|torque_now|/top, at most 1: torque_limited;  i_d, i_q = table(flux_part, t)
--   torque_max = (2 - torque_gain)*top
-- Each of two block RAMs holds a current of the table; table_word writes one word at every clock in which its bit 30 is
-- set.  EXAMPLE = 1 fills them at power-up, for the bench.
-- Formats: torque_gain U(1,16); flux_part and t U(0,16), of which the interpolation uses 10 bits; table words PU.
-- Latency: 28.  Interval: 28.  Rounding: floored; torque_max saturates.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity reference_table is
  generic (
    EXAMPLE : natural range 0 to 1 := 0
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    in_valid       : in  std_logic;
    flux_part      : in  unsigned(15 downto 0);
    torque_now     : in  signed(PU_W - 1 downto 0);
    torque_gain    : in  unsigned(16 downto 0);
    table_word     : in  unsigned(30 downto 0);
    out_valid      : out std_logic;
    i_d_table      : out signed(PU_W - 1 downto 0);
    i_q_table      : out signed(PU_W - 1 downto 0);
    torque_max     : out signed(PU_W - 1 downto 0);
    torque_limited : out std_logic
  );
end entity reference_table;

architecture rtl of reference_table is
  constant LATENCY : positive := REFERENCE_TABLE_LATENCY;
  constant BITS    : positive := REFERENCE_TABLE_COLUMN_BITS;

  subtype word_t is signed(PU_W - 1 downto 0);
  type ram_t is array (0 to REFERENCE_TABLE_ROWS * REFERENCE_TABLE_WORDS - 1) of word_t;

  function power_up (d_axis : boolean) return ram_t is
    variable result : ram_t := (others => (others => '0'));
  begin
    if EXAMPLE = 1 then
      for k in result'range loop
        result(k) := REFERENCE_TABLE_EXAMPLE_D(k) when d_axis else REFERENCE_TABLE_EXAMPLE_Q(k);
      end loop;
    end if;
    return result;
  end function;

  signal ram_d : ram_t := power_up(true);
  signal ram_q : ram_t := power_up(false);

  signal valid          : std_logic_vector(0 to LATENCY);
  signal address        : unsigned(10 downto 0);
  signal word_d, last_d : word_t;  -- the word read, and the one before it
  signal word_q, last_q : word_t;
  signal a_d, b_d, y_d  : word_t;  -- ends of an interpolation, and the point between them
  signal a_q, b_q, y_q  : word_t;
  signal low_d, low_q   : word_t;  -- the currents of the lower row
  signal rows           : std_logic;  -- between both rows, not between two words
  signal fraction       : unsigned(BITS - 1 downto 0);
  signal gain           : signed(PU_W - 1 downto 0);  -- torque_gain or 2 - torque_gain
  signal torque         : signed(PU_W downto 0);
  signal p_torque       : signed(2 * PU_W downto 0);
  signal row_at         : unsigned(21 downto 0);
  signal column_at      : unsigned(20 downto 0);
  signal column         : unsigned(4 downto 0);
  signal row            : unsigned(5 downto 0);
  signal down, along    : unsigned(BITS - 1 downto 0);
  signal asked          : unsigned(PU_W - 1 downto 0);
  signal top            : word_t;
  signal part           : unsigned(15 downto 0);
  signal part_valid     : std_logic;
begin
  valid(0) <= in_valid;

  row_at    <= shift_left(resize(flux_part, 22), 6) - flux_part;  -- flux_part*(ROWS - 1)
  column_at <= shift_left(resize(part, 21), 5) - shift_left(resize(part, 21), 1);  -- part*(COLUMNS - 1)
  row       <= row_at(21 downto 16);
  down      <= row_at(15 downto 16 - BITS);
  column    <= column_at(20 downto 16);
  along     <= column_at(15 downto 16 - BITS);

  -- Stages 8 to 16: t = torque_gain*|torque_now|/top
  torque_part : entity work.ratio
    port map (clk => clk, rst => rst, in_valid => valid(7),
              dividend => asked, divisor => unsigned(top),
              out_valid => part_valid, ratio => part, full => torque_limited);

  -- Between two words: stages 4 to 6, 20 to 22, 22 to 24;  between both rows: stages 25 to 27
  rows     <= valid(24);
  a_d      <= low_d when rows = '1' else last_d;
  a_q      <= low_q when rows = '1' else last_q;
  b_d      <= y_d when rows = '1' else word_d;
  b_q      <= y_q when rows = '1' else word_q;
  fraction <= along when valid(19) = '1' or valid(21) = '1' else down;

  between_d : entity work.interpolation
    port map (clk => clk, a => a_d, b => b_d, fraction => fraction, y => y_d);

  between_q : entity work.interpolation
    port map (clk => clk, a => a_q, b => b_q, fraction => fraction, y => y_q);

  -- The table: two block RAMs, written by software, read word by word
  process (clk)
  begin
    if rising_edge(clk) then
      if table_word(30 downto 29) = "10" then
        ram_d(to_integer(table_word(28 downto 18))) <= signed(table_word(PU_W - 1 downto 0));
      end if;
      if table_word(30 downto 29) = "11" then
        ram_q(to_integer(table_word(28 downto 18))) <= signed(table_word(PU_W - 1 downto 0));
      end if;
      word_d <= ram_d(to_integer(address));
      word_q <= ram_q(to_integer(address));
    end if;
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      last_d   <= word_d;
      last_q   <= word_q;
      p_torque <= torque * gain;

      -- Stages 1 to 3: torque_gain*|torque_now|
      if valid(0) = '1' then
        torque <= signed('0' & magnitude(torque_now));
        gain   <= signed(resize(torque_gain, PU_W));
      end if;
      if valid(2) = '1' then
        asked <= unsigned(p_torque(16 + PU_W - 1 downto 16));
      end if;

      -- The words in the order of their use: TOP of both rows, both columns of a row, both of the next
      if valid(0) = '1' then
        address <= row & "11111";
      end if;
      if valid(1) = '1' then
        address <= (row + 1) & "11111";
      end if;
      if part_valid = '1' then
        address <= row & column;
      end if;
      if valid(17) = '1' then
        address <= row & (column + 1);
      end if;
      if valid(18) = '1' then
        address <= (row + 1) & column;
      end if;
      if valid(19) = '1' then
        address <= (row + 1) & (column + 1);
      end if;

      -- Stage 7: top, not negative;  stages 8 to 10: torque_max = (2 - torque_gain)*top
      if valid(6) = '1' then
        top <= y_d;
        if y_d < 0 then
          top <= (others => '0');
        end if;
      end if;
      if valid(7) = '1' then
        torque <= resize(top, PU_W + 1);
        gain   <= signed(to_unsigned(2 ** 17, PU_W) - torque_gain);
      end if;
      if valid(9) = '1' then
        torque_max <= signed('0' & p_torque(16 + PU_W - 2 downto 16));
        if p_torque(16 + PU_W - 1) = '1' then
          torque_max <= (PU_W - 1 => '0', others => '1');
        end if;
      end if;

      -- Stage 23: the currents of the lower row;  stage 28: those between both rows, i_q with the torque's sign
      if valid(22) = '1' then
        low_d <= y_d;
        low_q <= y_q;
      end if;
      if valid(LATENCY - 1) = '1' then
        i_d_table <= y_d;
        i_q_table <= negated(y_q, torque_now(PU_W - 1));
        if y_q < 0 then
          i_q_table <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        i_d_table           <= (others => '0');
        i_q_table           <= (others => '0');
        torque_max          <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
