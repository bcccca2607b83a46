-- Purpose: ADC codes to phase currents, i_x = gain_x * (code_x - offset_x), one multiplier for three channels.
-- Formats: code of ADC_BITS, left-aligned in CODE U(1,15); gain S(1,16); current PU.
-- Latency: 5 (channels b, c, a one after the other; b and c are valid with out_soon).  Interval: 3.
-- Rounding: 31 fraction bits half up to 16, saturated at 2 per unit; a sensor scaled to its base does not reach it.
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
  signal code_1   : unsigned(ADC_BITS - 1 downto 0);
  signal rail_2   : unsigned(2 downto 0);
  signal diff_1   : signed(CODE_W downto 0);
  signal gain_1   : signed(GAIN_W - 1 downto 0);
  signal prod_2   : signed(CODE_W + GAIN_W downto 0);
  signal sum_2    : signed(SUM_W - 1 downto 0);
  signal i_2      : signed(PU_W - 1 downto 0);

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

  -- The channel of this clock: b while in_valid, then c, then a
  code_0   <= code_c when valid(1) = '1' else code_a when valid(2) = '1' else code_b;
  offset_0 <= offset_c when valid(1) = '1' else offset_a when valid(2) = '1' else offset_b;
  gain_0   <= gain_c when valid(1) = '1' else gain_a when valid(2) = '1' else gain_b;

  sum_2 <= prod_2(SUM_W - 1 downto 0) + half(CURRENT_CONDITIONING_DROP, SUM_W);
  i_2   <= saturate(sum_2(SUM_W - 1 downto CURRENT_CONDITIONING_DROP), PU_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: diff = code - offset, channel by channel
      if valid(0) = '1' or valid(1) = '1' or valid(2) = '1' then
        diff_1 <= signed('0' & left_aligned(code_0)) - signed('0' & offset_0);
        gain_1 <= gain_0;
        code_1 <= code_0;
      end if;

      -- Stage 2: prod = diff * gain;  rail: a shift register of the channels' flags
      if valid(1) = '1' or valid(2) = '1' or valid(3) = '1' then
        prod_2 <= diff_1 * gain_1;
        rail_2 <= at_rail(code_1) & rail_2(2 downto 1);
      end if;

      -- Stage 3: i = prod, narrowed; b at clock 3, c at 4, a at 5.  b comes through c: less fan-out of the limiter.
      if valid(2) = '1' or valid(3) = '1' then
        i_c <= i_2;
        i_b <= i_c;
      end if;
      if valid(4) = '1' then
        i_a             <= i_2;
        current_at_rail <= rail_2(1 downto 0) & rail_2(2);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - 1);
  out_valid <= valid(LATENCY);

end architecture rtl;
