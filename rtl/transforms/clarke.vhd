-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: three phase currents to the stator frame, amplitude-invariant; no zero-sum is assumed.
--   i_alpha = (2*i_a - i_b - i_c) / 3
--   i_beta  = (i_b - i_c) / sqrt(3) = (2*i_b - 2*i_c) / sqrt(12)
-- One pipeline for both components: beta, then alpha a clock later.
-- Formats: sums exact; 1/3 and 1/sqrt(12) as S(0,-1,18); PU out.
-- Latency: 5 (i_a is needed a clock after i_b and i_c, i_beta is valid with out_soon).  Interval: 2.
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
  constant LATENCY  : positive := CLARKE_LATENCY;
  constant SUM_W    : positive := PU_W + 2;
  constant RESULT_W : positive := SUM_W + 1;  -- product and half an LSB, cut: nothing to saturate

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid     : std_logic_vector(0 to LATENCY);
  signal both_1    : signed(SUM_W - 2 downto 0);
  signal added_0   : signed(SUM_W - 2 downto 0);
  signal removed_0 : signed(SUM_W - 2 downto 0);
  signal sum_0     : signed(SUM_W - 1 downto 0);
  signal factor_0  : signed(PU_W - 1 downto 0);
  signal result_3  : signed(RESULT_W - 1 downto 0);
  signal i_3       : signed(PU_W - 1 downto 0);

  -- The limits are multiples of 1/8, so the bits from 1/8 up show whether x is beyond them.
  function limited (x : signed(RESULT_W - 1 downto 0)) return signed is
    constant HIGHEST : signed(PU_W - 1 downto 0)            := to_signed(CLARKE_VECTOR - 1, PU_W);
    constant EIGHTHS : signed(RESULT_W - 1 downto PU_W - 5) := x(RESULT_W - 1 downto PU_W - 5);
    constant MOST    : positive                             := CLARKE_VECTOR / 2 ** (PU_W - 5);
  begin
    if EIGHTHS >= MOST then
      return HIGHEST;
    elsif EIGHTHS < -MOST then
      return to_signed(-CLARKE_VECTOR, PU_W);
    end if;
    return x(PU_W - 1 downto 0);
  end function;
begin
  valid(0) <= in_valid;

  -- The component that enters: beta, then alpha
  added_0   <= i_a & '0' when valid(1) = '1' else i_b & '0';
  removed_0 <= both_1 when valid(1) = '1' else i_c & '0';
  factor_0  <= resize(CLARKE_THIRD, PU_W) when valid(1) = '1' else resize(CLARKE_INV_SQRT12, PU_W);
  sum_0     <= difference(added_0, removed_0);

  -- Stages 1 to 3: result = sum*factor
  component_part : entity work.multiply_add
    generic map (DROP => CLARKE_DROP)
    port map (clk => clk, a => sum_0, b => factor_0, c => NOTHING, y => result_3, limited => open);

  i_3 <= limited(result_3);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: both = i_b + i_c
      both_1 <= resize(i_b, SUM_W - 1) + i_c;

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
