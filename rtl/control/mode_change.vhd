-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: which mode regulates this sample, and whether it is the first one of its mode.
--   mode       = position, else speed, else voltage with voltage_mode, else torque
--   by_voltage = the mode is voltage: the host's voltage takes the place of the current regulators'
--   take_over  = speed or position mode, and the sample before had another mode
--              = position mode, and the sample before was its first: the torque of its trajectory begins here
--   follows    = the voltage of this sample or of the one before is the host's
-- Formats: bits.  Latency: 1.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity mode_change is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    speed_mode   : in  std_logic;
    by_position  : in  std_logic;
    voltage_mode : in  std_logic;
    out_valid    : out std_logic;
    by_voltage   : out std_logic;
    take_over    : out std_logic;
    follows      : out std_logic
  );
end entity mode_change;

architecture rtl of mode_change is
  subtype mode_t is unsigned(MODE_CHANGE_MODE_W - 1 downto 0);
  constant TORQUE   : mode_t := to_unsigned(MODE_CHANGE_TORQUE, MODE_CHANGE_MODE_W);
  constant VOLTAGE  : mode_t := to_unsigned(MODE_CHANGE_VOLTAGE, MODE_CHANGE_MODE_W);
  constant SPEED    : mode_t := to_unsigned(MODE_CHANGE_SPEED, MODE_CHANGE_MODE_W);
  constant POSITION : mode_t := to_unsigned(MODE_CHANGE_POSITION, MODE_CHANGE_MODE_W);

  signal mode_0 : mode_t;
  signal mode   : mode_t;  -- of the last sample
  signal fresh  : std_logic;  -- it was the first of position mode
begin
  mode_0 <= POSITION when by_position = '1' else
            SPEED when speed_mode = '1' else
            VOLTAGE when voltage_mode = '1' else
            TORQUE;

  process (clk)
  begin
    if rising_edge(clk) then
      out_valid <= in_valid;

      -- Stage 1: the mode, and what begins with it
      if in_valid = '1' then
        mode       <= mode_0;
        by_voltage <= '1' when mode_0 = VOLTAGE else '0';
        fresh      <= '1' when mode_0 = POSITION and mode /= POSITION else '0';
        take_over  <= '1' when mode_0 >= SPEED and (mode_0 /= mode or (mode_0 = POSITION and fresh = '1')) else '0';
        follows    <= '1' when mode_0 = VOLTAGE or mode = VOLTAGE else '0';
      end if;

      if rst = '1' then
        out_valid <= '0';
        mode      <= TORQUE;
        fresh     <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
