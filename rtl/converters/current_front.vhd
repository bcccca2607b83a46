-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the converters of a board from their pins to the four codes of a sample, of the kind that is built.
-- CURRENTS: 0 codes from elsewhere, 1 SPI, 2 XADC, 3 delta-sigma.
-- channel_x is the code of the converter that becomes adc_x: 0 to 7 of SPI (line, and 4 more for the second word), 0 to
-- 3 of the XADC; modulators have their places.  A trigger is answered by codes_done with all four, or the answer is an
-- error: it is counted, the sample stays away and the core's watchdog acts.
-- Formats: codes.  Latency: 1 (every clock is a sample); the codes change a clock after those of the converter.
-- Rounding: none; the counter saturates.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity current_front is
  generic (
    CURRENTS  : natural range 0 to 3    := 1;
    ADC_BITS  : positive range 12 to 16 := 16;
    SPI_LINES : positive range 1 to 4   := 4
  );
  port (
    clk               : in  std_logic;
    rst               : in  std_logic;
    miso              : in  unsigned(SPI_LINES - 1 downto 0);  -- asynchronous
    busy              : in  std_logic;  -- asynchronous with CURRENTS = 1
    eoc               : in  std_logic;
    drdy              : in  std_logic;
    drp_do            : in  unsigned(15 downto 0);
    mod_data          : in  unsigned(3 downto 0);  -- asynchronous
    mod_clock_in      : in  std_logic;  -- asynchronous
    code_a_in         : in  unsigned(ADC_BITS - 1 downto 0);
    code_b_in         : in  unsigned(ADC_BITS - 1 downto 0);
    code_c_in         : in  unsigned(ADC_BITS - 1 downto 0);
    code_u_dc_in      : in  unsigned(ADC_BITS - 1 downto 0);
    codes_valid_in    : in  std_logic;
    sample_trigger    : in  std_logic;
    clear_encoder     : in  std_logic;
    clock_ratio       : in  unsigned(4 downto 0);
    spi_bits          : in  unsigned(5 downto 0);
    spi_skip          : in  unsigned(4 downto 0);
    spi_delay         : in  unsigned(3 downto 0);
    wait_clocks       : in  unsigned(15 downto 0);
    busy_timeout      : in  unsigned(15 downto 0);
    two_words         : in  std_logic;
    use_convst        : in  std_logic;
    clock_idle        : in  std_logic;
    second_edge       : in  std_logic;
    signed_code       : in  std_logic;
    channel_a         : in  unsigned(2 downto 0);
    channel_b         : in  unsigned(2 downto 0);
    channel_c         : in  unsigned(2 downto 0);
    channel_u_dc      : in  unsigned(2 downto 0);
    conversions       : in  unsigned(2 downto 0);
    xadc_channels     : in  unsigned(2 downto 0);
    address_0         : in  unsigned(6 downto 0);
    address_1         : in  unsigned(6 downto 0);
    address_2         : in  unsigned(6 downto 0);
    address_3         : in  unsigned(6 downto 0);
    xadc_timeout      : in  unsigned(15 downto 0);
    mod_ratio         : in  unsigned(5 downto 0);
    mod_delay         : in  unsigned(3 downto 0);
    follow_clock      : in  std_logic;
    oversampling      : in  unsigned(8 downto 0);
    sinc_gain         : in  unsigned(16 downto 0);
    start_clocks      : in  unsigned(15 downto 0);
    trip_oversampling : in  unsigned(5 downto 0);
    limit_high        : in  unsigned(15 downto 0);
    limit_low         : in  unsigned(15 downto 0);
    adc_a             : out unsigned(ADC_BITS - 1 downto 0);
    adc_b             : out unsigned(ADC_BITS - 1 downto 0);
    adc_c             : out unsigned(ADC_BITS - 1 downto 0);
    adc_u_dc          : out unsigned(ADC_BITS - 1 downto 0);
    codes_done        : out std_logic;
    converter_errors  : out unsigned(11 downto 0);
    converter_refused : out std_logic;
    converter_over    : out std_logic;
    convst            : out std_logic;
    cs_n              : out std_logic;
    sclk              : out std_logic;
    den               : out std_logic;
    daddr             : out unsigned(6 downto 0);
    mod_clock         : out std_logic
  );
end entity current_front;

architecture rtl of current_front is
  type codes_t is array (0 to 7) of unsigned(ADC_BITS - 1 downto 0);

  signal codes             : codes_t;  -- of the converter
  signal new_codes, failed : std_logic;
  signal errors            : unsigned(11 downto 0);
