-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: 1/omega_me for delta_lambda, fading out towards standstill.
--   factor * 2**n_omega = weight/omega_me;  weight = limit((|omega_me| - omega_min)*k_ramp, 0, 1)
-- Formats: |omega_me| U(1,16), at least 2**-12 in the reciprocal; k_ramp U(12,4), weight U(1,16), factor S(0,17).
-- Latency: 24.  Interval: 24, as the quotient of the reciprocal needs one clock per bit.
-- Rounding: weight and |factor| half up.  |omega_me| = 2 is replaced by the next smaller number; factor fits.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity speed_reciprocal is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    omega_me  : in  signed(PU_W - 1 downto 0);
    omega_min : in  unsigned(16 downto 0);
    k_ramp    : in  unsigned(15 downto 0);
    out_valid : out std_logic;
    factor    : out signed(RECIPROCAL_W downto 0);
    n_omega   : out unsigned(3 downto 0)
  );
end entity speed_reciprocal;

architecture rtl of speed_reciprocal is
  constant LATENCY  : positive := SPEED_RECIPROCAL_LATENCY;
  constant WEIGHT_W : positive := DUTY_W;
  constant RAMP_W   : positive := U_DC_W + k_ramp'length + 3 - SPEED_RECIPROCAL_DROP_WEIGHT;

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid       : std_logic_vector(0 to LATENCY);
  signal size_0      : unsigned(PU_W - 1 downto 0);
  signal magnitude_1 : unsigned(U_DC_W - 1 downto 0);
  signal above_2     : signed(U_DC_W downto 0);
  signal by_k_ramp   : signed(k_ramp'length downto 0);
  signal ramp_5      : signed(RAMP_W - 1 downto 0);
  signal weight_6    : unsigned(WEIGHT_W - 1 downto 0);
  signal m_22        : unsigned(RECIPROCAL_W - 1 downto 0);
  signal prod_23     : unsigned(RECIPROCAL_W + WEIGHT_W - 1 downto 0);
  signal rounded_23  : signed(RECIPROCAL_W downto 0);
begin
  valid(0)  <= in_valid;
  by_k_ramp <= signed('0' & k_ramp);

  inverse : entity work.reciprocal
    generic map (
      N_MAX => SPEED_RECIPROCAL_N_MAX
    )
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => valid(1),
      x         => magnitude_1,
      out_valid => open,
      m         => m_22,
      n         => n_omega,
      low       => open
    );

  -- Stages 3 to 5: ramp = above*k_ramp
  fading : entity work.multiply_add
    generic map (DROP => SPEED_RECIPROCAL_DROP_WEIGHT)
    port map (clk => clk, a => above_2, b => by_k_ramp, c => NOTHING, y => ramp_5, limited => open);

  size_0 <= magnitude(omega_me);

  -- m*weight < 1, so it fits.
  rounded_23 <= resize(round_half_up(signed('0' & prod_23), SPEED_RECIPROCAL_DROP_FACTOR), RECIPROCAL_W + 1);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: magnitude = min(|omega_me|, the largest number below 2)
      if valid(0) = '1' then
        magnitude_1 <= saturate_u(signed('0' & size_0), U_DC_W);
      end if;

      -- Stage 2: above = magnitude - omega_min; in parallel, 2 to 22: the reciprocal
      above_2 <= signed('0' & magnitude_1) - signed('0' & omega_min);

      -- Stage 6: weight = ramp, limited to 0 and 1
      weight_6 <= unsigned(ramp_5(WEIGHT_W - 1 downto 0));
      if ramp_5 < 0 then
        weight_6 <= (others => '0');
      elsif ramp_5(RAMP_W - 2 downto WEIGHT_W - 1) /= 0 then
        weight_6 <= to_unsigned(SPEED_RECIPROCAL_WEIGHT_ONE, WEIGHT_W);
      end if;

      -- Stage 23: prod = m*weight
      prod_23 <= m_22 * weight_6;

      -- Stage 24: factor = prod, rounded, with the sign of omega_me
      if valid(23) = '1' then
        factor <= negated(rounded_23, omega_me(omega_me'high));
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
