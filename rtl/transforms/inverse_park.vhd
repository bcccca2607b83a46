-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: rotor frame to stator frame, the rotation by theta.
--   u_alpha = u_d*cos_theta - u_q*sin_theta
--   u_beta  = u_d*sin_theta + u_q*cos_theta
-- Formats, latency (5), interval (4), rounding: those of rotate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity inverse_park is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    u_d       : in  signed(PU_W - 1 downto 0);
    u_q       : in  signed(PU_W - 1 downto 0);
    cos_theta : in  signed(TRIG_W - 1 downto 0);
    sin_theta : in  signed(TRIG_W - 1 downto 0);
    out_valid : out std_logic;
    u_alpha   : out signed(PU_W - 1 downto 0);
    u_beta    : out signed(PU_W - 1 downto 0)
  );
end entity inverse_park;

architecture rtl of inverse_park is
begin

  rotation : entity work.rotate
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => in_valid,
      x         => u_d,
      y         => u_q,
      cos_theta => cos_theta,
      sin_theta => sin_theta,
      out_soon  => open,
      out_valid => out_valid,
      out_x     => u_alpha,
      out_y     => u_beta
    );

end architecture rtl;
