-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: bits of delta-sigma modulators: makes their clock, or follows one, and registers their data.
-- follow_clock = 0: mod_clock has a period of mod_ratio clocks, high for the first half (rounded down).  A bit is the
-- level of its pin sample_delay clocks after the rising edge of mod_clock has left its register.
-- follow_clock = 1: the clock comes with the data, high and low for at least two clocks each.  A bit is the level of
-- its pin 2 + sample_delay clocks after the clock at which the pin of the modulator's clock was first high.
-- Timing: mod_data and mod_clock_in are not synchronous and pass two registers.  sample_delay is chosen such that the
-- data are stable when they are taken; the registers settle what moves at any other time.
-- Formats: bits, clocks.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity modulator_input is
  generic (
    LINES : positive range 1 to 8 := 3
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    mod_data     : in  unsigned(LINES - 1 downto 0);
    mod_clock_in : in  std_logic;
    mod_ratio    : in  unsigned(5 downto 0);
    sample_delay : in  unsigned(3 downto 0);
    follow_clock : in  std_logic;
    mod_clock    : out std_logic;
    bits         : out unsigned(LINES - 1 downto 0);
    bits_valid   : out std_logic
  );
end entity modulator_input;

architecture rtl of modulator_input is
  constant STROBES : positive := MODULATOR_INPUT_STROBES;

  type state_t is record
    tick         : unsigned(5 downto 0);  -- clock within a period of mod_clock
    clock_before : std_logic;
    strobes      : unsigned(STROBES - 1 downto 0);  -- rising edges of the last clocks, the newest at bit 0
  end record state_t;

  signal state : state_t;

  -- What comes from another clock
  signal clock_meta : std_logic;
  signal clock_now  : std_logic;
  signal data_meta  : unsigned(LINES - 1 downto 0);
  signal data_now   : unsigned(LINES - 1 downto 0);

  attribute async_reg : string;

  attribute async_reg of clock_meta : signal is "TRUE";
  attribute async_reg of clock_now  : signal is "TRUE";
  attribute async_reg of data_meta  : signal is "TRUE";
  attribute async_reg of data_now   : signal is "TRUE";

  signal half  : unsigned(5 downto 0);
  signal rises : std_logic;
begin
  half  <= shift_right(mod_ratio, 1);
  rises <= clock_now and not state.clock_before when follow_clock = '1' else '1' when state.tick = 0 else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      clock_meta         <= mod_clock_in;
      clock_now          <= clock_meta;
      state.clock_before <= clock_now;
      data_meta          <= mod_data;
      data_now           <= data_meta;

      state.tick <= state.tick + 1;
      if resize(state.tick, 7) + 1 >= mod_ratio then
        state.tick <= (others => '0');
      end if;
      state.strobes <= state.strobes(STROBES - 2 downto 0) & rises;

      mod_clock  <= (state.tick ?< half) and not follow_clock;
      bits_valid <= state.strobes(to_integer(sample_delay));

      if rst = '1' then
        state.tick         <= (others => '0');
        clock_meta         <= '0';
        clock_now          <= '0';
        state.clock_before <= '0';
        data_meta          <= (others => '0');
        data_now           <= (others => '0');
        state.strobes      <= (others => '0');
        mod_clock          <= '0';
        bits_valid         <= '0';
      end if;
    end if;
  end process;

  bits <= data_now;

end architecture rtl;
