-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: estimated torque, paper 001 eq. (4).
--   torque = lambda_d*i_q - lambda_q*i_d        per unit of 3/2*p*lambda_base*I_base
-- Formats: PU in and out; products and difference exact.
-- Latency: 5.  Rounding: half up, saturated at 2 per unit; flux and current both at their bases give 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity torque is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    lambda_d  : in  signed(PU_W - 1 downto 0);
    lambda_q  : in  signed(PU_W - 1 downto 0);
    i_d       : in  signed(PU_W - 1 downto 0);
    i_q       : in  signed(PU_W - 1 downto 0);
    out_valid : out std_logic;
    torque    : out signed(PU_W - 1 downto 0)
  );
end entity torque;

architecture rtl of torque is
  constant LATENCY : positive := TORQUE_LATENCY;
  constant PROD_W  : positive := 2 * PU_W + 1;

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid    : std_logic_vector(0 to LATENCY);
  signal prod_d_3 : signed(PROD_W - 1 downto 0);
  signal prod_q_3 : signed(PROD_W - 1 downto 0);
  signal diff_4   : signed(PROD_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- Stages 1 to 3: prod_d = lambda_d*i_q;  prod_q = lambda_q*i_d
  product_d : entity work.multiply_add
    generic map (DROP => 0)
    port map (clk => clk, a => lambda_d, b => i_q, c => NOTHING, y => prod_d_3, limited => open);

  product_q : entity work.multiply_add
    generic map (DROP => 0)
    port map (clk => clk, a => lambda_q, b => i_d, c => NOTHING, y => prod_q_3, limited => open);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 4: diff = prod_d - prod_q
      diff_4 <= prod_d_3 - prod_q_3;

      -- Stage 5: torque = diff, narrowed
      if valid(4) = '1' then
        torque <= round_sat(diff_4, TORQUE_DROP, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
