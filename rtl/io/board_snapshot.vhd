-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: what the encoder and the converters said at one sample, for software to read word by word.
-- take_snapshot asks for it; the next sample_valid takes all values at once and sets snap_ready.  They stay until the
-- next one is asked for, which clears snap_ready.  snap_code is the encoder's own, also while the position is forced.
-- Formats: codes right-aligned.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity board_snapshot is
  generic (
    ADC_BITS      : positive range 12 to 16 := 16;
    POSITION_BITS : positive range 8 to 18  := 16
  );
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    sample_valid  : in  std_logic;
    take_snapshot : in  std_logic;
    encoder_code  : in  unsigned(POSITION_BITS - 1 downto 0);
    position_code : in  unsigned(POSITION_BITS - 1 downto 0);
    encoder_count : in  unsigned(17 downto 0);
    encoder_flags : in  unsigned(10 downto 0);
    adc_a         : in  unsigned(ADC_BITS - 1 downto 0);
    adc_b         : in  unsigned(ADC_BITS - 1 downto 0);
    adc_c         : in  unsigned(ADC_BITS - 1 downto 0);
    adc_u_dc      : in  unsigned(ADC_BITS - 1 downto 0);
    snap_ready    : out std_logic;
    snap_code     : out unsigned(TURN_W - 1 downto 0);
    snap_position : out unsigned(TURN_W - 1 downto 0);
    snap_count    : out unsigned(17 downto 0);
    snap_flags    : out unsigned(10 downto 0);
    snap_adc_a    : out unsigned(15 downto 0);
    snap_adc_b    : out unsigned(15 downto 0);
    snap_adc_c    : out unsigned(15 downto 0);
    snap_adc_u_dc : out unsigned(15 downto 0)
  );
end entity board_snapshot;

architecture rtl of board_snapshot is
  type state_t is record
    wanted : std_logic;
    ready  : std_logic;
  end record state_t;

  signal state : state_t;
  signal taken : std_logic;
begin
  taken <= state.wanted and sample_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      state.wanted <= take_snapshot or (state.wanted and not taken);
      state.ready  <= (taken or state.ready) and not take_snapshot;

      if taken = '1' then
        snap_code     <= resize(encoder_code, TURN_W);
        snap_position <= resize(position_code, TURN_W);
        snap_count    <= encoder_count;
        snap_flags    <= encoder_flags;
        snap_adc_a    <= resize(adc_a, 16);
        snap_adc_b    <= resize(adc_b, 16);
        snap_adc_c    <= resize(adc_c, 16);
        snap_adc_u_dc <= resize(adc_u_dc, 16);
      end if;

      if rst = '1' then
        state         <= (others => '0');
        snap_code     <= (others => '0');
        snap_position <= (others => '0');
        snap_count    <= (others => '0');
        snap_flags    <= (others => '0');
        snap_adc_a    <= (others => '0');
        snap_adc_b    <= (others => '0');
        snap_adc_c    <= (others => '0');
        snap_adc_u_dc <= (others => '0');
      end if;
    end if;
  end process;

  snap_ready <= state.ready;

end architecture rtl;
