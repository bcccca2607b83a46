-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the power stage's side of the AXI top: the trip pin enters here, the six gates leave through registers.
-- trip_pin may change at any time; a pulse as short as a flip-flop can detect is enough.  It sets caught without a
-- clock, and caught clears the gate registers without a clock: the gates go off even if clk has stopped.  Two registers
-- (ASYNC_REG) synchronise it to clk as trip.  When trip has reached the core and the pin is low, caught is cleared: on
-- an edge of clk, when the core's own gates are already off; the core's trip latch keeps them off.
-- This is the only asynchronous set or clear; scripts/vivado/fluxproof.xdc contains its timing exception.
-- Gates and sample_trigger leave together, one register behind gate_generation, so that the registers fit in IO cells.
-- TRIP_FILTER = 0: as above.  Else the pin first passes input_filter, and only a level that has been there for more
-- than TRIP_FILTER clocks is a trip: for a comparator that is disturbed by the switching it watches.  The gates stay on
-- meanwhile, since to blank them at once would answer each disturbance by another edge; and a stopped clk trips no more.
-- The generics say at which level a pin is active.  The gates' registers hold the level of the pin itself: an FPGA starts
-- them with it, so the gates are off from the end of configuration on.  TRIP_ACTIVE = 0 with a pull-down trips where the
-- wire is broken.
-- Latency: gates 1, brake 0; trip_pin to gates off 0, to trip 2; with a filter TRIP_FILTER + 3 and 5.  Formats: bits.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity power_stage is
  generic (
    GATE_ACTIVE  : integer := 1;  -- level of a gate pin at which the switch is on
    TRIP_ACTIVE  : integer := 1;  -- level of the trip pin that turns the gates off
    BRAKE_ACTIVE : integer := 1;  -- level of the brake pin at which the resistor is on
    TRIP_FILTER  : integer := 0  -- longest pulse of the trip pin without effect, clocks; 0: none, every pulse acts
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;  -- synchronous, active high
    trip_pin       : in  std_logic;  -- asynchronous, TRIP_ACTIVE: gates off
    gate_high_next : in  unsigned(2 downto 0);  -- upper gates of gate_generation
    gate_low_next  : in  unsigned(2 downto 0);  -- lower gates of gate_generation
    trigger_next   : in  std_logic;  -- middle of the zero vector
    brake_next     : in  std_logic;  -- 1: brake resistor on
    trip           : out std_logic;  -- the trip, synchronous to clk
    gate_high      : out std_logic_vector(2 downto 0);  -- upper gates, bit 0 is leg a
    gate_low       : out std_logic_vector(2 downto 0);  -- lower gates, bit 0 is leg a
    sample_trigger : out std_logic;  -- middle of the zero vector as the gates show it
    brake          : out std_logic  -- brake resistor on
  );
end entity power_stage;

architecture rtl of power_stage is
  attribute async_reg : string;

  function level(active : integer) return std_logic is
  begin
    if active = 0 then
      return '0';
    end if;
    return '1';
  end function level;

  constant SWITCH_OFF : std_logic := not level(GATE_ACTIVE);

  -- An FPGA initialises a register with a set to 1 and the others to 0: the gates are off before the first clock.
  signal caught  : std_logic;
  signal pin_on  : std_logic;
  signal trip_on : std_logic;
  signal sync_1  : std_logic;
  signal sync_2  : std_logic;

  attribute async_reg of sync_1 : signal is "TRUE";
  attribute async_reg of sync_2 : signal is "TRUE";
begin

  pin_on <= trip_pin xor not level(TRIP_ACTIVE);
  brake  <= brake_next xor not level(BRAKE_ACTIVE);

  direct : if TRIP_FILTER = 0 generate
    trip_on <= pin_on;
  end generate;

  filtered : if TRIP_FILTER > 0 generate
    filter : entity work.input_filter
      port map (
        clk => clk, rst => rst, pin => pin_on, filter_clocks => to_unsigned(TRIP_FILTER, 10), level => trip_on,
        settled => open);
  end generate;

  catching : process (clk, trip_on)
  begin
    if trip_on = '1' then
      caught <= '1';
    elsif rising_edge(clk) then
      if sync_2 = '1' or rst = '1' then
        caught <= '0';
      end if;
    end if;
  end process;

  synchronising : process (clk)
  begin
    if rising_edge(clk) then
      -- Stage 1 and 2: trip = caught
      sync_1 <= caught;
      sync_2 <= sync_1;

      -- Stage 1: out = in
      sample_trigger <= trigger_next;

      if rst = '1' then
        sync_1         <= '0';
        sync_2         <= '0';
        sample_trigger <= '0';
      end if;
    end if;
  end process;

  gates : process (clk, caught)
  begin
    if caught = '1' then
      gate_high <= (others => SWITCH_OFF);
      gate_low  <= (others => SWITCH_OFF);
    elsif rising_edge(clk) then
      -- Stage 1: out = in
      gate_high <= std_logic_vector(gate_high_next) xor (2 downto 0 => SWITCH_OFF);
      gate_low  <= std_logic_vector(gate_low_next) xor (2 downto 0 => SWITCH_OFF);
    end if;
  end process;

  trip <= sync_2;

end architecture rtl;
