-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: master for SPI converters: spi_frame clocks the frame, spi_words makes codes of its bits.
-- Each sample_trigger is answered by codes_valid with all codes, or by frame_error.  See spi_frame for the start of
-- the conversion, the edges, the time-out and refused settings, spi_words for the place and the sign of a code.
-- Timing: the bit taken is the level of the pin sample_delay clocks after the edge of sclk has left its register,
-- registered twice; sample_delay covers the round trip (output pad, isolator, converter, input pad), so that the line
-- is stable then.
-- Formats: clocks, codes.  Latency: 1 (every clock is a sample; convst or cs_n a clock after the trigger).
-- Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity spi_converter is
  generic (
    ADC_BITS : positive range 12 to 16 := 16;
    LINES    : positive range 1 to 4   := 3
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    sample_trigger  : in  std_logic;
    miso            : in  unsigned(LINES - 1 downto 0);
    busy            : in  std_logic;
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
    signed_code     : in  std_logic;
    convst          : out std_logic;
    cs_n            : out std_logic;
    sclk            : out std_logic;
    codes_valid     : out std_logic;
    frame_error     : out std_logic;
    setting_refused : out std_logic;
    code_0          : out unsigned(ADC_BITS - 1 downto 0);  -- first word of lines 0 to 3
    code_1          : out unsigned(ADC_BITS - 1 downto 0);
    code_2          : out unsigned(ADC_BITS - 1 downto 0);
    code_3          : out unsigned(ADC_BITS - 1 downto 0);
    code_4          : out unsigned(ADC_BITS - 1 downto 0);  -- second word of lines 0 to 3
    code_5          : out unsigned(ADC_BITS - 1 downto 0);
    code_6          : out unsigned(ADC_BITS - 1 downto 0);
    code_7          : out unsigned(ADC_BITS - 1 downto 0)
  );
end entity spi_converter;

architecture rtl of spi_converter is
  signal frame_start : std_logic;
  signal bit_taken   : std_logic;
  signal complete    : std_logic;
begin
  codes_valid <= complete;

  frame : entity work.spi_frame
    generic map (
      ADC_BITS => ADC_BITS
    )
    port map (
      clk             => clk,
      rst             => rst,
      sample_trigger  => sample_trigger,
      busy            => busy,
      words_complete  => complete,
      clock_ratio     => clock_ratio,
      word_bits       => word_bits,
      skip_bits       => skip_bits,
      sample_delay    => sample_delay,
      wait_clocks     => wait_clocks,
      busy_timeout    => busy_timeout,
      two_words       => two_words,
      use_convst      => use_convst,
      clock_idle      => clock_idle,
      second_edge     => second_edge,
      convst          => convst,
      cs_n            => cs_n,
      sclk            => sclk,
      frame_start     => frame_start,
      bit_taken       => bit_taken,
      frame_error     => frame_error,
      setting_refused => setting_refused
    );

  words : entity work.spi_words
    generic map (
      ADC_BITS => ADC_BITS,
      LINES    => LINES
    )
    port map (
      clk         => clk,
      rst         => rst,
      frame_start => frame_start,
      bit_taken   => bit_taken,
      miso        => miso,
      word_bits   => word_bits,
      skip_bits   => skip_bits,
      two_words   => two_words,
      signed_code => signed_code,
      codes_valid => complete,
      code_0      => code_0,
      code_1      => code_1,
      code_2      => code_2,
      code_3      => code_3,
      code_4      => code_4,
      code_5      => code_5,
      code_6      => code_6,
      code_7      => code_7
    );

end architecture rtl;
