-- Purpose: latches the faults and the first fault, and keeps the gates off until clear_trip.
--   0 to 5  faults of a sample, see sample_checks
--   6       no sample for watchdog clocks
--   7       input trip
--   8       a sample came too early and was rejected: reported, never a trip
-- Faults are latched while enable is 1 (trip always); clear_trip clears the faults whose cause is gone.
-- first_fault contains all faults of the first clock that tripped, until nothing trips any more.
-- fault_ignore: fault x of 0 to 6 is reported in the flags and does not trip; trip always trips.
-- gate_clear is clear_trip one clock later, when the flags are cleared, for the trip latch of the gates.
-- Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity fault_latch is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    trip          : in  std_logic;
    sample_faults : in  unsigned(5 downto 0);
    sample_late   : in  std_logic;
    sample_early  : in  std_logic;
    enable        : in  std_logic;
    clear_trip    : in  std_logic;
    fault_ignore  : in  unsigned(6 downto 0);
    fault_flags   : out unsigned(8 downto 0);
    first_fault   : out unsigned(7 downto 0);
    fault_stop    : out std_logic;
    gate_clear    : out std_logic
  );
end entity fault_latch;

architecture rtl of fault_latch is
  -- State
  signal flags : unsigned(8 downto 0);
  signal first : unsigned(7 downto 0);
  signal stop  : std_logic;

  signal now_0      : unsigned(8 downto 0);
  signal new_0      : unsigned(8 downto 0);
  signal flags_0    : unsigned(8 downto 0);
  signal tripping_0 : unsigned(7 downto 0);
begin
  now_0(5 downto 0)        <= sample_faults;
  now_0(FAULT_LATCH_LATE)  <= sample_late;
  now_0(FAULT_LATCH_TRIP)  <= trip;
  now_0(FAULT_LATCH_EARLY) <= sample_early;

  bits : for k in 0 to 8 generate
    new_0(k)   <= now_0(k) when k = FAULT_LATCH_TRIP else now_0(k) and enable;
    flags_0(k) <= new_0(k) or (flags(k) and (now_0(k) or not clear_trip));
  end generate;

  tripping_0(6 downto 0) <= flags_0(6 downto 0) and not fault_ignore;
  tripping_0(7)          <= flags_0(7);

  process (clk)
  begin
    if rising_edge(clk) then
      flags      <= flags_0;
      stop       <= or tripping_0;
      gate_clear <= clear_trip;
      if stop = '0' then
        first <= tripping_0;
      end if;

      if rst = '1' then
        flags      <= (others => '0');
        first      <= (others => '0');
        stop       <= '0';
        gate_clear <= '0';
      end if;
    end if;
  end process;

  fault_flags <= flags;
  first_fault <= first;
  fault_stop  <= stop;

end architecture rtl;
