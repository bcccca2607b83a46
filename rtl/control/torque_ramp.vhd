-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the torque reference with a limited change per sample, so that both currents move along the table's curves.
--   torque_now moves to torque_ref by torque_step in a sample at most;  zero with run = 0
-- Formats: PU.  Latency: 1.  Rounding: none; limited.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity torque_ramp is
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    in_valid    : in  std_logic;
    torque_ref  : in  signed(PU_W - 1 downto 0);
    run         : in  std_logic;
    torque_step : in  signed(PU_W - 1 downto 0);
    out_valid   : out std_logic;
    torque_now  : out signed(PU_W - 1 downto 0)
  );
end entity torque_ramp;

architecture rtl of torque_ramp is
begin
  process (clk)
    variable change : signed(PU_W downto 0);
    variable past   : std_logic;
    variable sum    : signed(PU_W downto 0);
  begin
    if rising_edge(clk) then
      out_valid <= in_valid;

      -- Stage 1: torque_now += torque_ref - torque_now, limited
      change := resize(torque_ref, PU_W + 1) - torque_now;
      past   := beyond(change, unsigned(torque_step), 0);
      if past = '1' then  -- a negative limit is the complement plus one, which the adder adds
        change := resize(torque_step, PU_W + 1) xor change(PU_W);
      end if;
      sum := resize((torque_now & '1') + (change & (past and change(PU_W))), PU_W + 1);
      if in_valid = '1' then
        torque_now <= sum(PU_W downto 1);
        if run = '0' then
          torque_now <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        out_valid  <= '0';
        torque_now <= (others => '0');
      end if;
    end if;
  end process;

end architecture rtl;
