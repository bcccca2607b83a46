-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: ADC codes to phase currents, i_x = gain_x * (code_x - offset_x).
-- One pipeline for the three channels: b, then c and a, each a clock later.
-- Formats: code of ADC_BITS, left-aligned in CODE U(1,15); gain S(1,16); current PU.
-- Latency: 5 (i_b and i_c are valid with out_soon).  Interval: 3.
-- Rounding: 31 fraction bits half up to 16, saturated at 2 per unit; a sensor scaled to its base does not reach it.
-- With two_sensors phase a has none: i_a = -(i_b + i_c), saturated at 2 per unit, and its rail flag is 0.
-- A product is below 4 per unit, so two bits show whether it fits.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity current_conditioning is
  generic (
    ADC_BITS : positive range 12 to 16 := 16
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    code_a          : in  unsigned(ADC_BITS - 1 downto 0);
    code_b          : in  unsigned(ADC_BITS - 1 downto 0);
    code_c          : in  unsigned(ADC_BITS - 1 downto 0);
    offset_a        : in  unsigned(CODE_W - 1 downto 0);
    offset_b        : in  unsigned(CODE_W - 1 downto 0);
    offset_c        : in  unsigned(CODE_W - 1 downto 0);
    gain_a          : in  signed(GAIN_W - 1 downto 0);
    gain_b          : in  signed(GAIN_W - 1 downto 0);
    gain_c          : in  signed(GAIN_W - 1 downto 0);
    two_sensors     : in  std_logic;
    out_soon        : out std_logic;
    out_valid       : out std_logic;
    i_a             : out signed(PU_W - 1 downto 0);
    i_b             : out signed(PU_W - 1 downto 0);
    i_c             : out signed(PU_W - 1 downto 0);
    current_at_rail : out unsigned(2 downto 0)  -- bit 0 is phase a
  );
end entity current_conditioning;

architecture rtl of current_conditioning is
  constant LATENCY : positive := CURRENT_CONDITIONING_LATENCY;
  constant SUM_W   : positive := CODE_W + GAIN_W;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal code_0   : unsigned(ADC_BITS - 1 downto 0);
  signal offset_0 : unsigned(CODE_W - 1 downto 0);
  signal gain_0   : signed(GAIN_W - 1 downto 0);
  signal diff_1   : signed(CODE_W downto 0);
  signal gain_1   : signed(GAIN_W - 1 downto 0);
  signal rail_1   : std_logic;
  signal prod_2   : signed(CODE_W + GAIN_W downto 0);
  signal rail_2   : std_logic;
  signal i_2      : signed(PU_W - 1 downto 0);
  signal third_4  : signed(PU_W - 1 downto 0);

  function left_aligned (code : unsigned) return unsigned is
  begin
    return shift_left(resize(code, CODE_W), CODE_W - code'length);
  end function;

  -- '1' for the lowest and the highest code: the input may be beyond the range of the converter.
  function at_rail (code : unsigned) return std_logic is
  begin
    return (and code) or (nor code);
  end function;
begin
  valid(0) <= in_valid;

  -- The channel that enters: b, then c, then a
  code_0   <= code_c when valid(1) = '1' else code_a when valid(2) = '1' else code_b;
  offset_0 <= offset_c when valid(1) = '1' else offset_a when valid(2) = '1' else offset_b;
  gain_0   <= gain_c when valid(1) = '1' else gain_a when valid(2) = '1' else gain_b;

  i_2 <= round_sat(prod_2(SUM_W - 1 downto 0), CURRENT_CONDITIONING_DROP, PU_W);

  third_4 <= saturate(difference(-resize(i_b, PU_W + 1), i_c), PU_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1 to 3: diff = code - offset;  rail: the code is at either end
      diff_1 <= signed('0' & left_aligned(code_0)) - signed('0' & offset_0);
      gain_1 <= gain_0;
      rail_1 <= at_rail(code_0);

      -- Stages 2 to 4: prod = diff*gain
      prod_2 <= diff_1 * gain_1;
      rail_2 <= rail_1;

      -- Stages 3, 4, 5: i_b, i_c, i_a = prod, narrowed;  or i_a = -(i_b + i_c)
      if valid(2) = '1' then
        i_b                <= i_2;
        current_at_rail(1) <= rail_2;
      end if;
      if valid(3) = '1' then
        i_c                <= i_2;
        current_at_rail(2) <= rail_2;
      end if;
      if valid(4) = '1' then
        i_a                <= third_4 when two_sensors = '1' else i_2;
        current_at_rail(0) <= rail_2 and not two_sensors;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - 1);
  out_valid <= valid(LATENCY);

end architecture rtl;
