-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the frame of SPI converters: start of the conversion, chip select, clock, and when a bit is taken.
-- A trigger starts a conversion and one frame; words_complete of spi_words or frame_error answers each trigger.
-- use_convst = 1: convst is high until wait_clocks have passed and BUSY is low, then the frame starts; wait_clocks
-- covers the delay from CONVST to BUSY and two clocks.  No frame until busy_timeout: frame_error.
-- use_convst = 0: the falling edge of cs_n starts the conversion, the frame follows at once.
-- Frame: cs_n low, a period of sclk later word_bits clocks (twice with two_words) of clock_ratio clocks each.  A bit
-- is taken at the edge of sclk in its middle: the first of the bit, or with second_edge the second.  bit_taken comes
-- sample_delay + 1 clocks after that edge leaves its register; sample_delay covers the round trip.
-- A frame without room for the code, or a ratio or length out of range, is refused: each trigger an error then.
-- So is a trigger during a frame, which goes on, and a frame whose bits do not all arrive because a register changed.
-- BUSY is not synchronous and passes two registers.
-- Formats: clocks.  Latency: 1 (every clock is a sample; trigger to convst or cs_n in one clock).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity spi_frame is
  generic (
    ADC_BITS : positive range 12 to 16 := 16
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    sample_trigger  : in  std_logic;
    busy            : in  std_logic;
    words_complete  : in  std_logic;
    clock_ratio     : in  unsigned(4 downto 0);
    word_bits       : in  unsigned(5 downto 0);
    skip_bits       : in  unsigned(4 downto 0);
    sample_delay    : in  unsigned(3 downto 0);
    wait_clocks     : in  unsigned(15 downto 0);
    busy_timeout    : in  unsigned(15 downto 0);
    two_words       : in  std_logic;
    use_convst      : in  std_logic;
    clock_idle      : in  std_logic;
    second_edge     : in  std_logic;
    convst          : out std_logic;
    cs_n            : out std_logic;
    sclk            : out std_logic;
    frame_start     : out std_logic;
    bit_taken       : out std_logic;
    frame_error     : out std_logic;
    setting_refused : out std_logic
  );
end entity spi_frame;

architecture rtl of spi_frame is
  constant STROBES : positive := SPI_FRAME_STROBES;

  type phase_t is (idle, converting, leading, reading, trailing);

  type state_t is record
    phase    : phase_t;
    elapsed  : unsigned(15 downto 0);           -- clocks that convst has been high
    tick     : unsigned(4 downto 0);            -- clock within a period of sclk
    sent     : unsigned(6 downto 0);            -- bits that sclk has clocked
    strobes  : unsigned(STROBES - 1 downto 0);  -- edges that take a bit, of the last clocks, the newest at bit 0
    complete : std_logic;                       -- spi_words has all bits
  end record state_t;

  signal state : state_t;

  -- What comes from another clock
  signal busy_meta : std_logic;
  signal busy_now  : std_logic;

  attribute async_reg : string;

  attribute async_reg of busy_meta : signal is "TRUE";
  attribute async_reg of busy_now  : signal is "TRUE";

  signal good      : std_logic;
  signal half      : unsigned(4 downto 0);
  signal bits      : unsigned(6 downto 0);
  signal last_tick : std_logic;
  signal sampling  : std_logic;
  signal active    : std_logic;  -- sclk away from its idle level
  signal complete  : std_logic;
begin
  good <= '1' when clock_ratio >= SPI_FRAME_LEAST_RATIO and clock_ratio <= SPI_FRAME_MOST_RATIO
                   and word_bits >= SPI_FRAME_LEAST_BITS and word_bits <= SPI_FRAME_MOST_BITS
                   and resize(skip_bits, 6) + ADC_BITS <= word_bits else '0';
  half <= shift_right(clock_ratio, 1);
  bits <= word_bits & '0' when two_words = '1' else '0' & word_bits;

  last_tick <= '1' when resize(state.tick, 6) + 1 >= clock_ratio else '0';
  sampling  <= '1' when state.phase = reading and state.tick = half else '0';
  active    <= (second_edge xnor (state.tick ?< half)) when state.phase = reading else '0';
  complete  <= state.complete or words_complete;

  process (clk)
  begin
    if rising_edge(clk) then
      busy_meta <= busy;
      busy_now  <= busy_meta;

      -- Conversion and frame
      state.tick     <= state.tick + 1;
      state.strobes  <= state.strobes(STROBES - 2 downto 0) & sampling;
      state.complete <= complete;
      frame_start    <= '0';
      frame_error    <= '0';

      case state.phase is

        when idle =>

          state.elapsed  <= to_unsigned(1, 16);
          state.tick     <= (others => '0');
          state.sent     <= (others => '0');
          state.strobes  <= (others => '0');
          state.complete <= '0';
          if sample_trigger = '1' and good = '1' then
            state.phase <= converting when use_convst = '1' else leading;
            convst      <= use_convst;
            cs_n        <= use_convst;
            frame_start <= '1';
          end if;

        when converting =>

          state.elapsed <= state.elapsed + 1;
          state.tick    <= (others => '0');
          if state.elapsed >= wait_clocks and busy_now = '0' then
            state.phase <= leading;
            convst      <= '0';
            cs_n        <= '0';
          elsif state.elapsed >= busy_timeout then
            state.phase <= idle;
            convst      <= '0';
            frame_error <= '1';
          end if;

        when leading =>

          if last_tick = '1' then
            state.phase <= reading;
            state.tick  <= (others => '0');
          end if;

        when reading =>

          if last_tick = '1' then
            state.tick <= (others => '0');
            state.sent <= state.sent + 1;
            if resize(state.sent, 8) + 1 >= bits then
              state.phase <= trailing;
            end if;
          end if;

        when trailing =>

          if complete = '1' or state.tick >= SPI_FRAME_TRAIL then
            state.phase <= idle;
            cs_n        <= '1';
            frame_error <= not complete;
          end if;

      end case;

      if sample_trigger = '1' and (state.phase /= idle or good = '0') then
        frame_error <= '1';
      end if;

      -- Outputs
      sclk            <= clock_idle xor active;
      bit_taken       <= state.strobes(to_integer(sample_delay));
      setting_refused <= not good;

      if rst = '1' then
        state.phase     <= idle;
        state.strobes   <= (others => '0');
        busy_meta       <= '0';
        busy_now        <= '0';
        convst          <= '0';
        cs_n            <= '1';
        sclk            <= '0';
        frame_start     <= '0';
        bit_taken       <= '0';
        frame_error     <= '0';
        setting_refused <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
