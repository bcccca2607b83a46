-- Purpose: up-down carrier, six gate signals with dead time, enable and latched trip.
-- The carrier counts 0 .. CARRIER_HALF-1 and back, each value once a direction.  A leg wants to be high while
-- carrier >= CARRIER_HALF - compare.  Compare values, dead time and minimum pulse are taken over at the valley
-- only, when carrier is 0 again; sample marks the middle of the zero vector as the gates show it.
-- Dead time: a leg that changes its mind turns both gates off, the other one on dead_time clocks later; a new
-- setting counts for a dead time that has begun.
-- A dead time that is zero or not below min_pulse, or a min_pulse above half a period, is refused: the last good
-- setting stays, and before the first good one the gates stay off.
-- enable switches on at the valley and off at once; trip switches off at once and is remembered until clear_trip.
-- Latency: 1 (every clock is a sample; trip or enable to gates off in one clock).

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
  type elapsed_t is array (0 to 2) of unsigned(11 downto 0);
  type lead_t is array (0 to 2) of signed(17 downto 0);

  -- State
  signal below       : signed(15 downto 0);  -- the carrier less CARRIER_HALF, never above -1
  signal down        : std_logic;
  signal compare     : compare_t;
  signal dead_used   : unsigned(11 downto 0);
  signal pulse_used  : unsigned(11 downto 0);
  signal configured  : std_logic;
  signal running_now : std_logic;
  signal tripped_now : std_logic;
  signal level       : unsigned(2 downto 0);
  signal elapsed     : elapsed_t;
  signal settled     : unsigned(2 downto 0);

  signal count    : unsigned(15 downto 0);
  signal bottom   : std_logic;
  signal valley   : std_logic;
  signal good     : std_logic;
  signal on_now   : std_logic;
  signal tripping : std_logic;
  signal lead     : lead_t;  -- by how much the carrier has passed the leg's edge
  signal wanted   : unsigned(2 downto 0);
begin
  -- In good: GHDL 5 cuts a number down to the width it is compared with, so the pulse gets the number's width.
  count    <= unsigned(below + CARRIER_HALF);
  bottom   <= '1' when below = -CARRIER_HALF else '0';
  valley   <= bottom and down;
  good     <= '1' when dead_time > 0 and dead_time < min_pulse and resize(min_pulse, 16) <= CARRIER_HALF else '0';
  on_now   <= running_now and enable and not trip;
  tripping <= trip or (tripped_now and not clear_trip);

  legs : for k in 0 to 2 generate
    lead(k)   <= resize(below, 18) + signed(resize(compare(k), 18));
    wanted(k) <= not lead(k)(17);
  end generate;

  process (clk)
  begin
    if rising_edge(clk) then
      -- Carrier: up, twice the top value, down, twice zero
      if down = '0' and below = -1 then
        down <= '1';
      elsif valley = '1' then
        down <= '0';
      else
        -- One up or, all ones, one down
        below <= below + (signed'(14 downto 0 => down) & '1');
      end if;

      -- The gates leave one register behind the carrier, and so does the mark of the zero vector's middle
      sample <= bottom and not down;

      -- At the valley: what the next period works with
      running_now <= on_now;
      tripped_now <= tripping;
      if valley = '1' then
        compare     <= (compare_a, compare_b, compare_c);
        running_now <= enable and (configured or good) and not tripping;
        if good = '1' then
          dead_used  <= dead_time;
          pulse_used <= min_pulse;
          configured <= '1';
        end if;
      end if;
      setting_refused <= not good;

      -- Legs: both gates off from the change of mind for the dead time; a gate that is on stays on when the dead
      -- time grows, hence settled
      for k in 0 to 2 loop
        gate_high(k) <= '0';
        gate_low(k)  <= '0';
        if on_now = '0' then
          level(k)   <= '0';
          settled(k) <= '0';
          elapsed(k) <= (others => '0');
        elsif wanted(k) /= level(k) then
          level(k)   <= wanted(k);
          settled(k) <= '0';
          elapsed(k) <= to_unsigned(1, 12);
        elsif settled(k) = '0' and elapsed(k) < dead_used then
          elapsed(k) <= elapsed(k) + 1;
        else
          settled(k)   <= '1';
          gate_high(k) <= level(k);
          gate_low(k)  <= not level(k);
        end if;
      end loop;

      if rst = '1' then
        below           <= to_signed(-CARRIER_HALF, 16);
        down            <= '0';
        compare         <= (others => (others => '0'));
        dead_used       <= (others => '0');
        pulse_used      <= (others => '0');
        configured      <= '0';
        running_now     <= '0';
        tripped_now     <= '0';
        level           <= (others => '0');
        elapsed         <= (others => (others => '0'));
        settled         <= (others => '0');
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
