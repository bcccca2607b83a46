-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: rotational voltages, the last term of paper 001 eq. (2), added to the current regulators' outputs.
--   u_dec_d = -omega_chord*lambda_q;  u_dec_q = omega_chord*lambda_d
-- Formats: PU in and out; products exact.
-- Latency: 2.  Rounding: half up, saturated at 2 per unit, twice the largest voltage of the limiter.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity decoupling is
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    in_valid    : in  std_logic;
    omega_chord : in  signed(PU_W - 1 downto 0);
    lambda_d    : in  signed(PU_W - 1 downto 0);
    lambda_q    : in  signed(PU_W - 1 downto 0);
    out_valid   : out std_logic;
    u_dec_d     : out signed(PU_W - 1 downto 0);
    u_dec_q     : out signed(PU_W - 1 downto 0)
  );
end entity decoupling;

architecture rtl of decoupling is
  constant LATENCY : positive := DECOUPLING_LATENCY;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal prod_d_1 : signed(2 * PU_W - 1 downto 0);
  signal prod_q_1 : signed(2 * PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod_d = omega_chord*lambda_q,  prod_q = omega_chord*lambda_d
      if valid(0) = '1' then
        prod_d_1 <= omega_chord * lambda_q;
        prod_q_1 <= omega_chord * lambda_d;
      end if;

      -- Stage 2: u_dec_d = -prod_d,  u_dec_q = prod_q, narrowed
      if valid(1) = '1' then
        u_dec_d <= saturate(minus_half_up(prod_d_1, DECOUPLING_DROP), PU_W);
        u_dec_q <= round_sat(prod_q_1, DECOUPLING_DROP, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
