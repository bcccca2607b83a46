-- Purpose: the speed that belongs to the chord of the flux, because the voltage vector is constant during a sample.
--   omega_chord = omega_me - k_chord*omega_me**3
-- Three products one after the other, through one multiplier.
-- Formats: PU in and out; omega_me**2 U(3,14), k_chord U(-6,23), their product U(-3,20).
-- Latency: 9.  Interval: 8.
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
  constant LATENCY : positive := CHORD_SPEED_LATENCY;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal mul_a    : signed(PU_W - 1 downto 0);
  signal mul_b    : signed(PU_W - 1 downto 0);
  signal prod     : signed(2 * PU_W - 1 downto 0);
  signal square_3 : signed(PU_W - 1 downto 0);
  signal part_6   : signed(PU_W - 1 downto 0);
  signal omega_8  : signed(PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 4, 7: the factors
      if valid(0) = '1' or valid(3) = '1' or valid(6) = '1' then
        mul_a <= omega_me;
        mul_b <= omega_me;
        if valid(3) = '1' then
          mul_a <= square_3;
          mul_b <= signed('0' & k_chord);
        elsif valid(6) = '1' then
          mul_a <= part_6;
        end if;
      end if;

      -- Stages 2, 5, 8: prod = omega_me*omega_me, square*k_chord, part*omega_me
      if valid(1) = '1' or valid(4) = '1' or valid(7) = '1' then
        prod <= mul_a * mul_b;
      end if;

      -- Stage 3: square = prod, narrowed; at most 4, so it fits
      if valid(2) = '1' then
        square_3 <= resize(round_half_up(prod, CHORD_SPEED_DROP_SQUARE), PU_W);
      end if;

      -- Stage 6: part = prod, narrowed; at most 1/16, so it fits
      if valid(5) = '1' then
        part_6 <= resize(round_half_up(prod, CHORD_SPEED_DROP_PART), PU_W);
      end if;

      -- Stage 8: a local copy of omega_me from the multiplier's operand register, because the source may be far away
      if valid(7) = '1' then
        omega_8 <= mul_b;
      end if;

      -- Stage 9: omega_chord = omega - prod, narrowed
      if valid(8) = '1' then
        omega_chord <= minus_rounded(omega_8, prod, CHORD_SPEED_DROP);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
