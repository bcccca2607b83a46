-- Purpose: the flux linkages of this sample by both models, for flux_estimate and current_model.
--   model_d  = l_d*i_d + lambda_mg + raised_d,  model_q = l_q*i_q + raised_q      paper 001 eq. (6)
--   merged_d = lambda_m_d - rho*i_d + raised_d;  likewise for q                    eq. (11)
-- raised: lambda_pi plus half an LSB of PU.  Both models include it, so that nothing must be added after them.
-- merged selects the merged flux (voltage known and a merge selected by flux_mode), otherwise the current model.
-- ended: the selected merged flux is at the end of its range, because the rotation before has saturated.
-- Formats: currents and lambda_mg PU, fluxes FLUX; products exact; model S(6,24), merged S(3,23), raised S(2,23).
-- Latency: 4; i_q is needed a clock after in_valid, lambda_m two.  Interval: 3.
-- Rounding: floor, which does not change the rounding half up to PU; with raised, that rounding is a truncation.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_models is
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    in_valid    : in  std_logic;
    i_d         : in  signed(PU_W - 1 downto 0);
    i_q         : in  signed(PU_W - 1 downto 0);
    lambda_m_d  : in  signed(FLUX_W - 1 downto 0);
    lambda_m_q  : in  signed(FLUX_W - 1 downto 0);
    lambda_pi_d : in  signed(FLUX_W - 1 downto 0);
    lambda_pi_q : in  signed(FLUX_W - 1 downto 0);
    merge_known : in  std_logic;
    run         : in  std_logic;
    minus_rho   : in  signed(MINUS_RHO_W - 1 downto 0);
    flux_mode   : in  unsigned(1 downto 0);
    l_d         : in  unsigned(INDUCTANCE_W - 1 downto 0);
    l_q         : in  unsigned(INDUCTANCE_W - 1 downto 0);
    lambda_mg   : in  signed(PU_W - 1 downto 0);
    out_valid   : out std_logic;
    model_d     : out signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    model_q     : out signed(FLUX_MODELS_MODEL_FLUX_W - 1 downto 0);
    merged_d    : out signed(FLUX_MODELS_MERGED_FLUX_W - 1 downto 0);
    merged_q    : out signed(FLUX_MODELS_MERGED_FLUX_W - 1 downto 0);
    merged      : out std_logic;
    ended       : out std_logic;
    raised_d    : out signed(FLUX_MODELS_RAISED_W - 1 downto 0);
    raised_q    : out signed(FLUX_MODELS_RAISED_W - 1 downto 0)
  );
end entity flux_models;

