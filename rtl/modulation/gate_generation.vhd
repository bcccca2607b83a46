-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: up-down carrier, six gate signals with dead time, enable and latched trip.
-- The carrier counts 0 .. CARRIER_HALF-1 and back, each value once per direction.  A leg is commanded high while
-- carrier >= CARRIER_HALF - compare.  Compare values are updated at the valley, when the carrier is 0 again, with
-- double_update at the peak too; dead time and minimum pulse at the valley only.  sample marks the middle of the zero
-- vector at the gates wherever compare values are updated.  double_update is taken while the gates are off.
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
    double_update   : in  std_logic;             -- 1: sample and update at the peak too
    gate_high       : out unsigned(2 downto 0);  -- bit 0 is leg a
    gate_low        : out unsigned(2 downto 0);
    sample          : out std_logic;
    running         : out std_logic;
    tripped         : out std_logic;
    setting_refused : out std_logic;
    min_pulse_used  : out unsigned(11 downto 0);
    double_used     : out std_logic;
    carrier         : out unsigned(15 downto 0)
  );
end entity gate_generation;

architecture rtl of gate_generation is
  constant SETTLED : unsigned(11 downto 0) := (others => '1');  -- elapsed of a gate that is on

  type compare_t is array (0 to 2) of unsigned(15 downto 0);
  type elapsed_t is array (0 to 2) of unsigned(11 downto 0);

  type state_t is record
    carrier       : unsigned(15 downto 0);
    down          : std_logic;
    compare       : compare_t;
    dead_time     : unsigned(11 downto 0);
    min_pulse     : unsigned(11 downto 0);
    double_update : std_logic;
    configured    : std_logic;
    running       : std_logic;
    tripped       : std_logic;
    level         : unsigned(2 downto 0);  -- command of the leg
    elapsed       : elapsed_t;             -- clocks that both gates of the leg have been off
  end record state_t;

  signal state : state_t;

  signal valley     : std_logic;  -- last clock of the down-count
  signal peak       : std_logic;  -- last clock of the up-count
  signal update     : std_logic;  -- new compare values with the next clock
  signal good       : std_logic;
  signal configured : std_logic;
  signal tripped_0  : std_logic;
  signal on_0       : std_logic;
  signal wanted     : unsigned(2 downto 0);
begin
  valley     <= state.down when state.carrier = 0 else '0';
  peak       <= not state.down when state.carrier = CARRIER_HALF - 1 else '0';
  update     <= valley or (peak and state.double_update);
  configured <= state.configured or good;
  tripped_0  <= trip or (state.tripped and not clear_trip);
  on_0       <= state.running and enable and not trip;

  -- min_pulse is resized, because GHDL 5 truncates an integer to the width of the other operand.
  good <= '1' when dead_time > 0 and dead_time < min_pulse and resize(min_pulse, 16) <= CARRIER_HALF else '0';

  legs : for k in 0 to 2 generate
    wanted(k) <= '1' when resize(state.carrier, 17) + state.compare(k) >= CARRIER_HALF else '0';
  end generate;

  process (clk)
  begin
    if rising_edge(clk) then
      -- Carrier: up, the top value twice, down, zero twice
      if peak = '1' then
        state.down <= '1';
      elsif valley = '1' then
        state.down <= '0';
      elsif state.down = '1' then
        state.carrier <= state.carrier - 1;
      else
        state.carrier <= state.carrier + 1;
      end if;

      -- The gates are one register behind the carrier, and so is the mark of the zero vector's middle
      sample <= '0';
      if state.carrier = 0 then
        sample <= not state.down;
      elsif state.carrier = CARRIER_HALF - 1 then
        sample <= state.down and state.double_update;
      end if;

      -- At the valley: settings of the next period; compare values there and, with double_update, at the peak
      state.running   <= on_0;
      state.tripped   <= tripped_0;
      setting_refused <= not good;
      if update = '1' then
        state.compare <= (compare_a, compare_b, compare_c);
      end if;
      if state.running = '0' then
        state.double_update <= double_update;
      end if;
      if valley = '1' then
        state.configured <= configured;
        state.running    <= enable and configured and not tripped_0;
        if good = '1' then
          state.dead_time <= dead_time;
          state.min_pulse <= min_pulse;
        end if;
      end if;

      -- Legs: both gates are off during the dead time after a change of the command; a gate that is on stays on if the
      -- dead time is increased.  Undefined before the reset, on_0 turns no gate on in a simulation either
      for k in 0 to 2 loop
        gate_high(k) <= '0';
        gate_low(k)  <= '0';
        if on_0 /= '1' then
          state.level(k)   <= '0';
          state.elapsed(k) <= (others => '0');
        elsif wanted(k) /= state.level(k) then
          state.level(k)   <= wanted(k);
          state.elapsed(k) <= to_unsigned(1, 12);
        elsif state.elapsed(k) < state.dead_time then
          state.elapsed(k) <= state.elapsed(k) + 1;
        else
          state.elapsed(k) <= SETTLED;
          gate_high(k)     <= state.level(k);
          gate_low(k)      <= not state.level(k);
        end if;
      end loop;

      if rst = '1' then
        state.carrier       <= (others => '0');
        state.down          <= '0';
        state.compare       <= (others => (others => '0'));
        state.dead_time     <= (others => '0');
        state.min_pulse     <= (others => '0');
        state.double_update <= '0';
        state.configured    <= '0';
        state.running       <= '0';
        state.tripped       <= '0';
        state.level         <= (others => '0');
        state.elapsed       <= (others => (others => '0'));
        gate_high           <= (others => '0');
        gate_low            <= (others => '0');
        sample              <= '0';
        setting_refused     <= '0';
      end if;
    end if;
  end process;

  running        <= state.running;
  tripped        <= state.tripped;
  min_pulse_used <= state.min_pulse;
  double_used    <= state.double_update;
  carrier        <= state.carrier;

end architecture rtl;
