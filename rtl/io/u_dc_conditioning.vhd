-- Purpose: ADC code to bus voltage and to the radius of the voltage circle.
--   u_dc  = u_dc_gain * (code_u_dc - u_dc_offset), not below zero
--   u_max = k_u_max * u_dc
-- Formats: code of ADC_BITS, left-aligned in CODE U(1,15); gain S(1,16); k_u_max U(0,17).
-- Latency: 6.  Interval: 4 (both products share a multiplier, three clocks apart).
-- Rounding: u_dc half up, saturated at 0 and 2; u_max floor, so that the circle is never larger than the bus allows,
-- saturated at 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity u_dc_conditioning is
  generic (
    ADC_BITS : positive range 12 to 16 := 16
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    code_u_dc    : in  unsigned(ADC_BITS - 1 downto 0);
    u_dc_offset  : in  unsigned(CODE_W - 1 downto 0);
    u_dc_gain    : in  signed(GAIN_W - 1 downto 0);
    k_u_max      : in  unsigned(16 downto 0);
    out_valid    : out std_logic;
    u_dc         : out unsigned(U_DC_W - 1 downto 0);
    u_max        : out unsigned(U_MAX_W - 1 downto 0);
    u_dc_at_rail : out std_logic
  );
end entity u_dc_conditioning;

architecture rtl of u_dc_conditioning is
  constant LATENCY : positive := U_DC_CONDITIONING_LATENCY;

  signal valid  : std_logic_vector(0 to LATENCY);
  signal rail_1 : std_logic;
  signal rail_3 : std_logic;
  signal diff_0 : signed(CODE_W downto 0);
  signal u_dc_3 : unsigned(U_DC_W - 1 downto 0);
  signal mul_a  : signed(17 downto 0);
  signal mul_b  : signed(17 downto 0);
  signal prod   : signed(35 downto 0);
  signal half_1 : signed(35 downto 0);
  signal sum    : signed(35 downto 0);
begin
  valid(0) <= in_valid;

  diff_0 <= signed('0' & shift_left(resize(code_u_dc, CODE_W), CODE_W - ADC_BITS)) - signed('0' & u_dc_offset);

  -- Half an LSB of u_dc for the rounding, added in the multiplier's adder; u_max is floored
  half_1 <= half(U_DC_CONDITIONING_DROP_U_DC, 36) when valid(2) = '1' else (others => '0');
  sum    <= prod + half_1;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 4: diff = code - offset and u_dc_gain, then u_dc and k_u_max
      if valid(0) = '1' or valid(3) = '1' then
        mul_a <= resize(diff_0, 18);
        mul_b <= u_dc_gain;
        if valid(3) = '1' then
          mul_a <= signed('0' & u_dc_3);
          mul_b <= signed('0' & k_u_max);
        end if;
      end if;
      if valid(0) = '1' then
        rail_1 <= (and code_u_dc) or (nor code_u_dc);
      end if;

      -- Stages 2, 5: prod = diff * u_dc_gain, then u_dc * k_u_max
      if valid(1) = '1' or valid(4) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stage 3: u_dc = prod, narrowed
      if valid(2) = '1' then
        u_dc_3 <= saturate_u(shift_right(sum, U_DC_CONDITIONING_DROP_U_DC), U_DC_W);
        rail_3 <= rail_1;
      end if;

      -- Stage 6: u_max = prod, floored
      if valid(5) = '1' then
        u_dc         <= u_dc_3;
        u_max        <= saturate_u(shift_right(sum, U_DC_CONDITIONING_DROP_U_MAX), U_MAX_W);
        u_dc_at_rail <= rail_3;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
