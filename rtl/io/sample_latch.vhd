-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: latches one raw sample, the references and the run state, so that they are constant while it is processed.
-- Everything that may change at any clock enters the core here.
-- Formats: unchanged.  Latency: 1.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity sample_latch is
  generic (
    ADC_BITS      : positive range 12 to 16 := 16;
    POSITION_BITS : positive range 8 to 18  := 16
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    adc_a           : in  unsigned(ADC_BITS - 1 downto 0);
    adc_b           : in  unsigned(ADC_BITS - 1 downto 0);
    adc_c           : in  unsigned(ADC_BITS - 1 downto 0);
    adc_u_dc        : in  unsigned(ADC_BITS - 1 downto 0);
    position_code   : in  unsigned(POSITION_BITS - 1 downto 0);
    omega_ref_in    : in  signed(PU_W - 1 downto 0);
    i_d_ref_in      : in  signed(PU_W - 1 downto 0);
    i_q_ext_in      : in  signed(PU_W - 1 downto 0);
    speed_mode_in   : in  std_logic;
    temp_winding_in : in  signed(15 downto 0);
    temp_valid_in   : in  std_logic;
    clear_faults_in : in  std_logic;
    run_in          : in  std_logic;
    out_valid       : out std_logic;
    code_a          : out unsigned(ADC_BITS - 1 downto 0);
    code_b          : out unsigned(ADC_BITS - 1 downto 0);
    code_c          : out unsigned(ADC_BITS - 1 downto 0);
    code_u_dc       : out unsigned(ADC_BITS - 1 downto 0);
    code_theta      : out unsigned(POSITION_BITS - 1 downto 0);
    omega_ref       : out signed(PU_W - 1 downto 0);
    i_d_ref         : out signed(PU_W - 1 downto 0);
    i_q_ext         : out signed(PU_W - 1 downto 0);
    speed_mode      : out std_logic;
    temp_winding    : out signed(15 downto 0);
    temp_valid      : out std_logic;
    clear_faults    : out std_logic;
    run             : out std_logic
  );
end entity sample_latch;

architecture rtl of sample_latch is
begin

  process (clk)
  begin
    if rising_edge(clk) then
      out_valid <= in_valid;

      -- Stage 1: out = in
      if in_valid = '1' then
        code_a       <= adc_a;
        code_b       <= adc_b;
        code_c       <= adc_c;
        code_u_dc    <= adc_u_dc;
        code_theta   <= position_code;
        omega_ref    <= omega_ref_in;
        i_d_ref      <= i_d_ref_in;
        i_q_ext      <= i_q_ext_in;
        speed_mode   <= speed_mode_in;
        temp_winding <= temp_winding_in;
        temp_valid   <= temp_valid_in;
        clear_faults <= clear_faults_in;
        run          <= run_in;
      end if;

      if rst = '1' then
        out_valid <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
