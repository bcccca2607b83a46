-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: resolver or encoder code to electrical angle, theta_me = pole_pairs*code + theta_offset, modulo one turn.
-- Formats: code of POSITION_BITS, left-aligned in TURN U(0,18); reverse = 1 inverts the sense of rotation.
-- Latency: 2.  Rounding: none; every operation is modulo one turn, because angles wrap (slices drop whole turns).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity position is
  generic (
    POSITION_BITS : positive range 8 to 18 := 16
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    code_theta   : in  unsigned(POSITION_BITS - 1 downto 0);
    reverse      : in  std_logic;
    pole_pairs   : in  unsigned(5 downto 0);
    theta_offset : in  unsigned(TURN_W - 1 downto 0);
    out_valid    : out std_logic;
    theta_me     : out unsigned(TURN_W - 1 downto 0)
  );
end entity position;

architecture rtl of position is
  constant LATENCY : positive := POSITION_LATENCY;

  signal valid  : std_logic_vector(0 to LATENCY);
  signal prod_1 : unsigned(POSITION_BITS + 5 downto 0);
  signal turn_1 : unsigned(TURN_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  turn_1   <= shift_left(resize(prod_1, TURN_W), TURN_W - POSITION_BITS);

  process (clk)
    variable sum : unsigned(TURN_W downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod = pole_pairs * code
      if valid(0) = '1' then
        prod_1 <= code_theta * pole_pairs;
      end if;

      -- Stage 2: theta_me = theta_offset +- prod, modulo one turn
      if valid(1) = '1' then
        -- -turn_1 = not turn_1 + 1
        sum      := (theta_offset & reverse) + ((turn_1 xor (turn_1'range => reverse)) & reverse);
        theta_me <= sum(TURN_W downto 1);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
