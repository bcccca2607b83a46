-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: merged flux linkage to the rotor frame, the rotation by -theta_me.
--   lambda_m_d =  lambda_m_alpha*cos_theta + lambda_m_beta*sin_theta
--   lambda_m_q = -lambda_m_alpha*sin_theta + lambda_m_beta*cos_theta
-- Formats, latency (6), interval (3), rounding: those of flux_rotate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_park is
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    in_valid       : in  std_logic;
    lambda_m_alpha : in  signed(FLUX_W - 1 downto 0);
    lambda_m_beta  : in  signed(FLUX_W - 1 downto 0);
    cos_theta      : in  signed(TRIG_W - 1 downto 0);
    sin_theta      : in  signed(TRIG_W - 1 downto 0);
    out_valid      : out std_logic;
    lambda_m_d     : out signed(FLUX_W - 1 downto 0);
    lambda_m_q     : out signed(FLUX_W - 1 downto 0)
  );
end entity flux_park;

architecture rtl of flux_park is
begin

  -- Rotating the swapped axes forwards is the backward rotation.
  rotation : entity work.flux_rotate
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => in_valid,
      x         => lambda_m_beta,
      y         => lambda_m_alpha,
      cos_theta => cos_theta,
      sin_theta => sin_theta,
      out_valid => out_valid,
      out_x     => lambda_m_q,
      out_y     => lambda_m_d
    );

end architecture rtl;
