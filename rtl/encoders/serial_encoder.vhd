-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: an absolute encoder from its lines to a code for each sample: the master of its protocol and the bridge.
-- Nothing is computed here.  A frame starts with sample_trigger; the bridge's sample is the strobe of the converters'
-- codes, so a frame that has ended by then is this sample's.  ENCODER: 4 SSI, 5 BiSS-C, 6 EnDat.
-- Formats: those of the blocks.  Latency: 1 (every clock is a sample), codes_valid to code_valid 4.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity serial_encoder is
  generic (
    ENCODER       : natural range 4 to 6   := 4;
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    serial_data    : in  std_logic;  -- asynchronous
    sample_trigger : in  std_logic;
    codes_valid    : in  std_logic;
    clear_encoder  : in  std_logic;
    half_period    : in  unsigned(9 downto 0);
    encoder_bits   : in  unsigned(5 downto 0);
    turn_bits      : in  unsigned(5 downto 0);
    gray           : in  std_logic;
    parity_on      : in  std_logic;
    crc_on         : in  std_logic;
    start_max      : in  unsigned(15 downto 0);
    mode_command   : in  unsigned(5 downto 0);
    two_errors     : in  std_logic;
    position_delay : in  unsigned(17 downto 0);
    bridge_max     : in  unsigned(7 downto 0);
    serial_clock   : out std_logic;
    data_out       : out std_logic;
    data_drive     : out std_logic;
    code_theta     : out unsigned(POSITION_BITS - 1 downto 0);
    code_valid     : out std_logic;
    position_valid : out std_logic;
    position_lost  : out std_logic;
    bridged_count  : out unsigned(11 downto 0);
    alarm          : out std_logic;
    warning        : out std_logic
  );
end entity serial_encoder;

architecture rtl of serial_encoder is
  signal frame_code  : unsigned(POSITION_BITS - 1 downto 0);
  signal frame_valid : std_logic;
begin

  ssi : if ENCODER = 4 generate

    master : entity work.ssi_master
      generic map (POSITION_BITS => POSITION_BITS)
      port map (clk => clk, rst => rst, serial_data => serial_data, start => sample_trigger,
                half_period => half_period, word_bits => encoder_bits, turn_bits => turn_bits, gray => gray,
                parity_on => parity_on,
                serial_clock => serial_clock, code_theta => frame_code, code_valid => frame_valid,
                frame_error => open, busy => open);

  end generate ssi;

  biss : if ENCODER = 5 generate

    master : entity work.biss_master
      generic map (POSITION_BITS => POSITION_BITS)
      port map (clk => clk, rst => rst, serial_data => serial_data, start => sample_trigger,
                half_period => half_period, word_bits => encoder_bits, turn_bits => turn_bits, crc_on => crc_on,
                start_max => start_max,
                serial_clock => serial_clock, code_theta => frame_code, code_valid => frame_valid,
                frame_error => open, alarm => alarm, warning => warning, busy => open);

  end generate biss;

  endat : if ENCODER = 6 generate

    master : entity work.endat_master
      generic map (POSITION_BITS => POSITION_BITS)
      port map (clk => clk, rst => rst, serial_data => serial_data, start => sample_trigger,
                half_period => half_period, mode_command => mode_command, two_errors => two_errors,
                word_bits => encoder_bits, turn_bits => turn_bits, crc_on => crc_on, start_max => start_max,
                serial_clock => serial_clock, data_out => data_out, data_drive => data_drive,
                code_theta => frame_code, code_valid => frame_valid, frame_error => open, alarm => alarm,
                busy => open);

  end generate endat;

  no_drive : if ENCODER /= 6 generate
    data_out   <= '0';
    data_drive <= '0';
  end generate no_drive;

  no_alarm : if ENCODER = 4 generate
    alarm <= '0';
  end generate no_alarm;

  no_warning : if ENCODER /= 5 generate
    warning <= '0';
  end generate no_warning;

  bridge : entity work.position_bridge
    generic map (POSITION_BITS => POSITION_BITS)
    port map (clk => clk, rst => rst, frame_code => frame_code, frame_valid => frame_valid, sample => codes_valid,
              clear_faults => clear_encoder, delay => position_delay, bridge_max => bridge_max,
              code_theta => code_theta, code_valid => code_valid, position_valid => position_valid,
              position_lost => position_lost, bridged_count => bridged_count);

end architecture rtl;
