-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: master for an absolute encoder with BiSS-C: clock, acknowledge, start bit, word, status, CRC, position code.
-- start begins a frame: serial_clock (MA) runs until the last bit has come.  The encoder answers on SLO: low as the
-- acknowledge, then the start bit 1, CDS 0, the word with the highest bit first, the error and the warning bit (both 0
-- when active) and six bits of CRC, x^6 + x + 1 over word, error and warning, inverted.  The bits are taken in their
-- middle, counted from the rise of the start bit: so the line may be late by any time.  The lowest turn_bits of the
-- word_bits are the place within a turn and become the code, left-aligned or cut.  frame_error comes instead of
-- code_valid if the line is not 1 at the start, if the start bit has not come after start_max clocks, if it or CDS or
-- the CRC is wrong, if the encoder says error, or if turn_bits is 0 or above word_bits.  Half a period of the serial
-- clock takes half_period + 1 clocks.
-- Formats: bits.  Latency: 1 (every clock is a sample).  Rounding: bits below the code are cut.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity biss_master is
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
    crc_on       : in  std_logic;
    start_max    : in  unsigned(15 downto 0);
    serial_clock : out std_logic;
    code_theta   : out unsigned(POSITION_BITS - 1 downto 0);
    code_valid   : out std_logic;
    frame_error  : out std_logic;
    alarm        : out std_logic;
    warning      : out std_logic;
    busy         : out std_logic
  );
end entity biss_master;

architecture rtl of biss_master is
  attribute async_reg : string;

  constant TOP_BIT : unsigned(POSITION_BITS - 1 downto 0) := '1' & (POSITION_BITS - 2 downto 0 => '0');

  signal sync_1 : std_logic;
  signal sync_2 : std_logic;

  attribute async_reg of sync_1 : signal is "TRUE";
  attribute async_reg of sync_2 : signal is "TRUE";

  type mode_t is (idle, acknowledge, beginning, take, stop);

  type state_t is record
    mode         : mode_t;
    serial_clock : std_logic;
    wait_clocks  : unsigned(9 downto 0);   -- to the end of this half period
    age          : unsigned(16 downto 0);  -- clocks since the frame began
    gap          : unsigned(10 downto 0);  -- clocks to the middle of the next bit
    slot         : unsigned(6 downto 0);   -- the bit that comes next, 0 is the start bit
    fault        : std_logic;              -- start bit or CDS were wrong
    crc          : unsigned(5 downto 0);
    mark         : unsigned(POSITION_BITS - 1 downto 0);  -- bit of the code that comes next
    work         : unsigned(POSITION_BITS - 1 downto 0);
    status       : unsigned(1 downto 0);   -- error and warning bits
  end record state_t;

  signal state : state_t;

  signal good     : std_logic;
  signal in_word  : std_logic;
  signal in_state : std_logic;
  signal last     : std_logic;
  signal feed     : std_logic;
  signal crc_next : unsigned(5 downto 0);
  signal right    : std_logic;
begin
  good     <= '1' when turn_bits /= 0 and turn_bits <= word_bits else '0';
  in_word  <= '1' when state.slot <= resize(word_bits, 7) + 1 else '0';
  in_state <= '1' when state.slot <= resize(word_bits, 7) + 3 else '0';
  last     <= '1' when state.slot >= resize(word_bits, 7) + 9 else '0';
  feed     <= state.crc(5) xor sync_2 xor not in_state;
  crc_next <= (state.crc(4 downto 0) & '0') xor ("0000" & feed & feed);
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
        state.age    <= (others => '0');
        state.slot   <= (others => '0');
        state.fault  <= '0';
        state.crc    <= (others => '0');
        state.mark   <= TOP_BIT;
        state.work   <= (others => '0');
        state.status <= (others => '0');
        if (start and good and sync_2) = '1' then
          state.mode         <= acknowledge;
          state.serial_clock <= '0';
        end if;
        frame_error <= start and not (good and sync_2);
      elsif state.mode = acknowledge or state.mode = beginning then
        state.age <= state.age + 1;
        state.gap <= resize(half_period, 11);
        if state.age >= start_max then
          state.mode  <= stop;
          frame_error <= '1';
        elsif state.mode = acknowledge and sync_2 = '0' then
          state.mode <= beginning;
        elsif state.mode = beginning and sync_2 = '1' then
          state.mode <= take;
        end if;
      elsif state.mode = take then
        state.gap <= state.gap - 1;
        if state.gap = 0 then
          state.gap  <= half_period & '1';
          state.slot <= state.slot + 1;
          if state.slot < 2 then
            state.fault <= state.fault or (sync_2 xnor state.slot(0));
          else
            state.crc <= crc_next;
          end if;
          if in_word = '1' then
            if state.slot >= 2 and state.slot + turn_bits > resize(word_bits, 7) + 1 then
              state.work <= state.work or (state.mark and (state.mark'range => sync_2));
              state.mark <= shift_right(state.mark, 1);
            end if;
          elsif in_state = '1' then
            state.status <= state.status(0) & sync_2;
          end if;
          if last = '1' then
            state.mode  <= stop;
            code_valid  <= right and state.status(1);
            frame_error <= not (right and state.status(1));
            if right = '1' then
              alarm   <= not state.status(1);
              warning <= not state.status(0);
            end if;
            if (right and state.status(1)) = '1' then
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
        code_theta         <= (others => '0');
        code_valid         <= '0';
        frame_error        <= '0';
        alarm              <= '0';
        warning            <= '0';
      end if;
    end if;
  end process;

  serial_clock <= state.serial_clock;
  busy         <= '0' when state.mode = idle else '1';

end architecture rtl;
