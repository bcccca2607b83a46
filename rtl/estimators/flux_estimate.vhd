-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the estimated flux linkages, paper 001 eq. (17): one of the two models plus the compensation.
--   lambda_d = merged_d + lambda_pi_d      if merged = 1
--   lambda_d = model_d + lambda_pi_d       otherwise; likewise for q
-- Formats: model S(6,36), merged S(2,40), lambda_pi FLUX, out PU.
-- Latency: 1.
-- Rounding: the models floor to FLUX, which does not change the rounding of the sum half up to PU.  Saturated, reported
-- by estimate_limited, as is a saturated merged flux.
-- lambda comes directly from a register, because the following blocks multiply by it at once.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_estimate is
  port (
    clk              : in  std_logic;
    rst              : in  std_logic;
    in_valid         : in  std_logic;
    model_d          : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    model_q          : in  signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    merged_d         : in  signed(FLUX_MODELS_MERGED_FLUX_W - 1 downto 0);
    merged_q         : in  signed(FLUX_MODELS_MERGED_FLUX_W - 1 downto 0);
    merged           : in  std_logic;
    ended            : in  std_logic;
    lambda_pi_d      : in  signed(FLUX_W - 1 downto 0);
    lambda_pi_q      : in  signed(FLUX_W - 1 downto 0);
    out_valid        : out std_logic;
    lambda_d         : out signed(PU_W - 1 downto 0);
    lambda_q         : out signed(PU_W - 1 downto 0);
    estimate_limited : out std_logic
  );
end entity flux_estimate;

architecture rtl of flux_estimate is
  constant LATENCY : positive := FLUX_ESTIMATE_LATENCY;
  constant SUM_W   : positive := FLUX_MODELS_MODEL_FLUX_W - FLUX_MODELS_DROP_MODEL;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal chosen_d  : signed(SUM_W - 1 downto 0);
  signal chosen_q  : signed(SUM_W - 1 downto 0);
  signal rounded_d : signed(SUM_W - PU_TO_FLUX downto 0);
  signal rounded_q : signed(SUM_W - PU_TO_FLUX downto 0);
  signal past_d_1  : std_logic;
  signal past_q_1  : std_logic;
  signal ended_1   : std_logic;

  -- The flux of one axis that is used, as FLUX.
  function choice (model : signed; merged_flux : signed; merged : std_logic) return signed is
  begin
    if merged = '1' then
      return resize(shift_right(merged_flux, FLUX_MODELS_DROP_MERGED), SUM_W);
    end if;
    return resize(shift_right(model, FLUX_MODELS_DROP_MODEL), SUM_W);
  end function;
begin
  valid(0) <= in_valid;

  -- |model| < 34 and |lambda_pi| <= 2, so the sum fits.
  chosen_d  <= choice(model_d, merged_d, merged);
  chosen_q  <= choice(model_q, merged_q, merged);
  rounded_d <= round_half_up(lambda_pi_d + chosen_d, PU_TO_FLUX);
  rounded_q <= round_half_up(lambda_pi_q + chosen_q, PU_TO_FLUX);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: lambda = chosen + lambda_pi, narrowed
      if valid(0) = '1' then
        lambda_d <= saturate(rounded_d, PU_W);
        lambda_q <= saturate(rounded_q, PU_W);
        past_d_1 <= exceeds(rounded_d, PU_W);
        past_q_1 <= exceeds(rounded_q, PU_W);
        ended_1  <= ended;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  estimate_limited <= past_d_1 or past_q_1 or ended_1;
  out_valid        <= valid(LATENCY);

end architecture rtl;
