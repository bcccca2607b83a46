-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: flux linkages from currents by the linear magnetic model, paper 001 eq. (6), corrected by eq. (16).
--   lambda_c_d = l_d*i_d + lambda_mg + lambda_add_d = model_d + lambda_add_d
--   lambda_c_q = l_q*i_q             + lambda_add_q = model_q + lambda_add_q
-- model comes from flux_models.  lambda_add is the correction of eq. (16), zero in every other mode.
-- Formats: model S(6,36); lambda_add and results FLUX; sums exact.
-- Latency: 2.
-- Rounding: half up, saturated at 2 per unit, twice the flux of full voltage at base speed; reported by model_limited.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity current_model is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    in_valid      : in  std_logic;
    model_d       : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    model_q       : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    lambda_add_d  : in  signed(FLUX_W - 1 downto 0);
    lambda_add_q  : in  signed(FLUX_W - 1 downto 0);
    out_valid     : out std_logic;
    lambda_c_d    : out signed(FLUX_W - 1 downto 0);
    lambda_c_q    : out signed(FLUX_W - 1 downto 0);
    model_limited : out std_logic
  );
end entity current_model;

architecture rtl of current_model is
  constant LATENCY : positive := CURRENT_MODEL_LATENCY;
  constant SUM_W   : positive := FLUX_MODELS_MODEL_FLUX_W - FLUX_MODELS_DROP_MODEL;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal rounded_d : signed(SUM_W - 1 downto 0);
  signal rounded_q : signed(SUM_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: rounded = lambda_add + model, as FLUX; |model| < 34 and |lambda_add| <= 2, so it fits
      rounded_d <= plus_rounded(resize(lambda_add_d, SUM_W), model_d, FLUX_MODELS_DROP_MODEL);
      rounded_q <= plus_rounded(resize(lambda_add_q, SUM_W), model_q, FLUX_MODELS_DROP_MODEL);

      -- Stage 2: lambda_c = rounded, narrowed
      if valid(1) = '1' then
        lambda_c_d    <= saturate(rounded_d, FLUX_W);
        lambda_c_q    <= saturate(rounded_q, FLUX_W);
        model_limited <= exceeds(rounded_d, FLUX_W) or exceeds(rounded_q, FLUX_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
