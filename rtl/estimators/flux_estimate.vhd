-- Purpose: the estimated flux linkages, paper 001 eq. (17): merged models plus the compensation.
--   lambda_d = merged_d + raised_d      where merged;  raised: lambda_pi and half an LSB of PU
--   lambda_d = model_d  + raised_d      else; q alike
-- Formats: model S(6,24), merged and raised S(2,23); the sum in FLUX with two more integer bits, out PU.
-- Latency: 1.
-- Rounding: half up to PU, by a cut: raised brings the half.  Saturated and told; a merged flux at its end
-- is told too.

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
    raised_d         : in  signed(FLUX_MODELS_MERGED_FLUX_W - 1 downto 0);
    raised_q         : in  signed(FLUX_MODELS_MERGED_FLUX_W - 1 downto 0);
    out_valid        : out std_logic;
    lambda_d         : out signed(PU_W - 1 downto 0);
    lambda_q         : out signed(PU_W - 1 downto 0);
    estimate_limited : out std_logic
  );
end entity flux_estimate;

architecture rtl of flux_estimate is
  constant LATENCY : positive := FLUX_ESTIMATE_LATENCY;
  constant SUM_W   : positive := FLUX_MODELS_MERGED_FLUX_W + 1;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal far_d     : std_logic;
  signal far_q     : std_logic;
  signal chosen_d  : signed(SUM_W - 1 downto 0);
  signal chosen_q  : signed(SUM_W - 1 downto 0);
  signal sum_d     : signed(SUM_W - 1 downto 0);
  signal sum_q     : signed(SUM_W - 1 downto 0);
  signal cut_d     : signed(SUM_W - 1 - PU_TO_FLUX downto 0);
  signal cut_q     : signed(SUM_W - 1 - PU_TO_FLUX downto 0);
  signal limited_d : std_logic;
  signal limited_q : std_logic;
  signal below_d   : std_logic;
  signal below_q   : std_logic;

  -- The cut sum, or the end of PU on the given side where it is limited.
  function narrowed (cut : signed; limited : std_logic; below : std_logic) return signed is
    variable result : signed(PU_W - 1 downto 0) := cut(PU_W - 1 downto 0);
  begin
    if limited = '1' then
      result           := (others => not below);
      result(PU_W - 1) := below;
    end if;
    return result;
  end function;
begin
  valid(0) <= in_valid;

  -- From 4 per unit on the sum, which is less than the compensation's 2 off, is past the end whatever it is.
  far_d <= exceeds(model_d, FLUX_MODELS_MERGED_FLUX_W + 1) and not merged;
  far_q <= exceeds(model_q, FLUX_MODELS_MERGED_FLUX_W + 1) and not merged;

  chosen_d <= resize(merged_d, SUM_W) when merged = '1' else model_d(SUM_W downto 1);
  chosen_q <= resize(merged_q, SUM_W) when merged = '1' else model_q(SUM_W downto 1);

  -- Below 4 and 2 per unit where it counts: the sum fits.
  sum_d     <= raised_d + chosen_d;
  sum_q     <= raised_q + chosen_q;
  cut_d     <= sum_d(SUM_W - 1 downto PU_TO_FLUX);
  cut_q     <= sum_q(SUM_W - 1 downto PU_TO_FLUX);
  limited_d <= far_d or exceeds(cut_d, PU_W);
  limited_q <= far_q or exceeds(cut_q, PU_W);
  below_d   <= model_d(model_d'high) when far_d = '1' else cut_d(cut_d'high);
  below_q   <= model_q(model_q'high) when far_q = '1' else cut_q(cut_q'high);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: lambda = chosen + raised, narrowed
      if valid(0) = '1' then
        lambda_d         <= narrowed(cut_d, limited_d, below_d);
        lambda_q         <= narrowed(cut_q, limited_q, below_q);
        estimate_limited <= ended or limited_d or limited_q;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
