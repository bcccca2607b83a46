-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the third phase current where two phases have a sensor, i_missing = -(i_x + i_y).
-- missing: 0 all three phases have a sensor, 1, 2, 3: phase a, b, c has none.  The rail flag of the missing phase is
-- cleared, since its code is no measurement.  Currents, not codes: codes have offsets and gains of their own.
-- Formats: PU.  Latency: 1.  Rounding: none; the sum saturates at 2 per unit, which still reaches any i_trip.
-- With a missing phase the sum of the three currents is zero: the check of the sum says nothing.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity third_current is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    i_a             : in  signed(PU_W - 1 downto 0);
    i_b             : in  signed(PU_W - 1 downto 0);
    i_c             : in  signed(PU_W - 1 downto 0);
    current_at_rail : in  unsigned(2 downto 0);  -- bit 0 is phase a
    missing         : in  unsigned(1 downto 0);
    out_valid       : out std_logic;
    out_a           : out signed(PU_W - 1 downto 0);
    out_b           : out signed(PU_W - 1 downto 0);
    out_c           : out signed(PU_W - 1 downto 0);
    rails           : out unsigned(2 downto 0)
  );
end entity third_current;

architecture rtl of third_current is
  signal x       : signed(PU_W - 1 downto 0);  -- the two measured currents
  signal y       : signed(PU_W - 1 downto 0);
  signal sum     : signed(PU_W downto 0);
  signal missed  : signed(PU_W - 1 downto 0);
  signal present : unsigned(2 downto 0);
begin
  x   <= i_b when missing = 1 else i_a;
  y   <= i_b when missing = 3 else i_c;
  sum <= resize(x, PU_W + 1) + y;

  -- The sum fits; its negative does not where both are the most negative number
  missed  <= saturate(-resize(sum, PU_W + 2), PU_W);
  present <= "110" when missing = 1 else "101" when missing = 2 else "011" when missing = 3 else "111";

  process (clk)
  begin
    if rising_edge(clk) then
      out_valid <= in_valid;

      -- Stage 1: the current of the missing phase
      if in_valid = '1' then
        out_a <= missed when missing = 1 else i_a;
        out_b <= missed when missing = 2 else i_b;
        out_c <= missed when missing = 3 else i_c;
        rails <= current_at_rail and present;
      end if;

      if rst = '1' then
        out_valid <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
