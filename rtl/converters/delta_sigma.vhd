-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: four delta-sigma modulators to codes: their bits, a sinc3 each, fast overcurrent of the three phases.
-- Nothing is computed here.  Modulators 0 to 3 are a, b, c and the bus.  All filters see the same strobes, so the codes
-- come together; one code_valid and one window_error stand for all.
-- Formats: those of the blocks.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity delta_sigma is
  generic (
    ADC_BITS : positive range 12 to 16 := 16
  );
  port (
    clk               : in  std_logic;
    rst               : in  std_logic;
    mod_data          : in  unsigned(3 downto 0);  -- asynchronous
    mod_clock_in      : in  std_logic;  -- asynchronous
    sample_trigger    : in  std_logic;
    mod_ratio         : in  unsigned(5 downto 0);
    mod_delay         : in  unsigned(3 downto 0);
    follow_clock      : in  std_logic;
    oversampling      : in  unsigned(8 downto 0);
    sinc_gain         : in  unsigned(16 downto 0);
    start_clocks      : in  unsigned(15 downto 0);
    trip_oversampling : in  unsigned(5 downto 0);
    limit_high        : in  unsigned(15 downto 0);
    limit_low         : in  unsigned(15 downto 0);
    mod_clock         : out std_logic;
    code_a            : out unsigned(ADC_BITS - 1 downto 0);
    code_b            : out unsigned(ADC_BITS - 1 downto 0);
    code_c            : out unsigned(ADC_BITS - 1 downto 0);
    code_u_dc         : out unsigned(ADC_BITS - 1 downto 0);
    code_valid        : out std_logic;
    window_error      : out std_logic;
    over              : out std_logic
  );
end entity delta_sigma;

architecture rtl of delta_sigma is
  type codes_t is array (0 to 3) of unsigned(ADC_BITS - 1 downto 0);

  signal bits       : unsigned(3 downto 0);
  signal bits_valid : std_logic;
  signal codes      : codes_t;
  signal valids     : std_logic_vector(0 to 3);
  signal errors     : std_logic_vector(0 to 3);
  signal overs      : std_logic_vector(0 to 2);
begin

  pins : entity work.modulator_input
    generic map (LINES => 4)
    port map (clk => clk, rst => rst, mod_data => mod_data, mod_clock_in => mod_clock_in, mod_ratio => mod_ratio,
              sample_delay => mod_delay, follow_clock => follow_clock,
              mod_clock => mod_clock, bits => bits, bits_valid => bits_valid);

  filters : for k in 0 to 3 generate

    filter : entity work.sinc3
      generic map (ADC_BITS => ADC_BITS)
      port map (clk => clk, rst => rst, sample_trigger => sample_trigger, mod_bit => bits(k),
                bits_valid => bits_valid, oversampling => oversampling, gain => sinc_gain,
                start_clocks => start_clocks,
                code => codes(k), code_valid => valids(k), window_error => errors(k));

  end generate;

  trips : for k in 0 to 2 generate

    fast : entity work.sinc_overcurrent
      port map (clk => clk, rst => rst, mod_bit => bits(k), bits_valid => bits_valid,
                oversampling => trip_oversampling, limit_high => limit_high, limit_low => limit_low,
                over => overs(k), total => open, total_valid => open);

  end generate;

  code_a       <= codes(0);
  code_b       <= codes(1);
  code_c       <= codes(2);
  code_u_dc    <= codes(3);
  code_valid   <= valids(0);
  window_error <= errors(0);
  over         <= or overs;

end architecture rtl;
