-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the voltage of each leg, summed over the clocks of a step, from the gates of every clock.
--   leg = sum of high, low or off from one tick to the next; the voltages are taken at tick and hold for its step
-- Formats: voltages S(1,22), sums S(6,22), exact; modulo, but the sum of 31 clocks fits.
-- Latency: 1 for each clock; a leg's sum is there two clocks after tick and stays for a step.
-- Rounding: none.
-- shoot_through: both gates of a leg were on in one clock; that clock counts as high.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity motor_inverter is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    tick          : in  std_logic;
    gate_high     : in  unsigned(2 downto 0);
    gate_low      : in  unsigned(2 downto 0);
    high_a        : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    low_a         : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    off_a         : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    high_b        : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    low_b         : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    off_b         : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    high_c        : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    low_c         : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    off_c         : in  signed(MOTOR_VOLTAGE_W - 1 downto 0);
    clear_faults  : in  std_logic;
    leg_a         : out signed(MOTOR_LEG_W - 1 downto 0);
    leg_b         : out signed(MOTOR_LEG_W - 1 downto 0);
    leg_c         : out signed(MOTOR_LEG_W - 1 downto 0);
    shoot_through : out std_logic
  );
end entity motor_inverter;

architecture rtl of motor_inverter is
  constant LEGS : positive := 3;

  type voltages_t is array (0 to LEGS - 1) of signed(MOTOR_VOLTAGE_W - 1 downto 0);
  type sums_t is array (0 to LEGS - 1) of signed(MOTOR_LEG_W - 1 downto 0);

  -- State
  signal tick_1      : std_logic;
  signal gate_high_1 : unsigned(LEGS - 1 downto 0);
  signal gate_low_1  : unsigned(LEGS - 1 downto 0);
  signal high        : voltages_t;
  signal low         : voltages_t;
  signal off         : voltages_t;
  signal sum         : sums_t;
  signal leg         : sums_t;
  signal both        : std_logic;
begin

  process (clk)
    variable u    : signed(MOTOR_VOLTAGE_W - 1 downto 0);
    variable base : signed(MOTOR_LEG_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      tick_1      <= tick;
      gate_high_1 <= gate_high;
      gate_low_1  <= gate_low;
      if tick = '1' then
        high <= (high_a, high_b, high_c);
        low  <= (low_a, low_b, low_c);
        off  <= (off_a, off_b, off_c);
      end if;

      -- sum: begins anew with the clock that tick marked
      for k in 0 to LEGS - 1 loop
        u := off(k);
        if gate_high_1(k) = '1' then
          u := high(k);
        elsif gate_low_1(k) = '1' then
          u := low(k);
        end if;
        base := sum(k);
        if tick_1 = '1' then
          base   := (others => '0');
          leg(k) <= sum(k);
        end if;
        sum(k) <= base + u;
      end loop;

      both <= (or (gate_high_1 and gate_low_1)) or (both and not clear_faults);

      if rst = '1' then
        tick_1      <= '0';
        gate_high_1 <= (others => '0');
        gate_low_1  <= (others => '0');
        high        <= (others => (others => '0'));
        low         <= (others => (others => '0'));
        off         <= (others => (others => '0'));
        sum         <= (others => (others => '0'));
        leg         <= (others => (others => '0'));
        both        <= '0';
      end if;
    end if;
  end process;

  leg_a         <= leg(0);
  leg_b         <= leg(1);
  leg_c         <= leg(2);
  shoot_through <= both;

end architecture rtl;
