-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: faults of the front ends by name, which trip the core.
--   0  index_wrong      the index of the encoder was off by more than correct_max counts
--   1  position_lost    more than bridge_max samples without a good frame of the encoder
--   2  converter_over   fast overcurrent of a delta-sigma modulator
--   3  no_index         the angle of an incremental encoder is unknown: its index was not seen, or not twice
--   4  hall_code        a code or a change that Hall sensors cannot give, see position_front
-- Faults 3 and 4 are none while the position is forced: the angle is then not that of the encoder.
-- Latched while enable is 1; clear_trip clears those whose cause is gone, where no new one came in the HELD clocks
-- before, as in fault_latch.  board_first contains the faults of the first
-- clock that tripped, until nothing trips any more.  board_stop belongs to the core's trip.
-- core_clear is clear_trip a clock later, for the core: board_stop is gone by then.
-- Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity board_faults is
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    index_wrong    : in  std_logic;
    position_lost  : in  std_logic;
    converter_over : in  std_logic;
    angle_unknown  : in  std_logic;
    hall_wrong     : in  std_logic;
    forced         : in  std_logic;
    enable         : in  std_logic;
    clear_trip     : in  std_logic;
    board_ignore   : in  unsigned(4 downto 0);
    board_flags    : out unsigned(4 downto 0);
    board_first    : out unsigned(4 downto 0);
    board_stop     : out std_logic;
    core_clear     : out std_logic
  );
end entity board_faults;

architecture rtl of board_faults is
  type state_t is record
    flags : unsigned(4 downto 0);
    first : unsigned(4 downto 0);
    stop  : std_logic;
    trips : unsigned(4 downto 0);  -- causes that trip, of the last clock
    held  : unsigned(4 downto 0);  -- clocks for which clear_trip clears nothing
  end record state_t;

  signal state    : state_t;
  signal now      : unsigned(4 downto 0);
  signal new_0    : unsigned(4 downto 0);
  signal trips_0  : unsigned(4 downto 0);
  signal caused   : std_logic;
  signal clear    : std_logic;
  signal flags    : unsigned(4 downto 0);
  signal tripping : unsigned(4 downto 0);
begin
  now      <= (hall_wrong and not forced) & (angle_unknown and not forced) & converter_over & position_lost
              & index_wrong;
  new_0    <= now and enable;
  trips_0  <= new_0 and not board_ignore;
  caused   <= or (trips_0 and not state.trips);
  clear    <= clear_trip and not caused and nor state.held;
  flags    <= new_0 or (state.flags and (now or not clear));
  tripping <= flags and not board_ignore;

  process (clk)
  begin
    if rising_edge(clk) then
      state.flags <= flags;
      state.stop  <= or tripping;
      core_clear  <= clear_trip;
      state.trips <= trips_0;
      if state.stop = '0' then
        state.first <= tripping;
      end if;
      if caused = '1' then
        state.held <= to_unsigned(FAULT_LATCH_HELD, 5);
      elsif state.held /= 0 then
        state.held <= state.held - 1;
      end if;

      if rst = '1' then
        state.flags <= (others => '0');
        state.first <= (others => '0');
        state.stop  <= '0';
        core_clear  <= '0';
        state.trips <= (others => '0');
        state.held  <= (others => '0');
      end if;
    end if;
  end process;

  board_flags <= state.flags;
  board_first <= state.first;
  board_stop  <= state.stop;

end architecture rtl;