architecture rtl of flux_models is
  constant LATENCY     : positive := FLUX_MODELS_LATENCY;
  constant SHIFT_MODEL : positive := FLUX_MODELS_SHIFT_MODEL;
  constant DROP_MODEL  : positive := FLUX_MODELS_DROP_MODEL;
  constant DROP_MERGED : positive := FLUX_MODELS_DROP_MERGED;
  constant PROD_W      : positive := PU_W + INDUCTANCE_W + 1;
  constant SUM_W       : positive := PROD_W + 1;
  constant BASE_W      : positive := FLUX_MODELS_MERGED_FLUX_W;
  constant PART_W      : positive := 6;
  constant PARTS       : positive := (FLUX_W + PART_W - 2) / PART_W;

  signal valid         : std_logic_vector(0 to LATENCY);
  signal i_d_2         : signed(PU_W - 1 downto 0);
  signal i_q_2         : signed(PU_W - 1 downto 0);
  signal l_d_2         : unsigned(INDUCTANCE_W - 1 downto 0);
  signal l_q_2         : unsigned(INDUCTANCE_W - 1 downto 0);
  signal minus_rho_2   : signed(MINUS_RHO_W - 1 downto 0);
  signal times_l_d     : signed(PROD_W - 1 downto 0);
  signal times_l_q     : signed(PROD_W - 1 downto 0);
  signal times_rho_d   : signed(PU_W + MINUS_RHO_W - 1 downto 0);
  signal times_rho_q   : signed(PU_W + MINUS_RHO_W - 1 downto 0);
  signal prod_model_d  : signed(PROD_W - 1 downto 0);
  signal prod_model_q  : signed(PROD_W - 1 downto 0);
  signal prod_merged_d : signed(PU_W + MINUS_RHO_W - 1 downto 0);
  signal prod_merged_q : signed(PU_W + MINUS_RHO_W - 1 downto 0);
  signal base_model_d  : signed(BASE_W - 1 downto 0);
  signal base_merged_d : signed(BASE_W - 1 downto 0);
  signal base_merged_q : signed(BASE_W - 1 downto 0);
  signal merged_3      : std_logic;
  signal ended_d_3     : std_logic_vector(PARTS - 1 downto 0);
  signal ended_q_3     : std_logic_vector(PARTS - 1 downto 0);
  signal sum_model_d   : signed(SUM_W - 1 downto 0);
  signal sum_model_q   : signed(SUM_W - 1 downto 0);
  signal sum_merged_d  : signed(SUM_W - 1 downto 0);
  signal sum_merged_q  : signed(SUM_W - 1 downto 0);

  -- '1' if x is the largest or the smallest number: all bits differ from the sign.  In parts, combined a clock later.
  function at_end (x : signed) return std_logic_vector is
    alias v         : signed(x'length - 1 downto 0) is x;
    variable result : std_logic_vector(PARTS - 1 downto 0);
  begin
    for k in result'range loop
      result(k) := and (v(minimum(PART_W * k + PART_W, v'high) - 1 downto PART_W * k) xor v(v'high));
    end loop;
    return result;
  end function;

  function raised (lambda_pi : signed) return signed is
  begin
    return resize(lambda_pi, FLUX_MODELS_RAISED_W) + FLUX_MODELS_HALF_PU;
  end function;
begin
  valid(0) <= in_valid;

  -- Outside the clocked process, so that a simulator computes them only when an operand changes.
  times_l_d   <= i_d_2 * signed('0' & l_d_2);
  times_l_q   <= i_q_2 * signed('0' & l_q_2);
  times_rho_d <= i_d_2 * minus_rho_2;
  times_rho_q <= i_q_2 * minus_rho_2;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 2: operands in the registers of the multipliers, as the currents' sources are distant; i_q comes a clock
      -- after i_d;  raised = lambda_pi + half
      i_d_2       <= i_d;
      i_q_2       <= i_q;
      l_d_2       <= l_d;
      l_q_2       <= l_q;
      minus_rho_2 <= minus_rho;
      if valid(1) = '1' then
        raised_d <= raised(lambda_pi_d);
        raised_q <= raised(lambda_pi_q);
      end if;

      -- Stage 3: prod_model = l*i;  prod_merged = -rho*i;  base: all terms that do not depend on the current
      prod_model_d  <= times_l_d;
      prod_model_q  <= times_l_q;
      prod_merged_d <= times_rho_d;
      prod_merged_q <= times_rho_q;
      if valid(2) = '1' then
        base_model_d  <= shift_left(resize(lambda_mg, BASE_W), PU_TO_FLUX) + raised_d;
        base_merged_d <= resize(lambda_m_d, BASE_W) + raised_d;
        base_merged_q <= resize(lambda_m_q, BASE_W) + raised_q;
        ended_d_3     <= at_end(lambda_m_d);
        ended_q_3     <= at_end(lambda_m_q);
        merged_3      <= '0';
        if flux_mode /= FLUX_MODELS_CURRENT_MODEL then
          merged_3 <= merge_known and run;
        end if;
      end if;

      -- Stage 4: model = base + prod_model, with base = raised for q;  merged = base + prod_merged
      if valid(3) = '1' then
        sum_model_d  <= shift_left(resize(base_model_d, SUM_W), SHIFT_MODEL) + prod_model_d;
        sum_model_q  <= shift_left(resize(raised_q, SUM_W), SHIFT_MODEL) + prod_model_q;
        sum_merged_d <= shift_left(resize(base_merged_d, SUM_W), DROP_MERGED) + prod_merged_d;
        sum_merged_q <= shift_left(resize(base_merged_q, SUM_W), DROP_MERGED) + prod_merged_q;
        merged       <= merged_3;
        ended        <= merged_3 and ((and ended_d_3) or (and ended_q_3));
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  model_d   <= sum_model_d(model_d'length - 1 + DROP_MODEL downto DROP_MODEL);
  model_q   <= sum_model_q(model_q'length - 1 + DROP_MODEL downto DROP_MODEL);
  merged_d  <= sum_merged_d(merged_d'length - 1 + DROP_MERGED downto DROP_MERGED);
  merged_q  <= sum_merged_q(merged_q'length - 1 + DROP_MERGED downto DROP_MERGED);
  out_valid <= valid(LATENCY);

end architecture rtl;
