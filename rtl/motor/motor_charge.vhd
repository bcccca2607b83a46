-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the charge that the legs take from the bus, summed over the clocks of a step, from the gates of every clock.
--   charge = sum of i_x from one tick to the next over the legs whose upper device conducts: the upper gate is on, or
--            both are off and i_x < 0 flows through the upper diode
-- Formats: currents S(1,16), charge S(8,16), exact; modulo, but the sum of 31 clocks fits.
-- Latency: 1 for each clock; the charge is there two clocks after tick and stays for a step.
-- Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity motor_charge is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    tick      : in  std_logic;
    gate_high : in  unsigned(2 downto 0);
    gate_low  : in  unsigned(2 downto 0);
    i_a       : in  signed(PU_W - 1 downto 0);
    i_b       : in  signed(PU_W - 1 downto 0);
    i_c       : in  signed(PU_W - 1 downto 0);
    charge    : out signed(MOTOR_CHARGE_W - 1 downto 0)
  );
end entity motor_charge;

architecture rtl of motor_charge is
  constant LEGS : positive := 3;

  type currents_t is array (0 to LEGS - 1) of signed(PU_W - 1 downto 0);

  -- State
  signal tick_1      : std_logic;
  signal gate_high_1 : unsigned(LEGS - 1 downto 0);
  signal gate_low_1  : unsigned(LEGS - 1 downto 0);
  signal i_1         : currents_t;
  signal sum_2       : signed(MOTOR_CHARGE_W - 1 downto 0);
begin

  process (clk)
    variable now : signed(MOTOR_CHARGE_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      -- Stage 1: gates of every clock, currents of the step
      tick_1      <= tick;
      gate_high_1 <= gate_high;
      gate_low_1  <= gate_low;
      if tick = '1' then
        i_1 <= (i_a, i_b, i_c);
      end if;

      -- Stage 2: the sum, which begins anew with the clock that tick marked
      now := (others => '0');
      for k in 0 to LEGS - 1 loop
        if gate_high_1(k) = '1' or (gate_low_1(k) = '0' and i_1(k)(PU_W - 1) = '1') then
          now := now + i_1(k);
        end if;
      end loop;
      sum_2 <= sum_2 + now;
      if tick_1 = '1' then
        sum_2  <= now;
        charge <= sum_2;
      end if;

      if rst = '1' then
        tick_1      <= '0';
        gate_high_1 <= (others => '0');
        gate_low_1  <= (others => '0');
        i_1         <= (others => (others => '0'));
        sum_2       <= (others => '0');
        charge      <= (others => '0');
      end if;
    end if;
  end process;

end architecture rtl;
