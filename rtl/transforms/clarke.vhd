-- Purpose: three phase currents to the stator frame, amplitude-invariant; no zero-sum is assumed.
--   i_alpha = (2*i_a - i_b - i_c) / 3
--   i_beta  = (i_b - i_c) / sqrt(3)
-- Formats: sums exact; 1/3 as S(0,-1,18), 1/sqrt(3) as S(0,0,17); PU out.
-- Latency: 3.  Rounding: half up, saturated: 8/3 per unit needs three currents against each other.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity clarke is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    i_a       : in  signed(PU_W - 1 downto 0);
    i_b       : in  signed(PU_W - 1 downto 0);
    i_c       : in  signed(PU_W - 1 downto 0);
    out_valid : out std_logic;
    i_alpha   : out signed(PU_W - 1 downto 0);
    i_beta    : out signed(PU_W - 1 downto 0)
  );
end entity clarke;

architecture rtl of clarke is
  constant LATENCY : positive := CLARKE_LATENCY;

  signal valid        : std_logic_vector(0 to LATENCY);
  signal sum_alpha_1  : signed(PU_W + 1 downto 0);
  signal sum_beta_1   : signed(PU_W downto 0);
  signal prod_alpha_2 : signed(PU_W + CLARKE_THIRD'length + 1 downto 0);
  signal prod_beta_2  : signed(PU_W + CLARKE_INV_SQRT3'length downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: sum_alpha = 2*i_a - i_b - i_c,  sum_beta = i_b - i_c
      if valid(0) = '1' then
        sum_alpha_1 <= shift_left(resize(i_a, PU_W + 2), 1) - resize(i_b, PU_W + 2) - resize(i_c, PU_W + 2);
        sum_beta_1  <= resize(i_b, PU_W + 1) - resize(i_c, PU_W + 1);
      end if;

      -- Stage 2: prod = sum * coefficient
      if valid(1) = '1' then
        prod_alpha_2 <= sum_alpha_1 * CLARKE_THIRD;
        prod_beta_2  <= sum_beta_1 * CLARKE_INV_SQRT3;
      end if;

      -- Stage 3: i = prod, narrowed
      if valid(2) = '1' then
        i_alpha <= round_sat(prod_alpha_2, CLARKE_DROP_ALPHA, PU_W);
        i_beta  <= round_sat(prod_beta_2, CLARKE_DROP_BETA, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
