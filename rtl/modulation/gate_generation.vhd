-- Purpose: up-down carrier, six gate signals with dead time, enable and latched trip.
-- The carrier counts 0 .. CARRIER_HALF-1 and back, each value once per direction.  A leg is commanded high while
-- carrier >= CARRIER_HALF - compare.  Compare values, dead time and minimum pulse are updated at the valley only,
-- when the carrier is 0 again; sample marks the middle of the zero vector at the gates.
-- Dead time: when the command of a leg changes, both gates go off, the other one on dead_time clocks later; a new
-- setting also applies to a dead time that has begun.
-- A dead time of zero or not below min_pulse, or a min_pulse above half a period, is refused: the last valid
-- setting is kept; before the first valid one the gates stay off.
-- enable switches on at the valley, off at once; trip switches off at once and is latched until clear_trip.
-- Formats: clocks.  Latency: 1 (every clock is a sample; trip or enable to gates off in one clock).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity gate_generation is
  generic (
    CARRIER_HALF : positive range 8 to 32767 := 10000
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    compare_a       : in  unsigned(15 downto 0);
    compare_b       : in  unsigned(15 downto 0);
    compare_c       : in  unsigned(15 downto 0);
    enable          : in  std_logic;
    trip            : in  std_logic;
    clear_trip      : in  std_logic;
    dead_time       : in  unsigned(11 downto 0);
    min_pulse       : in  unsigned(11 downto 0);
    gate_high       : out unsigned(2 downto 0);  -- bit 0 is leg a
    gate_low        : out unsigned(2 downto 0);
    sample          : out std_logic;
    running         : out std_logic;
    tripped         : out std_logic;
    setting_refused : out std_logic;
    min_pulse_used  : out unsigned(11 downto 0);
    carrier         : out unsigned(15 downto 0)
  );
end entity gate_generation;

architecture rtl of gate_generation is
  type compare_t is array (0 to 2) of unsigned(15 downto 0);
  type since_t is array (0 to 2) of unsigned(11 downto 0);
  type lead_t is array (0 to 2) of signed(16 downto 0);
  type missing_t is array (0 to 2) of signed(17 downto 0);

  constant TO_COUNT : signed(15 downto 0) := to_signed(CARRIER_HALF, 16);

  -- State.  The carrier's position and the state of a running dead time are computed one clock ahead and registered,
  -- which keeps the logic between two registers short
  signal below       : signed(15 downto 0);  -- carrier - CARRIER_HALF, never above -1
  signal down        : std_logic;
  signal top         : std_logic;  -- last clock of the up-count
  signal valley      : std_logic;  -- last clock of the down-count
  signal middle      : std_logic;  -- first clock of the up-count
  signal compare     : compare_t;
  signal dead_used   : unsigned(11 downto 0);
  signal dead_is_one : std_logic;
  signal pulse_used  : unsigned(11 downto 0);
  signal configured  : std_logic;
  signal running_now : std_logic;
  signal tripped_now : std_logic;
  signal level       : unsigned(2 downto 0);
  signal was_off     : std_logic;
  signal changed     : unsigned(2 downto 0);  -- the leg's command changed in the previous clock
  signal same        : unsigned(2 downto 0);  -- the leg was enabled and its command did not change
  signal since       : since_t;  -- clocks since the change, counted from 2 while both gates are off

  signal count    : unsigned(15 downto 0);
  signal nothing  : signed(12 downto 0);
  signal shorter  : signed(12 downto 0);
  signal good     : std_logic;
  signal on_now   : std_logic;
  signal tripping : std_logic;
  signal lead     : lead_t;  -- carrier minus the switching edge of the leg; >= 0: high
  signal missing  : missing_t;  -- clocks since the change minus dead time; < 0: not over yet
  signal wanted   : unsigned(2 downto 0);
  signal over     : unsigned(2 downto 0);
begin
  -- min_pulse in good is resized, because GHDL 5 truncates an integer to the width of the other operand.
  count    <= unsigned(below + TO_COUNT);
  shorter  <= signed('0' & dead_time) - signed('0' & min_pulse);
  nothing  <= signed('0' & dead_time) - 1;
  good     <= '1' when nothing(12) = '0' and shorter(12) = '1' and resize(min_pulse, 16) <= CARRIER_HALF else '0';
  on_now   <= running_now and enable and not trip;
  tripping <= trip or (tripped_now and not clear_trip);

  legs : for k in 0 to 2 generate
    lead(k)    <= below + signed('0' & compare(k));
    wanted(k)  <= not lead(k)(16);
    missing(k) <= signed(resize(since(k), 18)) - signed(resize(dead_used, 18));
    over(k)    <= gate_high(k) or gate_low(k) or (changed(k) and dead_is_one) or (same(k) and not missing(k)(17));
  end generate;

  process (clk)
  begin
    if rising_edge(clk) then
      -- Carrier: up, the top value twice, down, zero twice
      top    <= '1' when down = '0' and below = -2 else '0';
      valley <= '1' when down = '1' and below = 1 - CARRIER_HALF else '0';
      middle <= valley;
      if top = '1' then
        down <= '1';
      elsif valley = '1' then
        down <= '0';
      else
        -- +1, or -1 as all ones
        below <= below + (signed'(14 downto 0 => down) & '1');
      end if;

      -- The gates are one register behind the carrier, and so is the mark of the zero vector's middle
      sample <= middle;

      -- At the valley: compare values and settings of the next period
      running_now <= on_now;
      tripped_now <= tripping;
      if valley = '1' then
        compare     <= (compare_a, compare_b, compare_c);
        running_now <= enable and (configured or good) and not tripping;
        if good = '1' then
          dead_used   <= dead_time;
          dead_is_one <= dead_time ?= 1;
          pulse_used  <= min_pulse;
          configured  <= '1';
        end if;
      end if;
      setting_refused <= not good;

      -- Legs: both gates are off during the dead time after a change of the command; a gate that is on stays on if the
      -- dead time is increased
      was_off <= not on_now;
      for k in 0 to 2 loop
        level(k)     <= wanted(k);
        changed(k)   <= wanted(k) xor level(k);
        same(k)      <= wanted(k) xnor level(k);
        gate_high(k) <= over(k) and wanted(k) and level(k);
        gate_low(k)  <= over(k) and not (wanted(k) or level(k));
        if on_now = '0' then
          level(k)     <= '0';
          changed(k)   <= '0';
          same(k)      <= '0';
          gate_high(k) <= '0';
          gate_low(k)  <= '0';
        end if;
        if changed(k) = '1' then
          since(k) <= to_unsigned(2, 12);
        elsif was_off = '1' then
          since(k) <= to_unsigned(1, 12);
        elsif (gate_high(k) or gate_low(k)) = '0' then
          since(k) <= since(k) + 1;
        end if;
      end loop;

      if rst = '1' then
        below           <= to_signed(-CARRIER_HALF, 16);
        down            <= '0';
        top             <= '0';
        valley          <= '0';
        middle          <= '1';
        compare         <= (others => (others => '0'));
        dead_used       <= (others => '0');
        dead_is_one     <= '0';
        pulse_used      <= (others => '0');
        configured      <= '0';
        running_now     <= '0';
        tripped_now     <= '0';
        level           <= (others => '0');
        was_off         <= '1';
        changed         <= (others => '0');
        same            <= (others => '0');
        gate_high       <= (others => '0');
        gate_low        <= (others => '0');
        sample          <= '0';
        setting_refused <= '0';
      end if;
    end if;
  end process;

  running        <= running_now;
  tripped        <= tripped_now;
  min_pulse_used <= pulse_used;
  carrier        <= count;

end architecture rtl;
