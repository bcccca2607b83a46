-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: reads channels of the XADC (or SYSMON) of a Xilinx FPGA through its DRP; the clock is DCLK.
-- trigger -> conversions times (convst, end of conversion) -> channels reads (den with daddr, drdy with drp_do) ->
-- codes The XADC is set to event mode: convst holds the inputs at its rising edge.  In simultaneous sampling one
-- conversion holds a pair of channels; each further conversion of a frame holds its inputs later, when the one before
-- has ended.
-- A frame that has not ended timeout clocks after its trigger is a frame_error, and so is a trigger during a frame,
-- which goes on, and one while busy shows that a conversion of a frame that was given up has not ended.
-- Code: the upper ADC_BITS bits of drp_do; signed_code: two's complement, the sign is inverted, zero becomes mid code.
-- All codes change together, with codes_valid.  Nothing is written: dwe and di of the DRP are zero.
-- Formats: clocks, codes.  Latency: 1 (every clock is a sample; trigger to convst in one clock).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity xadc_reader is
  generic (
    ADC_BITS : positive range 12 to 16 := 12
  );
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    sample_trigger : in  std_logic;
    busy           : in  std_logic;
    eoc            : in  std_logic;
    drdy           : in  std_logic;
    drp_do         : in  unsigned(15 downto 0);
    conversions    : in  unsigned(2 downto 0);
    channels       : in  unsigned(2 downto 0);
    address_0      : in  unsigned(6 downto 0);
    address_1      : in  unsigned(6 downto 0);
    address_2      : in  unsigned(6 downto 0);
    address_3      : in  unsigned(6 downto 0);
    timeout        : in  unsigned(15 downto 0);
    signed_code    : in  std_logic;
    convst         : out std_logic;
    den            : out std_logic;
    daddr          : out unsigned(6 downto 0);
    codes_valid    : out std_logic;
    frame_error    : out std_logic;
    code_0         : out unsigned(ADC_BITS - 1 downto 0);
    code_1         : out unsigned(ADC_BITS - 1 downto 0);
    code_2         : out unsigned(ADC_BITS - 1 downto 0);
    code_3         : out unsigned(ADC_BITS - 1 downto 0)
  );
end entity xadc_reader;

architecture rtl of xadc_reader is
  constant CONVST_CLOCKS : positive := XADC_READER_CONVST_CLOCKS;

  type phase_t is (idle, converting, asking, reading, ending);
  type words_t is array (0 to 3) of unsigned(15 downto 0);

  type state_t is record
    phase   : phase_t;
    elapsed : unsigned(15 downto 0);  -- clocks since the trigger
    pulse   : unsigned(3 downto 0);   -- clocks that convst stays high
    done    : unsigned(2 downto 0);   -- conversions, then reads
    read    : words_t;
  end record state_t;

  signal state : state_t;

  signal late    : std_logic;
  signal address : unsigned(6 downto 0);

  -- The upper bits of a word; two's complement to a code whose middle is zero
  function offset_code (word : unsigned; is_signed : std_logic) return unsigned is
    variable result : unsigned(ADC_BITS - 1 downto 0) := word(15 downto 16 - ADC_BITS);
  begin
    result(ADC_BITS - 1) := result(ADC_BITS - 1) xor is_signed;
    return result;
  end function;
begin
  late    <= '1' when state.elapsed >= timeout else '0';
  address <= address_0 when state.done = 0 else address_1 when state.done = 1 else
             address_2 when state.done = 2 else address_3;

  process (clk)
  begin
    if rising_edge(clk) then
      state.elapsed <= state.elapsed + 1;
      if state.pulse > 0 then
        state.pulse <= state.pulse - 1;
      end if;
      convst      <= '1' when state.pulse > 1 else '0';
      den         <= '0';
      codes_valid <= '0';
      frame_error <= '0';

      if state.phase = idle then
        state.elapsed <= to_unsigned(1, 16);
        state.done    <= (others => '0');
        if sample_trigger = '1' and busy = '0' then
          state.phase <= converting;
          state.pulse <= to_unsigned(CONVST_CLOCKS, 4);
          convst      <= '1';
        end if;
      elsif state.phase = ending then
        state.phase <= idle;
        codes_valid <= '1';
        code_0      <= offset_code(state.read(0), signed_code);
        code_1      <= offset_code(state.read(1), signed_code);
        code_2      <= offset_code(state.read(2), signed_code);
        code_3      <= offset_code(state.read(3), signed_code);
      elsif late = '1' then
        state.phase <= idle;
        state.pulse <= (others => '0');
        convst      <= '0';
        frame_error <= '1';
      elsif state.phase = converting then
        if eoc = '1' and state.pulse = 0 then
          state.done <= state.done + 1;
          if state.done + 1 >= conversions then
            state.phase <= asking;
            state.done  <= (others => '0');
          else
            state.pulse <= to_unsigned(CONVST_CLOCKS, 4);
            convst      <= '1';
          end if;
        end if;
      elsif state.phase = asking then
        state.phase <= reading;
        den         <= '1';
      elsif drdy = '1' then
        state.phase <= ending when state.done + 1 >= channels else asking;
        state.done  <= state.done + 1;
        for k in 0 to 3 loop
          if state.done = k then
            state.read(k) <= drp_do;
          end if;
        end loop;
      end if;
      if sample_trigger = '1' and (state.phase /= idle or busy = '1') then
        frame_error <= '1';
      end if;
      daddr <= address;

      if rst = '1' then
        state.phase   <= idle;
        state.elapsed <= to_unsigned(1, 16);
        state.pulse   <= (others => '0');
        state.done    <= (others => '0');
        state.read    <= (others => (others => '0'));
        convst        <= '0';
        den           <= '0';
        daddr         <= (others => '0');
        codes_valid   <= '0';
        frame_error   <= '0';
        code_0        <= (others => '0');
        code_1        <= (others => '0');
        code_2        <= (others => '0');
        code_3        <= (others => '0');
      end if;
    end if;
  end process;

end architecture rtl;
