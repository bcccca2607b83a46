-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the voltage against the answer of regulators and decoupling to the ripple of over-modulation.
--   rip_dq  = park(rip_alphabeta)
--   u_rip_d =  k_ripple*rip_d + omega_me*rip_q
--   u_rip_q = -omega_me*rip_d + k_ripple*rip_q
-- Formats: PU; |rip| < 1/4, factors below 2.
-- Latency: 10.  Interval: 9.
-- Rounding: both steps half up, as rotate.  No saturation.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity ripple_voltage is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    rip_alpha : in  signed(PU_W - 1 downto 0);
    rip_beta  : in  signed(PU_W - 1 downto 0);
    cos_theta : in  signed(TRIG_W - 1 downto 0);
    sin_theta : in  signed(TRIG_W - 1 downto 0);
    omega_me  : in  signed(PU_W - 1 downto 0);
    k_ripple  : in  signed(PU_W - 1 downto 0);
    out_valid : out std_logic;
    u_rip_d   : out signed(PU_W - 1 downto 0);
    u_rip_q   : out signed(PU_W - 1 downto 0)
  );
end entity ripple_voltage;

architecture rtl of ripple_voltage is
  signal turned_5     : std_logic;
  signal rip_d, rip_q : signed(PU_W - 1 downto 0);
begin

  -- Stages 1 to 5: the ripple in the rotor frame
  rotor_frame : entity work.park
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => in_valid,
      i_alpha   => rip_alpha,
      i_beta    => rip_beta,
      cos_theta => cos_theta,
      sin_theta => sin_theta,
      out_soon  => open,
      out_valid => turned_5,
      i_d       => rip_d,
      i_q       => rip_q
    );

  -- Stages 6 to 10: times k_ripple - j*omega_me, a rotation with these for cosine and sine
  answer : entity work.park
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => turned_5,
      i_alpha   => rip_d,
      i_beta    => rip_q,
      cos_theta => k_ripple,
      sin_theta => omega_me,
      out_soon  => open,
      out_valid => out_valid,
      i_d       => u_rip_d,
      i_q       => u_rip_q
    );

end architecture rtl;
