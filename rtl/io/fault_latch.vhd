-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: latches the faults and the first fault, and keeps the gates off until clear_trip.
--   0 to 5   faults of a sample, see sample_checks
--   6        no sample for watchdog clocks
--   7        input trip
--   8        a sample came too early and was rejected: reported, never a trip
--   9 to 11  overspeed, runaway, stall, see motion_checks
--   12       a phase or the motor is not connected, see load_check
--   13       the zero of a current sensor is wrong, see offset_check
--   14       the host does not write any more, see host_watch
--   15       encoder and EMF contradict each other, see emf_check
-- Faults are latched while enable is 1 (trip always); clear_trip clears the faults whose cause is gone, where no new
-- cause of a trip came in the HELD clocks before; else nothing: who wrote it on the bus cannot have seen that trip.
-- first_fault contains all faults of the first clock that tripped, until nothing trips any more.
-- fault_ignore: fault x is reported in the flags and does not trip; trip always trips.
-- gate_clear is such a clear_trip one clock later, when the flags are cleared, for the trip latch of the gates.
-- Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity fault_latch is
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    trip           : in  std_logic;
    sample_faults  : in  unsigned(5 downto 0);
    sample_late    : in  std_logic;
    sample_early   : in  std_logic;
    motion_faults  : in  unsigned(2 downto 0);
    open_load      : in  std_logic;
    current_offset : in  std_logic;
    host_lost      : in  std_logic;
    encoder_lost   : in  std_logic;
    enable         : in  std_logic;
    clear_trip     : in  std_logic;
    fault_ignore   : in  unsigned(15 downto 0);
    fault_flags    : out unsigned(15 downto 0);
    first_fault    : out unsigned(15 downto 0);
    fault_stop     : out std_logic;
    gate_clear     : out std_logic
  );
end entity fault_latch;

architecture rtl of fault_latch is
  -- State
  signal flags : unsigned(15 downto 0);
  signal first : unsigned(15 downto 0);
  signal stop  : std_logic;
  signal held  : unsigned(4 downto 0);  -- clocks for which clear_trip clears nothing
  signal trips : unsigned(15 downto 0);  -- causes that trip, of the last clock

  signal trips_0    : unsigned(15 downto 0);
  signal may_0      : unsigned(15 downto 0);  -- 1: the fault trips
  signal caused_0   : std_logic;
  signal clear_0    : std_logic;
  signal now_0      : unsigned(15 downto 0);
  signal new_0      : unsigned(15 downto 0);
  signal flags_0    : unsigned(15 downto 0);
  signal tripping_0 : unsigned(15 downto 0);
begin
  now_0 <= encoder_lost & host_lost & current_offset & open_load & motion_faults & sample_early & trip & sample_late
           & sample_faults;

  bits : for k in 0 to 15 generate
    new_0(k)      <= now_0(k) when k = FAULT_LATCH_TRIP else now_0(k) and enable;
    may_0(k)      <= '1' when k = FAULT_LATCH_TRIP else '0' when k = FAULT_LATCH_EARLY else not fault_ignore(k);
    trips_0(k)    <= new_0(k) and may_0(k);
    flags_0(k)    <= new_0(k) or (flags(k) and (now_0(k) or not clear_0));
    tripping_0(k) <= flags_0(k) and may_0(k);
  end generate;

  caused_0 <= or (trips_0 and not trips);
  clear_0  <= clear_trip and not caused_0 and nor held;

  process (clk)
  begin
    if rising_edge(clk) then
      flags      <= flags_0;
      stop       <= or tripping_0;
      gate_clear <= clear_0;
      trips      <= trips_0;
      if caused_0 = '1' then
        held <= to_unsigned(FAULT_LATCH_HELD, 5);
      elsif held /= 0 then
        held <= held - 1;
      end if;
      if stop = '0' then
        first <= tripping_0;
      end if;

      if rst = '1' then
        flags      <= (others => '0');
        first      <= (others => '0');
        stop       <= '0';
        trips      <= (others => '0');
        held       <= (others => '0');
        gate_clear <= '0';
      end if;
    end if;
  end process;

  fault_flags <= flags;
  first_fault <= first;
  fault_stop  <= stop;

end architecture rtl;
