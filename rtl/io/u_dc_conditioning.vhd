-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: ADC code to bus voltage and to the radius of the voltage circle.
--   u_dc  = u_dc_gain * (code_u_dc - u_dc_offset), not below zero
--   u_max = k_u_max * u_dc
-- One pipeline for both products, u_max three clocks after u_dc.
-- Formats: code of ADC_BITS, left-aligned in CODE U(1,15); gain S(1,16); k_u_max U(0,17).
-- Latency: 7 (u_dc is valid with out_soon).  Interval: 4.
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
    out_soon     : out std_logic;
    out_valid    : out std_logic;
    u_dc         : out unsigned(U_DC_W - 1 downto 0);
    u_max        : out unsigned(U_MAX_W - 1 downto 0);
    u_dc_at_rail : out std_logic
  );
end entity u_dc_conditioning;

architecture rtl of u_dc_conditioning is
  constant LATENCY   : positive := U_DC_CONDITIONING_LATENCY;
  constant PRODUCT_W : positive := 38;  -- the whole sum: nothing to saturate

  signal valid     : std_logic_vector(0 to LATENCY);
  signal code_0    : unsigned(CODE_W - 1 downto 0);
  signal diff_0    : signed(CODE_W + 1 downto 0);
  signal factor_0  : signed(17 downto 0);
  signal by_0      : signed(17 downto 0);
  signal added_0   : signed(U_DC_CONDITIONING_DROP_U_DC downto 0);
  signal product_3 : signed(PRODUCT_W - 1 downto 0);
  signal u_dc_3    : unsigned(U_DC_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  code_0 <= shift_left(resize(code_u_dc, CODE_W), CODE_W - ADC_BITS);
  diff_0 <= difference(signed('0' & code_0), signed('0' & u_dc_offset));

  -- The product that enters: diff*u_dc_gain and half an LSB of u_dc, then u_dc*k_u_max, which is floored
  factor_0 <= chosen(signed('0' & u_dc_3), diff_0, valid(3));
  by_0     <= chosen(signed('0' & k_u_max), u_dc_gain, valid(3));
  added_0  <= (others => '0') when valid(3) = '1' else
              half(U_DC_CONDITIONING_DROP_U_DC, U_DC_CONDITIONING_DROP_U_DC + 1);

  -- Stages 1 to 3: diff*u_dc_gain;  stages 4 to 6: u_dc*k_u_max
  product : entity work.multiply_add
    generic map (DROP => 0)
    port map (clk => clk, a => factor_0, b => by_0, c => added_0, y => product_3, limited => open);

  u_dc_3 <= saturate_u(shift_right(product_3, U_DC_CONDITIONING_DROP_U_DC), U_DC_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 4: u_dc = diff*u_dc_gain, narrowed
      if valid(3) = '1' then
        u_dc         <= u_dc_3;
        u_dc_at_rail <= (and code_u_dc) or (nor code_u_dc);
      end if;

      -- Stage 7: u_max = u_dc*k_u_max, narrowed
      if valid(6) = '1' then
        u_max <= saturate_u(shift_right(product_3, U_DC_CONDITIONING_DROP_U_MAX), U_MAX_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - U_DC_CONDITIONING_AHEAD);
  out_valid <= valid(LATENCY);

end architecture rtl;
