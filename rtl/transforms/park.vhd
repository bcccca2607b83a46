-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: stator frame to rotor frame, the rotation by -theta_me.
--   i_d =  i_alpha*cos_theta + i_beta*sin_theta
--   i_q = -i_alpha*sin_theta + i_beta*cos_theta
-- Formats, latency (5), interval (4), rounding: those of rotate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity park is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    i_alpha   : in  signed(PU_W - 1 downto 0);
    i_beta    : in  signed(PU_W - 1 downto 0);
    cos_theta : in  signed(TRIG_W - 1 downto 0);
    sin_theta : in  signed(TRIG_W - 1 downto 0);
    out_soon  : out std_logic;
    out_valid : out std_logic;
    i_d       : out signed(PU_W - 1 downto 0);
    i_q       : out signed(PU_W - 1 downto 0)
  );
end entity park;

architecture rtl of park is
begin

  -- Rotating the swapped axes forwards is the backward rotation.
  rotation : entity work.rotate
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => in_valid,
      x         => i_beta,
      y         => i_alpha,
      cos_theta => cos_theta,
      sin_theta => sin_theta,
      out_soon  => out_soon,
      out_valid => out_valid,
      out_x     => i_q,
      out_y     => i_d
    );

end architecture rtl;
