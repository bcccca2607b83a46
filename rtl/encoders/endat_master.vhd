-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: master for an absolute encoder with EnDat 2.1 or 2.2: mode command, start bit, errors, word, CRC, code.
-- start begins a frame: serial_clock falls and the encoder latches its position.  For two periods and the six of
-- mode_command (highest bit first, it changes with the falling edge) this side drives the line, then it lets go.  From
-- a period later on the line must be low and then rise: the start bit.  Bits are taken in their middle, counted from
-- that: error 1 (1 when active), with two_errors error 2 (0 when active), the word with the lowest bit first and five
-- bits of CRC, x^5 + x^3 + x + 1 from all ones over errors and word, inverted.  The lowest turn_bits of the word_bits
-- are the place within a turn and become the code, left-aligned or cut.  frame_error comes instead of code_valid if the
-- start bit is wrong or has not come after start_max clocks, if the CRC is wrong, if the encoder says error, or if
-- turn_bits is 0 or above word_bits.
-- Half a period takes half_period + 1 clocks.  Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: cut.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity endat_master is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    serial_data  : in  std_logic;  -- asynchronous
    start        : in  std_logic;
    half_period  : in  unsigned(9 downto 0);
    mode_command : in  unsigned(5 downto 0);
    two_errors   : in  std_logic;
    word_bits    : in  unsigned(5 downto 0);
    turn_bits    : in  unsigned(5 downto 0);
    crc_on       : in  std_logic;
    start_max    : in  unsigned(15 downto 0);
    serial_clock : out std_logic;
    data_out     : out std_logic;
    data_drive   : out std_logic;
    code_theta   : out unsigned(POSITION_BITS - 1 downto 0);
    code_valid   : out std_logic;
    frame_error  : out std_logic;
    alarm        : out std_logic;
    busy         : out std_logic
  );
end entity endat_master;

architecture rtl of endat_master is
  attribute async_reg : string;

  signal sync_1 : std_logic;
  signal sync_2 : std_logic;

  attribute async_reg of sync_1 : signal is "TRUE";
  attribute async_reg of sync_2 : signal is "TRUE";

  type mode_t is (idle, command, released, beginning, take, stop);

  type state_t is record
    mode         : mode_t;
    serial_clock : std_logic;
    wait_clocks  : unsigned(9 downto 0);   -- to the end of this half period
    period       : unsigned(3 downto 0);   -- of the command
    command      : unsigned(5 downto 0);   -- bits still to be sent
    age          : unsigned(16 downto 0);  -- clocks since the line was let go for a period
    gap          : unsigned(10 downto 0);  -- clocks to the middle of the next bit
    slot         : unsigned(6 downto 0);   -- the bit that comes next, 0 is the start bit
    fault        : std_logic;              -- the start bit was wrong
    error        : std_logic;              -- the encoder says error
    crc          : unsigned(4 downto 0);
    work         : unsigned(POSITION_BITS - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal good     : std_logic;
  signal period   : unsigned(3 downto 0);
  signal first    : unsigned(6 downto 0);  -- slot of the last error bit
  signal word_end : unsigned(6 downto 0);  -- slot of the last bit of the word
  signal feed     : std_logic;
  signal crc_next : unsigned(4 downto 0);
  signal right    : std_logic;
begin
  good     <= '1' when turn_bits /= 0 and turn_bits <= word_bits else '0';
  period   <= state.period + 1;
  first    <= "00000" & two_errors & not two_errors;
  word_end <= first + word_bits;
  feed     <= state.crc(4) xor sync_2 when state.slot <= word_end else state.crc(4) xnor sync_2;
  crc_next <= (state.crc(3 downto 0) & '0') xor ('0' & feed & '0' & feed & feed);
  right    <= not state.fault when crc_next = 0 or crc_on = '0' else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      sync_1      <= serial_data;
      sync_2      <= sync_1;
      code_valid  <= '0';
      frame_error <= '0';

      -- The serial clock; it ends high after a whole half period
      state.wait_clocks <= half_period;
      if state.mode /= idle then
        if state.wait_clocks /= 0 then
          state.wait_clocks <= state.wait_clocks - 1;
        elsif state.mode /= stop then
          state.serial_clock <= not state.serial_clock;
        else
          state.serial_clock <= '1';
          if state.serial_clock = '1' then
            state.mode <= idle;
          end if;
        end if;
      end if;

      if state.mode = idle then
        state.period  <= (others => '0');
        state.command <= mode_command;
        state.age     <= (others => '0');
        state.slot    <= (others => '0');
        state.fault   <= '0';
        state.error   <= '0';
        state.crc     <= (others => '1');
        state.work    <= (others => '0');
        if (start and good) = '1' then
          state.mode         <= command;
          state.serial_clock <= '0';
          data_drive         <= '1';
        end if;
        frame_error <= start and not good;
      elsif state.mode = command then
        if state.wait_clocks = 0 and state.serial_clock = '1' then
          state.period <= period;
          if period >= ENDAT_MASTER_FIRST and period < ENDAT_MASTER_LET_GO then
            data_out      <= state.command(5);
            state.command <= shift_left(state.command, 1);
          elsif period = ENDAT_MASTER_LET_GO then
            data_out   <= '0';
            data_drive <= '0';
          elsif period = ENDAT_MASTER_LISTEN then
            state.mode <= released;
          end if;
        end if;
      elsif state.mode = released or state.mode = beginning then
        state.age <= state.age + 1;
        state.gap <= resize(half_period, 11);
        if state.age >= start_max then
          state.mode  <= stop;
          frame_error <= '1';
        elsif state.mode = released and sync_2 = '0' then
          state.mode <= beginning;
        elsif state.mode = beginning and sync_2 = '1' then
          state.mode <= take;
        end if;
      elsif state.mode = take then
        state.gap <= state.gap - 1;
        if state.gap = 0 then
          state.gap  <= half_period & '1';
          state.slot <= state.slot + 1;
          if state.slot = 0 then
            state.fault <= not sync_2;
          else
            state.crc <= crc_next;
          end if;
          if state.slot = 1 then
            state.error <= sync_2;
          elsif state.slot = first then
            state.error <= state.error or not sync_2;
          end if;
          if state.slot > first and state.slot <= first + turn_bits then
            state.work <= sync_2 & state.work(POSITION_BITS - 1 downto 1);
          end if;
          if state.slot >= word_end + 5 then
            state.mode  <= stop;
            code_valid  <= right and not state.error;
            frame_error <= not right or state.error;
            if right = '1' then
              alarm <= state.error;
            end if;
            if (right and not state.error) = '1' then
              code_theta <= state.work;
            end if;
          end if;
        end if;
      end if;

      if rst = '1' then
        sync_1             <= '0';
        sync_2             <= '0';
        state.mode         <= idle;
        state.serial_clock <= '1';
        data_out           <= '0';
        data_drive         <= '0';
        code_theta         <= (others => '0');
        code_valid         <= '0';
        frame_error        <= '0';
        alarm              <= '0';
      end if;
    end if;
  end process;

  serial_clock <= state.serial_clock;
  busy         <= '0' when state.mode = idle else '1';

end architecture rtl;
