-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the flux linkages of this sample by both models, for flux_estimate and current_model.
--   model_d  = l_d*i_d + lambda_mg,  model_q = l_q*i_q          paper 001 eq. (6)
--   merged_d = lambda_m_d - rho*i_d;  likewise for q            eq. (11)
-- merged selects the merged flux (voltage known and a merge selected by flux_mode), otherwise the current model.
-- ended: the selected merged flux is at the end of its range, because the rotation before has saturated.
-- Formats: currents and lambda_mg PU, lambda_m FLUX; model S(6,36), merged S(2,40), both exact.
-- Latency: 4; i_q is needed a clock after in_valid, lambda_m two.  Interval: 4.
-- Rounding: none.  No saturation: |model| < 34 and |merged| < 2.5.

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
    ended       : out std_logic
  );
end entity flux_models;

architecture rtl of flux_models is
  constant LATENCY  : positive := FLUX_MODELS_LATENCY;
  constant MODEL_W  : positive := FLUX_MODELS_MODEL_FLUX_W;
  constant MERGED_W : positive := FLUX_MODELS_MERGED_FLUX_W;

  signal valid         : std_logic_vector(0 to LATENCY);
  signal i_d_2         : signed(PU_W - 1 downto 0);
  signal i_q_2         : signed(PU_W - 1 downto 0);
  signal l_d_2         : signed(INDUCTANCE_W downto 0);
  signal l_q_2         : signed(INDUCTANCE_W downto 0);
  signal minus_rho_2   : signed(MINUS_RHO_W - 1 downto 0);
  signal times_l_d     : signed(PU_W + INDUCTANCE_W downto 0);
  signal times_l_q     : signed(PU_W + INDUCTANCE_W downto 0);
  signal times_rho_d   : signed(PU_W + MINUS_RHO_W - 1 downto 0);
  signal times_rho_q   : signed(PU_W + MINUS_RHO_W - 1 downto 0);
  signal prod_model_d  : signed(PU_W + INDUCTANCE_W downto 0);
  signal prod_model_q  : signed(PU_W + INDUCTANCE_W downto 0);
  signal prod_merged_d : signed(PU_W + MINUS_RHO_W - 1 downto 0);
  signal prod_merged_q : signed(PU_W + MINUS_RHO_W - 1 downto 0);
  signal use_merged    : std_logic;

  -- '1' if x is the largest or the smallest number: all bits differ from the sign.
  function at_end (x : signed) return std_logic is
    alias v : signed(x'length - 1 downto 0) is x;
  begin
    return and (v(v'high - 1 downto 0) xor v(v'high));
  end function;
begin
  valid(0) <= in_valid;

  -- Outside the clocked process, so that a simulator computes them only when an operand changes.
  times_l_d   <= i_d_2 * l_d_2;
  times_l_q   <= i_q_2 * l_q_2;
  times_rho_d <= i_d_2 * minus_rho_2;
  times_rho_q <= i_q_2 * minus_rho_2;

  use_merged <= merge_known and run when flux_mode /= FLUX_MODELS_CURRENT_MODEL else '0';

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 2: the operands in the registers of the multipliers; i_q comes a clock after i_d
      i_d_2       <= i_d;
      i_q_2       <= i_q;
      l_d_2       <= signed('0' & l_d);
      l_q_2       <= signed('0' & l_q);
      minus_rho_2 <= minus_rho;

      -- Stage 3: prod_model = l*i;  prod_merged = -rho*i
      prod_model_d  <= times_l_d;
      prod_model_q  <= times_l_q;
      prod_merged_d <= times_rho_d;
      prod_merged_q <= times_rho_q;

      -- Stage 4: model = prod_model, for d plus lambda_mg;  merged = lambda_m + prod_merged
      if valid(3) = '1' then
        model_d  <= shift_left(resize(lambda_mg, MODEL_W), FLUX_MODELS_SHIFT_MG) + prod_model_d;
        model_q  <= resize(prod_model_q, MODEL_W);
        merged_d <= shift_left(resize(lambda_m_d, MERGED_W), FLUX_MODELS_DROP_MERGED) + prod_merged_d;
        merged_q <= shift_left(resize(lambda_m_q, MERGED_W), FLUX_MODELS_DROP_MERGED) + prod_merged_q;
        merged   <= use_merged;
        ended    <= use_merged and (at_end(lambda_m_d) or at_end(lambda_m_q));
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
