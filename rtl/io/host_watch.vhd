-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: whether the host still writes: no write for heartbeat sample times is a fault.
--   host_lost = 1 from heartbeat periods after the last write until the next one;  heartbeat = 0: never
-- Any write that the registers accept counts.
-- Formats: sample times.  Latency: 1 (every clock is a sample).  Rounding: none.
-- The age is counted up to heartbeat only, so that it cannot wrap and a new value takes effect at once.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity host_watch is
  port (
    clk        : in  std_logic;
    rst        : in  std_logic;
    host_write : in  std_logic;
    period     : in  std_logic;
    heartbeat  : in  unsigned(15 downto 0);
    host_lost  : out std_logic
  );
end entity host_watch;

architecture rtl of host_watch is
  -- State
  signal age : unsigned(15 downto 0);

  signal expired : std_logic;
begin
  expired <= '1' when age >= heartbeat else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      if host_write = '1' then
        age <= (others => '0');
      elsif (period and not expired) = '1' then
        age <= age + 1;
      end if;
      host_lost <= expired and (or heartbeat) and not host_write;

      if rst = '1' then
        age       <= (others => '0');
        host_lost <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
