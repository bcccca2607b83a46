-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: rejects raw samples that come too early, and reports missing ones.
-- A strobe less than INTERVAL clocks after the last accepted one is rejected (sample_busy), reported (sample_early) and
-- counted in early_samples, which saturates.
-- sample_late is 1 from watchdog clocks after the last sample until the next one enters; watchdog = 0 is always late.
-- Formats: clocks.  Latency: 1 (every clock is a sample).  Rounding: none.
-- The age is counted up to watchdog only, so that it cannot wrap and a new value takes effect at once.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity sample_guard is
  generic (
    INTERVAL : positive range 2 to 256 := 48;
    AGE_W    : positive range 4 to 20  := SAMPLE_GUARD_AGE_W
  );
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    sample_valid  : in  std_logic;
    clear_trip    : in  std_logic;
    watchdog      : in  unsigned(AGE_W - 1 downto 0);
    sample_busy   : out std_logic;
    sample_early  : out std_logic;
    sample_late   : out std_logic;
    early_samples : out unsigned(7 downto 0)
  );
end entity sample_guard;

architecture rtl of sample_guard is
  -- State
  signal hold    : unsigned(7 downto 0);
  signal busy    : std_logic;  -- hold /= 0; registered, because every write between samples depends on it
  signal last    : std_logic;  -- hold = 1
  signal age     : unsigned(AGE_W - 1 downto 0);
  signal counted : unsigned(7 downto 0);

  signal entered : std_logic;
  signal early   : std_logic;
  signal expired : std_logic;
begin
  entered <= sample_valid and not busy;
  early   <= sample_valid and busy;
  expired <= '1' when age >= watchdog else '0';

  process (clk)
    variable counted_v : unsigned(7 downto 0);
  begin
    if rising_edge(clk) then
      -- Clocks until the next sample may enter, and clocks since the last one
      if entered = '1' then
        hold <= to_unsigned(INTERVAL - 1, 8);
        busy <= '1';
        last <= '1' when INTERVAL = 2 else '0';
        age  <= to_unsigned(SAMPLE_GUARD_AHEAD, AGE_W);
      else
        if busy = '1' then
          hold <= hold - 1;
          busy <= not last;
          last <= '1' when hold = 2 else '0';
        end if;
        if expired = '0' then
          age <= age + 1;
        end if;
      end if;

      -- Outputs
      counted_v := counted;
      if clear_trip = '1' then
        counted_v := (others => '0');
      end if;
      if early = '1' and counted_v /= 255 then
        counted_v := counted_v + 1;
      end if;
      counted      <= counted_v;
      sample_early <= early;
      sample_late  <= expired and not entered;

      if rst = '1' then
        hold         <= (others => '0');
        busy         <= '0';
        last         <= '0';
        age          <= (others => '0');
        counted      <= (others => '0');
        sample_early <= '0';
        sample_late  <= '0';
      end if;
    end if;
  end process;

  sample_busy   <= busy;
  early_samples <= counted;

end architecture rtl;
