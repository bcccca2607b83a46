-- Purpose: flux linkages from currents by the linear magnetic model, paper 001 eq. (6).
--   lambda_d = l_d*i_d + lambda_mg;  lambda_q = l_q*i_q
-- Formats: inductances U(4,20), PU in and out; products and sum exact.
-- Latency: 3.  Rounding: half up, saturated at twice the flux that full voltage makes at base speed.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity current_model is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    i_d       : in  signed(PU_W - 1 downto 0);
    i_q       : in  signed(PU_W - 1 downto 0);
    l_d       : in  unsigned(INDUCTANCE_W - 1 downto 0);
    l_q       : in  unsigned(INDUCTANCE_W - 1 downto 0);
    lambda_mg : in  signed(PU_W - 1 downto 0);
    out_valid : out std_logic;
    lambda_d  : out signed(PU_W - 1 downto 0);
    lambda_q  : out signed(PU_W - 1 downto 0)
  );
end entity current_model;

architecture rtl of current_model is
  constant LATENCY : positive := CURRENT_MODEL_LATENCY;
  constant SUM_W   : positive := PU_W + INDUCTANCE_W + 2;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal prod_d_1 : signed(PU_W + INDUCTANCE_W downto 0);
  signal prod_q_1 : signed(PU_W + INDUCTANCE_W downto 0);
  signal sum_d_2  : signed(SUM_W - 1 downto 0);
  signal sum_q_2  : signed(SUM_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod = l * i
      if valid(0) = '1' then
        prod_d_1 <= i_d * signed('0' & l_d);
        prod_q_1 <= i_q * signed('0' & l_q);
      end if;

      -- Stage 2: sum_d = prod_d + lambda_mg
      if valid(1) = '1' then
        sum_d_2 <= resize(prod_d_1, SUM_W) + shift_left(resize(lambda_mg, SUM_W), CURRENT_MODEL_DROP);
        sum_q_2 <= resize(prod_q_1, SUM_W);
      end if;

      -- Stage 3: lambda = sum, narrowed
      if valid(2) = '1' then
        lambda_d <= round_sat(sum_d_2, CURRENT_MODEL_DROP, PU_W);
        lambda_q <= round_sat(sum_q_2, CURRENT_MODEL_DROP, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
