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

  signal valid    : std_logic_vector(0 to LATENCY);
  signal far_d    : std_logic;
  signal far_q    : std_logic;
  signal sum_md   : signed(SUM_W - 1 downto 0);                -- of the merged flux; sum_c: of the current model's
  signal sum_mq   : signed(SUM_W - 1 downto 0);
  signal sum_cd   : signed(SUM_W - 1 downto 0);
  signal sum_cq   : signed(SUM_W - 1 downto 0);
  signal cut_md   : signed(SUM_W - 1 - PU_TO_FLUX downto 0);
  signal cut_mq   : signed(SUM_W - 1 - PU_TO_FLUX downto 0);
  signal cut_cd   : signed(SUM_W - 1 - PU_TO_FLUX downto 0);
  signal cut_cq   : signed(SUM_W - 1 - PU_TO_FLUX downto 0);
  signal past_m   : std_logic_vector(1 downto 0);              -- limited: q, d
  signal past_c   : std_logic_vector(1 downto 0);
  signal past_m_1 : std_logic_vector(1 downto 0);
  signal past_c_1 : std_logic_vector(1 downto 0);
  signal merged_1 : std_logic;
  signal ended_1  : std_logic;
  signal back_d   : std_logic;                                 -- the current model's is negative
  signal back_q   : std_logic;

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
  far_d <= exceeds(model_d, FLUX_MODELS_MERGED_FLUX_W + 1);
  far_q <= exceeds(model_q, FLUX_MODELS_MERGED_FLUX_W + 1);

  -- Below 4 and 2 per unit where it counts: the sum fits.  Either sum is made and narrowed, and chosen last: a choice
  -- in front of the adder would make the longest path longer.
  sum_md    <= raised_d + resize(merged_d, SUM_W);
  sum_mq    <= raised_q + resize(merged_q, SUM_W);
  sum_cd    <= raised_d + model_d(SUM_W downto 1);
  sum_cq    <= raised_q + model_q(SUM_W downto 1);
  cut_md    <= sum_md(SUM_W - 1 downto PU_TO_FLUX);
  cut_mq    <= sum_mq(SUM_W - 1 downto PU_TO_FLUX);
  cut_cd    <= sum_cd(SUM_W - 1 downto PU_TO_FLUX);
  cut_cq    <= sum_cq(SUM_W - 1 downto PU_TO_FLUX);
  past_m(0) <= exceeds(cut_md, PU_W);
  past_m(1) <= exceeds(cut_mq, PU_W);
  past_c(0) <= far_d or exceeds(cut_cd, PU_W);
  past_c(1) <= far_q or exceeds(cut_cq, PU_W);
  back_d    <= model_d(model_d'high) when far_d = '1' else cut_cd(cut_cd'high);
  back_q    <= model_q(model_q'high) when far_q = '1' else cut_cq(cut_cq'high);

  -- The flag is not needed as early as the flux: what is behind the adder meets behind the register.
  estimate_limited <= ended_1 or (or past_m_1) when merged_1 = '1' else ended_1 or (or past_c_1);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: lambda = chosen + raised, narrowed
      if valid(0) = '1' then
        lambda_d <= narrowed(cut_md, past_m(0), cut_md(cut_md'high)) when merged = '1' else
                    narrowed(cut_cd, past_c(0), back_d);
        lambda_q <= narrowed(cut_mq, past_m(1), cut_mq(cut_mq'high)) when merged = '1' else
                    narrowed(cut_cq, past_c(1), back_q);
        ended_1  <= ended;
        merged_1 <= merged;
        past_m_1 <= past_m;
        past_c_1 <= past_c;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
