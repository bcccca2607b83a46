-- Purpose: three phase currents to the stator frame, amplitude-invariant; no zero-sum is assumed.
--   i_alpha = (2*i_a - i_b - i_c) / 3
--   i_beta  = (i_b - i_c) / sqrt(3)
-- Formats: sums exact; 1/3 as S(0,-1,18), 1/sqrt(3) as S(0,0,17); PU out.
-- Latency: 4 (alpha and beta follow each other through one multiplier).  Interval: 2.
-- Rounding: half up, saturated: 8/3 per unit needs three currents against each other.

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

  constant SUM_W  : positive := PU_W + 2;
  constant PROD_W : positive := SUM_W + PU_W;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal first_0  : signed(SUM_W - 1 downto 0);
  signal sum_1    : signed(SUM_W - 1 downto 0);
  signal factor_1 : signed(PU_W - 1 downto 0);
  signal prod_2   : signed(PROD_W - 1 downto 0);
  signal half_2   : signed(PROD_W - 1 downto 0);
  signal sum_2    : signed(PROD_W - 1 downto 0);
  signal i_2      : signed(PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The component of the beat: alpha while in_valid, then beta
  first_0 <= resize(i_b, SUM_W) when valid(1) = '1' else
             shift_left(resize(i_a, SUM_W), 1) - i_b;

  -- Rounded in the multiplier's adder
  half_2 <= half(CLARKE_DROP_ALPHA, PROD_W) when valid(2) = '1' else half(CLARKE_DROP_BETA, PROD_W);
  sum_2  <= prod_2 + half_2;
  i_2    <= saturate(shift_right(sum_2, CLARKE_DROP_ALPHA), PU_W) when valid(2) = '1' else
            saturate(shift_right(sum_2, CLARKE_DROP_BETA), PU_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: sum = 2*i_a - i_b - i_c, then i_b - i_c
      if valid(0) = '1' or valid(1) = '1' then
        sum_1    <= first_0 - i_c;
        factor_1 <= resize(CLARKE_THIRD, PU_W);
        if valid(1) = '1' then
          factor_1 <= resize(CLARKE_INV_SQRT3, PU_W);
        end if;
      end if;

      -- Stage 2: prod = sum * coefficient
      if valid(1) = '1' or valid(2) = '1' then
        prod_2 <= sum_1 * factor_1;
      end if;

      -- Stage 3, 4: i = prod, narrowed; alpha at clock 3, beta at 4
      if valid(2) = '1' then
        i_alpha <= i_2;
      end if;
      if valid(3) = '1' then
        i_beta <= i_2;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
