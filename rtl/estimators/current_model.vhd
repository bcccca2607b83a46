-- Purpose: flux linkages from currents by the linear magnetic model, paper 001 eq. (6).
--   lambda_c_d = l_d*i_d + lambda_mg + lambda_add_d
--   lambda_c_q = l_q*i_q             + lambda_add_q
-- lambda_add is the correction of eq. (16), zero in every other mode.
-- Formats: inductances U(4,20), currents and lambda_mg PU, lambda_add and results FLUX; products and sums exact.
-- Latency: 3.  Rounding: half up, saturated at 2 per unit, twice the flux that full voltage makes at base speed;
-- model_limited tells it.

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
    i_d           : in  signed(PU_W - 1 downto 0);
    i_q           : in  signed(PU_W - 1 downto 0);
    lambda_add_d  : in  signed(FLUX_W - 1 downto 0);
    lambda_add_q  : in  signed(FLUX_W - 1 downto 0);
    l_d           : in  unsigned(INDUCTANCE_W - 1 downto 0);
    l_q           : in  unsigned(INDUCTANCE_W - 1 downto 0);
    lambda_mg     : in  signed(PU_W - 1 downto 0);
    out_valid     : out std_logic;
    lambda_c_d    : out signed(FLUX_W - 1 downto 0);
    lambda_c_q    : out signed(FLUX_W - 1 downto 0);
    model_limited : out std_logic
  );
end entity current_model;

architecture rtl of current_model is
  constant LATENCY  : positive := CURRENT_MODEL_LATENCY;
  constant SHIFT_MG : natural  := CURRENT_MODEL_SHIFT_MG - CURRENT_MODEL_SHIFT_ADD;
  constant SUM_W    : positive := PU_W + INDUCTANCE_W + 2;

  signal valid       : std_logic_vector(0 to LATENCY);
  signal prod_d_1    : signed(PU_W + INDUCTANCE_W downto 0);
  signal prod_q_1    : signed(PU_W + INDUCTANCE_W downto 0);
  signal base_d_1    : signed(FLUX_W downto 0);
  signal base_q_1    : signed(FLUX_W downto 0);
  signal sum_d_2     : signed(SUM_W - 1 downto 0);
  signal sum_q_2     : signed(SUM_W - 1 downto 0);
  signal rounded_d_2 : signed(SUM_W - CURRENT_MODEL_DROP downto 0);
  signal rounded_q_2 : signed(SUM_W - CURRENT_MODEL_DROP downto 0);
begin
  valid(0) <= in_valid;

  rounded_d_2 <= round_half_up(sum_d_2, CURRENT_MODEL_DROP);
  rounded_q_2 <= round_half_up(sum_q_2, CURRENT_MODEL_DROP);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod = l * i,  base_d = lambda_mg + lambda_add_d,  base_q = lambda_add_q
      if valid(0) = '1' then
        prod_d_1 <= i_d * signed('0' & l_d);
        prod_q_1 <= i_q * signed('0' & l_q);
        base_d_1 <= shift_left(resize(lambda_mg, FLUX_W + 1), SHIFT_MG) + lambda_add_d;
        base_q_1 <= resize(lambda_add_q, FLUX_W + 1);
      end if;

      -- Stage 2: sum = prod + base
      if valid(1) = '1' then
        sum_d_2 <= prod_d_1 + shift_left(resize(base_d_1, SUM_W), CURRENT_MODEL_SHIFT_ADD);
        sum_q_2 <= prod_q_1 + shift_left(resize(base_q_1, SUM_W), CURRENT_MODEL_SHIFT_ADD);
      end if;

      -- Stage 3: lambda_c = sum, narrowed
      if valid(2) = '1' then
        lambda_c_d    <= saturate(rounded_d_2, FLUX_W);
        lambda_c_q    <= saturate(rounded_q_2, FLUX_W);
        model_limited <= exceeds(rounded_d_2, FLUX_W) or exceeds(rounded_q_2, FLUX_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
