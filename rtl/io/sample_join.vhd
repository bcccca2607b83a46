-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the sample of the core: when both the codes of the converters and the position of a trigger are there.
--   sample_valid = the later of codes_valid and position_done since the last sample_trigger
-- What is missing at the next trigger is forgotten: such a trigger has no sample, and the core's watchdog runs.
-- What comes at the clock of a trigger belongs to that trigger.
-- Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;

entity sample_join is
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    sample_trigger : in  std_logic;
    codes_valid    : in  std_logic;
    position_done  : in  std_logic;
    sample_valid   : out std_logic
  );
end entity sample_join;

architecture rtl of sample_join is
  type state_t is record
    codes    : std_logic;
    position : std_logic;
  end record state_t;

  signal state    : state_t;
  signal codes    : std_logic;
  signal position : std_logic;
  signal both     : std_logic;
begin
  codes    <= codes_valid or (state.codes and not sample_trigger);
  position <= position_done or (state.position and not sample_trigger);
  both     <= codes and position;

  process (clk)
  begin
    if rising_edge(clk) then
      state.codes    <= codes and not both;
      state.position <= position and not both;
      sample_valid   <= both;

      if rst = '1' then
        state        <= (others => '0');
        sample_valid <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
