-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: faults of the front ends by name, which trip the core.
--   0  index_wrong      the index of the encoder was off by more than correct_max counts
--   1  position_lost    more than bridge_max samples without a good frame of the encoder
--   2  converter_over   fast overcurrent of a delta-sigma modulator
-- Latched while enable is 1; clear_trip clears those whose cause is gone.  board_first contains the faults of the first
-- clock that tripped, until nothing trips any more.  board_stop belongs to the core's trip.
-- Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity board_faults is
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    index_wrong    : in  std_logic;
    position_lost  : in  std_logic;
    converter_over : in  std_logic;
    enable         : in  std_logic;
    clear_trip     : in  std_logic;
    board_ignore   : in  unsigned(2 downto 0);
    board_flags    : out unsigned(2 downto 0);
    board_first    : out unsigned(2 downto 0);
    board_stop     : out std_logic
  );
end entity board_faults;

architecture rtl of board_faults is
  type state_t is record
    flags : unsigned(2 downto 0);
    first : unsigned(2 downto 0);
    stop  : std_logic;
  end record state_t;

  signal state    : state_t;
  signal now      : unsigned(2 downto 0);
  signal flags    : unsigned(2 downto 0);
  signal tripping : unsigned(2 downto 0);
begin
  now      <= converter_over & position_lost & index_wrong;
  flags    <= (now and enable) or (state.flags and (now or not clear_trip));
  tripping <= flags and not board_ignore;

  process (clk)
  begin
    if rising_edge(clk) then
      state.flags <= flags;
      state.stop  <= or tripping;
      if state.stop = '0' then
        state.first <= tripping;
      end if;

      if rst = '1' then
        state.flags <= (others => '0');
        state.first <= (others => '0');
        state.stop  <= '0';
      end if;
    end if;
  end process;

  board_flags <= state.flags;
  board_first <= state.first;
  board_stop  <= state.stop;

end architecture rtl;
