-- Purpose: flux linkages from currents by the linear magnetic model, paper 001 eq. (6); d first, then q.
--   lambda_c_d = l_d*i_d + lambda_mg + lambda_add_d = model_d + (lambda_add_d - raised_d)
--   lambda_c_q = l_q*i_q             + lambda_add_q = model_q + (lambda_add_q - raised_q)
-- model comes from flux_models and includes the compensation of the estimate, which is subtracted again here, where
-- there is time for it.  lambda_add is the correction of eq. (16), zero in every other mode.
-- Formats: model S(6,24), raised S(2,23); lambda_add and results FLUX; sums exact.
-- Latency: 5 (d, then q).  Interval: 4.
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
    raised_d      : in  signed(FLUX_MODELS_RAISED_W - 1 downto 0);
    raised_q      : in  signed(FLUX_MODELS_RAISED_W - 1 downto 0);
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
  constant SUM_W   : positive := FLUX_MODELS_MODEL_FLUX_W;
  constant REST_W  : positive := FLUX_MODELS_RAISED_W + 1;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal add_0     : signed(REST_W - 1 downto 0);
  signal raised_0  : signed(REST_W - 1 downto 0);
  signal rest_1    : signed(REST_W - 1 downto 0);
  signal model_1   : signed(SUM_W - 1 downto 0);
  signal sum_2     : signed(SUM_W - 1 downto 0);
  signal rounded_3 : signed(SUM_W - 2 downto 0);
begin
  valid(0) <= in_valid;

  -- The axis of this clock: d, then q
  add_0    <= resize(lambda_add_q, REST_W) when valid(1) = '1' else resize(lambda_add_d, REST_W);
  raised_0 <= resize(raised_q, REST_W) when valid(1) = '1' else resize(raised_d, REST_W);
  model_1  <= model_q when valid(2) = '1' else model_d;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: rest = lambda_add - raised
      if valid(0) = '1' or valid(1) = '1' then
        rest_1 <= add_0 - raised_0;
      end if;

      -- Stage 2: sum = model + rest; below 37 per unit, so it fits
      if valid(1) = '1' or valid(2) = '1' then
        sum_2 <= (rest_1 & '0') + model_1;
      end if;

      -- Stage 3: sum, rounded
      if valid(2) = '1' or valid(3) = '1' then
        rounded_3 <= resize(round_half_up(sum_2, 1), SUM_W - 1);
      end if;

      -- Stage 4: lambda_c = sum, narrowed; d at clock 4, shifted on from q's register, q at 5
      if valid(3) = '1' or valid(4) = '1' then
        lambda_c_q    <= saturate(rounded_3, FLUX_W);
        lambda_c_d    <= lambda_c_q;
        model_limited <= exceeds(rounded_3, FLUX_W) or (model_limited and valid(4));
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
