-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the speed that belongs to the chord of the flux, because the voltage vector is constant during a sample.
--   omega_chord = omega_me - k_chord*omega_me**3
--   square = 4*omega_me*omega_me,  part = 8*square*k_chord,  shorter = part*omega_me,  each cut by the same 20 bits
-- One pipeline for the three products, one after the other.
-- Formats: PU in and out; omega_me**2 U(3,14), k_chord U(-6,23), their product U(-3,20).
-- Latency: 10.  Interval: 10.
-- Rounding: every product half up.  No saturation: k_chord*omega_me**2 < 1/16, so the result keeps its sign.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity chord_speed is
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    in_valid    : in  std_logic;
    omega_me    : in  signed(PU_W - 1 downto 0);
    k_chord     : in  unsigned(16 downto 0);
    out_valid   : out std_logic;
    omega_chord : out signed(PU_W - 1 downto 0)
  );
end entity chord_speed;

architecture rtl of chord_speed is
  constant LATENCY   : positive := CHORD_SPEED_LATENCY;
  constant FACTOR_W  : positive := PU_W + CHORD_SPEED_RAISE_PART;
  constant PRODUCT_W : positive := FACTOR_W + PU_W + 2 - CHORD_SPEED_DROP;  -- nothing to saturate

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid     : std_logic_vector(0 to LATENCY);
  signal raised_0  : signed(FACTOR_W - 1 downto 0);
  signal raised_3  : signed(FACTOR_W - 1 downto 0);
  signal factor_0  : signed(FACTOR_W - 1 downto 0);
  signal by_0      : signed(PU_W - 1 downto 0);
  signal product_3 : signed(PRODUCT_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The product that enters: square, part with the square of three clocks before, shorter with the part
  raised_0 <= shift_left(resize(omega_me, FACTOR_W), CHORD_SPEED_RAISE_SQUARE);
  raised_3 <= shift_left(resize(product_3, FACTOR_W), CHORD_SPEED_RAISE_PART);
  factor_0 <= chosen(raised_0, chosen(raised_3, resize(product_3, FACTOR_W), valid(3)), valid(0));
  by_0     <= chosen(signed('0' & k_chord), omega_me, valid(3));

  -- Stages 1 to 3: square;  4 to 6: part;  7 to 9: shorter
  product : entity work.multiply_add
    generic map (DROP => CHORD_SPEED_DROP)
    port map (clk => clk, a => factor_0, b => by_0, c => NOTHING, y => product_3, limited => open);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 10: omega_chord = omega_me - shorter
      if valid(9) = '1' then
        omega_chord <= resize(difference(omega_me, resize(product_3, PU_W)), PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
