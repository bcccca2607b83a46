-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the current model's flux linkage to the stator frame, the rotation by theta_me.
--   lambda_c_alpha = lambda_c_d*cos_theta - lambda_c_q*sin_theta
--   lambda_c_beta  = lambda_c_d*sin_theta + lambda_c_q*cos_theta
-- Formats, latency (6), interval (3), rounding: those of flux_rotate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_inverse_park is
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    in_valid       : in  std_logic;
    lambda_c_d     : in  signed(FLUX_W - 1 downto 0);
    lambda_c_q     : in  signed(FLUX_W - 1 downto 0);
    cos_theta      : in  signed(TRIG_W - 1 downto 0);
    sin_theta      : in  signed(TRIG_W - 1 downto 0);
    out_valid      : out std_logic;
    lambda_c_alpha : out signed(FLUX_W - 1 downto 0);
    lambda_c_beta  : out signed(FLUX_W - 1 downto 0)
  );
end entity flux_inverse_park;

architecture rtl of flux_inverse_park is
begin

  rotation : entity work.flux_rotate
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => in_valid,
      x         => lambda_c_d,
      y         => lambda_c_q,
      cos_theta => cos_theta,
      sin_theta => sin_theta,
      out_valid => out_valid,
      out_x     => lambda_c_alpha,
      out_y     => lambda_c_beta
    );

end architecture rtl;
