-- Purpose: three phase currents to the stator frame, amplitude-invariant; no zero-sum is assumed.
--   i_alpha = (2*i_a - i_b - i_c) / 3
--   i_beta  = (i_b - i_c) / sqrt(3)
-- Formats: sums exact; 1/3 as S(0,-1,18), 1/sqrt(3) as S(0,0,17); PU out.
-- Latency: 5 (beta, then alpha through one multiplier).  Interval: 2.
-- i_a is needed a clock after i_b and i_c; i_beta is valid a clock before i_alpha, with out_soon.
-- Rounding: half up, limited to +-1.375 per unit, so that park needs no limiter; the base is the measuring range of
-- the sensor.  A product is below 4 per unit.

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
    out_soon  : out std_logic;
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
  signal second_0 : signed(SUM_W - 1 downto 0);
  signal sum_0    : signed(SUM_W downto 0);
  signal both_1   : signed(SUM_W - 1 downto 0);
  signal sum_1    : signed(SUM_W - 1 downto 0);
  signal factor_1 : signed(PU_W - 1 downto 0);
  signal prod_2   : signed(PROD_W - 1 downto 0);
  signal half_2   : signed(CLARKE_DROP_ALPHA + PU_W downto 0);
  signal sum_3    : signed(CLARKE_DROP_ALPHA + PU_W downto 0);
  signal wide_3   : signed(PU_W downto 0);
  signal i_3      : signed(PU_W - 1 downto 0);

  -- The limits are multiples of 1/8, so the bits from 1/8 up show whether x is beyond them.
  function limited (x : signed(PU_W downto 0)) return signed is
    constant HIGHEST : signed(PU_W - 1 downto 0)    := to_signed(CLARKE_VECTOR - 1, PU_W);
    constant EIGHTHS : signed(PU_W downto PU_W - 5) := x(PU_W downto PU_W - 5);
    constant MOST    : positive                     := CLARKE_VECTOR / 2 ** (PU_W - 5);
  begin
    if EIGHTHS >= MOST then
      return HIGHEST;
    elsif EIGHTHS < -MOST then
      return not HIGHEST;
    end if;
    return x(PU_W - 1 downto 0);
  end function;
begin
  valid(0) <= in_valid;

  -- The component of this clock: beta while in_valid, then alpha
  first_0  <= shift_left(resize(i_a, SUM_W), 1) when valid(1) = '1' else resize(i_b, SUM_W);
  second_0 <= both_1 when valid(1) = '1' else resize(i_c, SUM_W);

  -- first - second with a carry input: yosys would map a plain difference in front of the multiplier to the DSP48's
  -- pre-adder and lose the signs of the operands
  sum_0 <= (first_0 & '1') + ((not second_0) & '1');

  half_2 <= half(CLARKE_DROP_ALPHA, half_2'length) when valid(3) = '1' else half(CLARKE_DROP_BETA, half_2'length);
  wide_3 <= sum_3(CLARKE_DROP_ALPHA + PU_W downto CLARKE_DROP_ALPHA) when valid(4) = '1' else
            sum_3(CLARKE_DROP_BETA + PU_W downto CLARKE_DROP_BETA);
  i_3    <= limited(wide_3);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: sum = i_b - i_c, then 2*i_a - (i_b + i_c)
      if valid(0) = '1' then
        both_1 <= resize(i_b, SUM_W) + i_c;
      end if;
      if valid(0) = '1' or valid(1) = '1' then
        sum_1    <= sum_0(SUM_W downto 1);
        factor_1 <= resize(CLARKE_INV_SQRT3, PU_W);
        if valid(1) = '1' then
          factor_1 <= resize(CLARKE_THIRD, PU_W);
        end if;
      end if;

      -- Stages 2, 3: prod = sum * coefficient
      if valid(1) = '1' or valid(2) = '1' then
        prod_2 <= sum_1 * factor_1;
      end if;

      -- Stages 3, 4: prod plus half an LSB for the rounding
      if valid(2) = '1' or valid(3) = '1' then
        sum_3 <= prod_2(sum_3'range) + half_2;
      end if;

      -- Stages 4, 5: i_beta, then i_alpha, limited
      if valid(3) = '1' then
        i_beta <= i_3;
      end if;
      if valid(4) = '1' then
        i_alpha <= i_3;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - 1);
  out_valid <= valid(LATENCY);

end architecture rtl;
