-- Purpose: the estimated flux linkages, paper 001 eq. (17): merged models plus the compensation, narrowed.
--   lambda_d = merged_d      if merged = 1
--   lambda_d = model_d       otherwise; likewise for q
-- Formats: model S(6,24), merged S(3,23), both including the compensation and half an LSB of PU; out PU.
-- Latency: 1.
-- Rounding: half up to PU by truncation.  Saturated, reported by estimate_limited, as is a saturated merged flux.
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
    out_valid        : out std_logic;
    lambda_d         : out signed(PU_W - 1 downto 0);
    lambda_q         : out signed(PU_W - 1 downto 0);
    estimate_limited : out std_logic
  );
end entity flux_estimate;

architecture rtl of flux_estimate is
  constant LATENCY : positive := FLUX_ESTIMATE_LATENCY;
  constant CUT_W   : positive := FLUX_MODELS_MODEL_FLUX_W - PU_TO_FLUX - 1;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal cut_md   : signed(FLUX_MODELS_MERGED_FLUX_W - 1 - PU_TO_FLUX downto 0);  -- of the merged flux
  signal cut_mq   : signed(FLUX_MODELS_MERGED_FLUX_W - 1 - PU_TO_FLUX downto 0);
  signal cut_cd   : signed(CUT_W - 1 downto 0);                                   -- of the current model's
  signal cut_cq   : signed(CUT_W - 1 downto 0);
  signal cut_d    : signed(CUT_W - 1 downto 0);
  signal cut_q    : signed(CUT_W - 1 downto 0);
  signal past_d   : std_logic;
  signal past_q   : std_logic;
  signal past_d_1 : std_logic;
  signal past_q_1 : std_logic;
  signal ended_1  : std_logic;
begin
  valid(0) <= in_valid;

  cut_md <= merged_d(merged_d'high downto PU_TO_FLUX);
  cut_mq <= merged_q(merged_q'high downto PU_TO_FLUX);
  cut_cd <= model_d(model_d'high downto PU_TO_FLUX + 1);
  cut_cq <= model_q(model_q'high downto PU_TO_FLUX + 1);

  -- Overflow is determined for both fluxes in parallel to the selection, not after it.
  cut_d  <= resize(cut_md, CUT_W) when merged = '1' else cut_cd;
  cut_q  <= resize(cut_mq, CUT_W) when merged = '1' else cut_cq;
  past_d <= exceeds(cut_md, PU_W) when merged = '1' else exceeds(cut_cd, PU_W);
  past_q <= exceeds(cut_mq, PU_W) when merged = '1' else exceeds(cut_cq, PU_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: lambda = the selected flux, narrowed
      if valid(0) = '1' then
        lambda_d <= narrowed(cut_d, past_d, PU_W);
        lambda_q <= narrowed(cut_q, past_q, PU_W);
        past_d_1 <= past_d;
        past_q_1 <= past_q;
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
