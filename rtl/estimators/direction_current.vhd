-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the current whose directions are compensated: in position mode the reference in the stator frame, while the
-- regulators follow it, else the measured current.  A current of zero has no direction, its reference has.
--   towards_alpha = i_d_ref*cos_theta - i_q_ref*sin_theta
--   towards_beta  = i_d_ref*sin_theta + i_q_ref*cos_theta
-- Formats: references limited to the range of a rotation, otherwise those of rotate.
-- Latency: 7.  Interval: 7.
-- Rounding: as rotate; the references saturate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity direction_current is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    in_valid      : in  std_logic;
    i_d_ref       : in  signed(PU_W - 1 downto 0);
    i_q_ref       : in  signed(PU_W - 1 downto 0);
    i_alpha       : in  signed(PU_W - 1 downto 0);
    i_beta        : in  signed(PU_W - 1 downto 0);
    cos_theta     : in  signed(TRIG_W - 1 downto 0);
    sin_theta     : in  signed(TRIG_W - 1 downto 0);
    sat_d         : in  signed(1 downto 0);
    sat_q         : in  signed(1 downto 0);
    run           : in  std_logic;
    position_mode : in  std_logic;
    out_valid     : out std_logic;
    towards_alpha : out signed(PU_W - 1 downto 0);
    towards_beta  : out signed(PU_W - 1 downto 0)
  );
end entity direction_current;

architecture rtl of direction_current is
  constant MOST : signed(PU_W - 1 downto 0) := to_signed(DIRECTION_CURRENT_MOST, PU_W);

  signal valid_1 : std_logic;
  signal i_d_1   : signed(PU_W - 1 downto 0);
  signal i_q_1   : signed(PU_W - 1 downto 0);
  signal valid_6 : std_logic;
  signal alpha_6 : signed(PU_W - 1 downto 0);
  signal beta_6  : signed(PU_W - 1 downto 0);
begin

  rotation : entity work.rotate
    port map (clk => clk, rst => rst, in_valid => valid_1,
              x => i_d_1, y => i_q_1, cos_theta => cos_theta, sin_theta => sin_theta,
              out_soon => open, out_valid => valid_6, out_x => alpha_6, out_y => beta_6);

  process (clk)
  begin
    if rising_edge(clk) then
      -- Stage 1: references within the range of a rotation
      valid_1 <= in_valid;
      if in_valid = '1' then
        i_d_1 <= clamp(i_d_ref, -MOST - 1, MOST);
        i_q_1 <= clamp(i_q_ref, -MOST - 1, MOST);
      end if;

      -- Stage 7: the reference where the current follows it
      out_valid <= valid_6;
      if valid_6 = '1' then
        towards_alpha <= alpha_6;
        towards_beta  <= beta_6;
        if position_mode = '0' or run = '0' or sat_d /= 0 or sat_q /= 0 then
          towards_alpha <= i_alpha;
          towards_beta  <= i_beta;
        end if;
      end if;

      if rst = '1' then
        valid_1   <= '0';
        out_valid <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