begin

  elsewhere : if CURRENTS = 0 generate
    codes     <= (code_a_in, code_b_in, code_c_in, code_u_dc_in, others => (others => '0'));
    new_codes <= codes_valid_in;
    failed    <= '0';
  end generate elsewhere;

  serial : if CURRENTS = 1 generate

    converter : entity work.spi_converter
      generic map (ADC_BITS => ADC_BITS, LINES => SPI_LINES)
      port map (clk => clk, rst => rst, sample_trigger => sample_trigger, miso => miso, busy => busy,
                clock_ratio => clock_ratio, word_bits => spi_bits, skip_bits => spi_skip, sample_delay => spi_delay,
                wait_clocks => wait_clocks, busy_timeout => busy_timeout, two_words => two_words,
                use_convst => use_convst, clock_idle => clock_idle, second_edge => second_edge,
                signed_code => signed_code,
                convst => convst, cs_n => cs_n, sclk => sclk, codes_valid => new_codes, frame_error => failed,
                setting_refused => converter_refused, code_0 => codes(0), code_1 => codes(1), code_2 => codes(2),
                code_3 => codes(3), code_4 => codes(4), code_5 => codes(5), code_6 => codes(6), code_7 => codes(7));

  else generate
    cs_n              <= '1';
    sclk              <= '0';
    converter_refused <= '0';
  end generate serial;

  internal : if CURRENTS = 2 generate

    converter : entity work.xadc_reader
      generic map (ADC_BITS => ADC_BITS)
      port map (clk => clk, rst => rst, sample_trigger => sample_trigger, busy => busy, eoc => eoc, drdy => drdy,
                drp_do => drp_do, conversions => conversions, channels => xadc_channels, address_0 => address_0,
                address_1 => address_1, address_2 => address_2, address_3 => address_3, timeout => xadc_timeout,
                signed_code => signed_code,
                convst => convst, den => den, daddr => daddr, codes_valid => new_codes, frame_error => failed,
                code_0 => codes(0), code_1 => codes(1), code_2 => codes(2), code_3 => codes(3));

    codes(4 to 7) <= codes(0 to 3);
  else generate
    den           <= '0';
    daddr         <= (others => '0');
  end generate internal;

  modulators : if CURRENTS = 3 generate

    converter : entity work.delta_sigma
      generic map (ADC_BITS => ADC_BITS)
      port map (clk => clk, rst => rst, mod_data => mod_data, mod_clock_in => mod_clock_in,
                sample_trigger => sample_trigger, mod_ratio => mod_ratio, mod_delay => mod_delay,
                follow_clock => follow_clock, oversampling => oversampling, sinc_gain => sinc_gain,
                start_clocks => start_clocks, trip_oversampling => trip_oversampling, limit_high => limit_high,
                limit_low => limit_low,
                mod_clock => mod_clock, code_a => codes(0), code_b => codes(1), code_c => codes(2),
                code_u_dc => codes(3), code_valid => new_codes, window_error => failed, over => converter_over);

    codes(4 to 7)  <= (others => (others => '0'));
  else generate
    mod_clock      <= '0';
    converter_over <= '0';
  end generate modulators;

  no_start : if CURRENTS = 0 or CURRENTS = 3 generate
    convst <= '0';
  end generate no_start;

  process (clk)
  begin
    if rising_edge(clk) then
      codes_done <= new_codes;
      if new_codes = '1' then
        adc_a    <= codes(0);
        adc_b    <= codes(1);
        adc_c    <= codes(2);
        adc_u_dc <= codes(3);
        if CURRENTS = 1 or CURRENTS = 2 then
          adc_a    <= codes(to_integer(channel_a));
          adc_b    <= codes(to_integer(channel_b));
          adc_c    <= codes(to_integer(channel_c));
          adc_u_dc <= codes(to_integer(channel_u_dc));
        end if;
      end if;

      -- Triggers without codes
      errors <= (others => '0') when clear_encoder = '1' else errors;
      if failed = '1' and clear_encoder = '1' then
        errors <= to_unsigned(1, 12);
      elsif failed = '1' and errors /= 4095 then
        errors <= errors + 1;
      end if;

      if rst = '1' then
        codes_done <= '0';
        errors     <= (others => '0');
        adc_a      <= (others => '0');
        adc_b      <= (others => '0');
        adc_c      <= (others => '0');
        adc_u_dc   <= (others => '0');
      end if;
    end if;
  end process;

  converter_errors <= errors;

end architecture rtl;
