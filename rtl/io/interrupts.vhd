-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the interrupt: causes that software clears, and a mask.
--   cause 0  a trip is latched (tripped)
--         1  a fault appeared in fault_flags, whether it trips or not
--         2  dead_time and min_pulse contradict each other (setting_refused)
--         3  the gates were on and are off
--         4  the motor is not the one described (motor_differs)
--   irq = a cause that irq_mask does not mask
-- A cause stays until irq_clear has a one in its bit; what is still present (0, 2, 4) sets it again at once.
-- Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity interrupts is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    tripped         : in  std_logic;
    fault_flags     : in  unsigned(15 downto 0);
    setting_refused : in  std_logic;
    running         : in  std_logic;
    motor_differs   : in  std_logic;
    irq_mask        : in  unsigned(4 downto 0);
    irq_clear       : in  unsigned(4 downto 0);
    irq_cause       : out unsigned(4 downto 0);
    irq             : out std_logic
  );
end entity interrupts;

architecture rtl of interrupts is
  -- State
  signal causes : unsigned(4 downto 0);
  signal flags  : unsigned(15 downto 0);
  signal was_on : std_logic;

  signal now_0    : unsigned(4 downto 0);
  signal causes_0 : unsigned(4 downto 0);
begin
  now_0    <= motor_differs & (was_on and not running) & setting_refused & (or (fault_flags and not flags)) & tripped;
  causes_0 <= (causes and not irq_clear) or now_0;

  process (clk)
  begin
    if rising_edge(clk) then
      causes <= causes_0;
      flags  <= fault_flags;
      was_on <= running;
      irq    <= or (causes_0 and not irq_mask);

      if rst = '1' then
        causes <= (others => '0');
        flags  <= (others => '0');
        was_on <= '0';
        irq    <= '0';
      end if;
    end if;
  end process;

  irq_cause <= causes;

end architecture rtl;
