-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: master for an absolute encoder with SSI: clock burst, Gray or binary word, parity, position code.
-- start begins a frame: the first falling edge of serial_clock latches the position in the encoder, each rising edge
-- puts out a bit, the highest first, and the next rising edge takes it.  The word has word_bits bits; its lowest
-- turn_bits are the place within a turn and become the code, left-aligned or cut; gray = 1 decodes the whole word.
-- parity_on = 1 expects one more bit, which makes the ones even.  The line must be 1 before a frame and 0 for a period
-- after the last bit, else frame_error comes instead of code_valid; so it does for a wrong parity and for a turn_bits
-- of 0 or above word_bits.  A start during a frame is ignored.  Half a period of the serial clock takes half_period + 1
-- clocks.
-- Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: bits below the code are cut.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity ssi_master is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    serial_data  : in  std_logic;  -- asynchronous
    start        : in  std_logic;
    half_period  : in  unsigned(9 downto 0);
    word_bits    : in  unsigned(5 downto 0);
    turn_bits    : in  unsigned(5 downto 0);
    gray         : in  std_logic;
    parity_on    : in  std_logic;
    serial_clock : out std_logic;
    code_theta   : out unsigned(POSITION_BITS - 1 downto 0);
    code_valid   : out std_logic;
    frame_error  : out std_logic;
    busy         : out std_logic
  );
end entity ssi_master;

architecture rtl of ssi_master is
  attribute async_reg : string;

  constant TOP_BIT : unsigned(POSITION_BITS - 1 downto 0) := '1' & (POSITION_BITS - 2 downto 0 => '0');

  signal sync_1 : std_logic;
  signal sync_2 : std_logic;

  attribute async_reg of sync_1 : signal is "TRUE";
  attribute async_reg of sync_2 : signal is "TRUE";

  type state_t is record
    busy         : std_logic;
    serial_clock : std_logic;
    wait_clocks  : unsigned(9 downto 0);  -- to the end of this half period
    slot         : unsigned(6 downto 0);  -- bits put out
    stop         : unsigned(1 downto 0);  -- half periods since the last rising edge, plus 1
    bit_0        : std_logic;             -- the last one, decoded
    odd          : std_logic;             -- 1: an odd number of ones so far
    mark         : unsigned(POSITION_BITS - 1 downto 0);  -- bit of the code that comes next
    work         : unsigned(POSITION_BITS - 1 downto 0);
  end record state_t;

  signal state : state_t;

  signal good    : std_logic;
  signal length  : unsigned(6 downto 0);
  signal in_turn : std_logic;
  signal bit_now : std_logic;
  signal right   : std_logic;
begin
  good    <= '1' when turn_bits /= 0 and turn_bits <= word_bits else '0';
  length  <= resize(word_bits, 7) + unsigned'(0 => parity_on);
  in_turn <= '1' when state.slot <= word_bits and state.slot + turn_bits > word_bits else '0';
  bit_now <= sync_2 xor (state.bit_0 and gray);
  right   <= not sync_2 and not (parity_on and state.odd);

  process (clk)
  begin
    if rising_edge(clk) then
      sync_1      <= serial_data;
      sync_2      <= sync_1;
      code_valid  <= '0';
      frame_error <= '0';

      if state.busy = '0' then
        state.wait_clocks <= half_period;
        state.slot        <= (others => '0');
        state.stop        <= (others => '0');
        state.bit_0       <= '0';
        state.odd         <= '0';
        state.mark        <= TOP_BIT;
        state.work        <= (others => '0');
        if start = '1' then
          state.busy         <= good and sync_2;
          state.serial_clock <= not (good and sync_2);
          frame_error        <= not (good and sync_2);
        end if;
      elsif state.wait_clocks /= 0 then
        state.wait_clocks <= state.wait_clocks - 1;
      else
        state.wait_clocks <= half_period;
        if state.serial_clock = '0' then
          -- A rising edge takes the bit of the one before
          state.serial_clock <= '1';
          state.slot         <= state.slot + 1;
          if state.slot >= length then
            state.stop <= "01";
          end if;
          if state.slot /= 0 then
            state.odd   <= state.odd xor sync_2;
            state.bit_0 <= bit_now;
            if in_turn = '1' then
              state.work <= state.work or (state.mark and (state.mark'range => bit_now));
              state.mark <= shift_right(state.mark, 1);
            end if;
          end if;
        elsif state.stop = 0 then
          state.serial_clock <= '0';
        elsif state.stop = 1 then
          state.stop <= "10";
        else
          -- The line is low after the last bit
          state.busy  <= '0';
          code_valid  <= right;
          frame_error <= not right;
          if right = '1' then
            code_theta <= state.work;
          end if;
        end if;
      end if;

      if rst = '1' then
        sync_1             <= '0';
        sync_2             <= '0';
        state.busy         <= '0';
        state.serial_clock <= '1';
        code_theta         <= (others => '0');
        code_valid         <= '0';
        frame_error        <= '0';
      end if;
    end if;
  end process;

  serial_clock <= state.serial_clock;
  busy         <= state.busy;

end architecture rtl;
