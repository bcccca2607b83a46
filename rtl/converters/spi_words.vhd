-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: bits of SPI converters to codes, several data lines in parallel, one or two words on each.
-- bit_taken takes a bit of every line: the level of its pin two clocks before.  The lines are not synchronous and
-- pass two registers, which settle what moves when nothing is taken; when a bit is taken they are stable, see
-- spi_frame.
-- Code: the ADC_BITS bits after skip_bits bits of a word, most significant first.  signed_code: it is two's
-- complement and its sign is inverted, so that zero becomes the middle of the range.  two_words: the second word is
-- another channel.
-- Codes of absent lines and absent second words are zero.  All codes change together, with codes_valid, after the last
-- bit.  frame_start drops what has arrived before.
-- Formats: codes.  Latency: 1 (every clock is a sample; codes_valid two clocks after the last bit).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity spi_words is
  generic (
    ADC_BITS : positive range 12 to 16 := 16;
    LINES    : positive range 1 to 4   := 3
  );
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    frame_start : in  std_logic;
    bit_taken   : in  std_logic;
    miso        : in  unsigned(LINES - 1 downto 0);
    word_bits   : in  unsigned(5 downto 0);
    skip_bits   : in  unsigned(4 downto 0);
    two_words   : in  std_logic;
    signed_code : in  std_logic;
    codes_valid : out std_logic;
    code_0      : out unsigned(ADC_BITS - 1 downto 0);  -- first word of lines 0 to 3
    code_1      : out unsigned(ADC_BITS - 1 downto 0);
    code_2      : out unsigned(ADC_BITS - 1 downto 0);
    code_3      : out unsigned(ADC_BITS - 1 downto 0);
    code_4      : out unsigned(ADC_BITS - 1 downto 0);  -- second word of lines 0 to 3
    code_5      : out unsigned(ADC_BITS - 1 downto 0);
    code_6      : out unsigned(ADC_BITS - 1 downto 0);
    code_7      : out unsigned(ADC_BITS - 1 downto 0)
  );
end entity spi_words;

architecture rtl of spi_words is
  type shift_t is array (0 to LINES - 1) of unsigned(2 * ADC_BITS - 1 downto 0);
  type codes_t is array (0 to 7) of unsigned(ADC_BITS - 1 downto 0);

  type state_t is record
    place    : unsigned(5 downto 0);  -- of the next bit in its word
    second   : std_logic;             -- the second word is arriving
    complete : std_logic;             -- all bits have arrived
    shift    : shift_t;               -- bits of the codes of a line, the second word in the lower half
    codes    : codes_t;
  end record state_t;

  signal state : state_t;

  -- What comes from another clock
  signal miso_meta : unsigned(LINES - 1 downto 0);
  signal miso_now  : unsigned(LINES - 1 downto 0);

  attribute async_reg : string;

  attribute async_reg of miso_meta : signal is "TRUE";
  attribute async_reg of miso_now  : signal is "TRUE";

  signal last_bit : std_logic;  -- of a word
  signal inside   : std_logic;  -- the bit belongs to the code

  -- Two's complement to a code whose middle is zero
  function offset_code (bits : unsigned; is_signed : std_logic) return unsigned is
    variable result : unsigned(ADC_BITS - 1 downto 0) := bits;
  begin
    result(ADC_BITS - 1) := result(ADC_BITS - 1) xor is_signed;
    return result;
  end function;
begin
  last_bit <= '1' when resize(state.place, 7) + 1 >= word_bits else '0';
  inside   <= '1' when state.place >= skip_bits and state.place < resize(skip_bits, 6) + ADC_BITS else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      miso_meta <= miso;
      miso_now  <= miso_meta;

      -- Bits that arrive
      state.complete <= '0';
      if bit_taken = '1' then
        if inside = '1' then
          for k in 0 to LINES - 1 loop
            state.shift(k) <= state.shift(k)(2 * ADC_BITS - 2 downto 0) & miso_now(k);
          end loop;
        end if;
        state.place <= state.place + 1;
        if last_bit = '1' then
          state.place    <= (others => '0');
          state.second   <= '1';
          state.complete <= state.second or not two_words;
        end if;
      end if;
      if frame_start = '1' then
        state.place  <= (others => '0');
        state.second <= '0';
      end if;

      -- All codes together
      codes_valid <= state.complete;
      if state.complete = '1' then
        for k in 0 to LINES - 1 loop
          state.codes(k)     <= offset_code(state.shift(k)(ADC_BITS - 1 downto 0), signed_code);
          state.codes(k + 4) <= (others => '0');
          if two_words = '1' then
            state.codes(k)     <= offset_code(state.shift(k)(2 * ADC_BITS - 1 downto ADC_BITS), signed_code);
            state.codes(k + 4) <= offset_code(state.shift(k)(ADC_BITS - 1 downto 0), signed_code);
          end if;
        end loop;
      end if;

      if rst = '1' then
        miso_meta      <= (others => '0');
        miso_now       <= (others => '0');
        state.place    <= (others => '0');
        state.second   <= '0';
        state.complete <= '0';
        state.shift    <= (others => (others => '0'));
        state.codes    <= (others => (others => '0'));
        codes_valid    <= '0';
      end if;
    end if;
  end process;

  code_0 <= state.codes(0);
  code_1 <= state.codes(1);
  code_2 <= state.codes(2);
  code_3 <= state.codes(3);
  code_4 <= state.codes(4);
  code_5 <= state.codes(5);
  code_6 <= state.codes(6);
  code_7 <= state.codes(7);

end architecture rtl;
