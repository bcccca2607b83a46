-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: one asynchronous pin: synchroniser, then a filter that accepts a level only after it has stayed for a while.
-- Two registers (ASYNC_REG) synchronise the pin to clk.  A level other than the output's is accepted when it has been
-- there for filter_clocks + 1 clocks without a break: a pulse of filter_clocks clocks or fewer has no effect.
-- After a reset the output follows the synchroniser until it has been still for that time, then settled is 1: the first
-- level of a pin is not an edge.
-- Formats: clocks.  Latency: 1 (every clock is a sample); pin to level filter_clocks + 3.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity input_filter is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    pin           : in  std_logic;  -- asynchronous
    filter_clocks : in  unsigned(9 downto 0);
    level         : out std_logic;
    settled       : out std_logic
  );
end entity input_filter;

architecture rtl of input_filter is
  attribute async_reg : string;

  signal sync_1 : std_logic;
  signal sync_2 : std_logic;

  attribute async_reg of sync_1 : signal is "TRUE";
  attribute async_reg of sync_2 : signal is "TRUE";

  type state_t is record
    fill    : unsigned(1 downto 0);  -- clocks until the synchroniser holds the pin's level
    level   : std_logic;
    elapsed : unsigned(9 downto 0);  -- clocks that the level has differed; before settled: has been the same
    settled : std_logic;
  end record state_t;

  signal state : state_t;

  signal filled   : std_logic;
  signal differs  : std_logic;
  signal counting : std_logic;
  signal accept   : std_logic;
begin
  filled   <= state.fill(1);
  differs  <= sync_2 xor state.level;
  counting <= filled and (differs xnor state.settled);
  accept   <= counting when state.elapsed >= filter_clocks else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      sync_1 <= pin;
      sync_2 <= sync_1;

      if filled = '0' then
        state.fill <= state.fill + 1;
      end if;
      if (accept or not state.settled) = '1' then
        state.level <= sync_2;
      end if;
      state.elapsed <= (others => '0');
      if (counting and not accept) = '1' then
        state.elapsed <= state.elapsed + 1;
      end if;
      state.settled <= state.settled or accept;

      if rst = '1' then
        sync_1        <= '0';
        sync_2        <= '0';
        state.fill    <= (others => '0');
        state.level   <= '0';
        state.elapsed <= (others => '0');
        state.settled <= '0';
      end if;
    end if;
  end process;

  level   <= state.level;
  settled <= state.settled;

end architecture rtl;
