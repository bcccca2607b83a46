-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: switches the brake resistor with hysteresis on the bus voltage.
--   brake_asked = 1 from u_dc >= brake_on until u_dc < brake_off;  brake_on = 0: no chopper
-- It does not depend on the gates: a motor that is driven feeds the bus through the diodes.
-- Formats: limits U(1,8).
-- Latency: 1.  Interval: 1.  Rounding: u_dc is cut (floor) to the limits' format: up to 1/256 late.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity brake_chopper is
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    in_valid    : in  std_logic;
    u_dc        : in  unsigned(DUTY_W - 1 downto 0);
    brake_on    : in  unsigned(LIMIT_W - 1 downto 0);
    brake_off   : in  unsigned(LIMIT_W - 1 downto 0);
    out_valid   : out std_logic;
    brake_asked : out std_logic
  );
end entity brake_chopper;

architecture rtl of brake_chopper is
  type state_t is record
    brake : std_logic;
  end record state_t;

  signal state : state_t;

  signal bus_0 : unsigned(LIMIT_W - 1 downto 0);
begin
  bus_0 <= u_dc(DUTY_W - 1 downto DUTY_W - LIMIT_W);

  process (clk)
  begin
    if rising_edge(clk) then
      out_valid <= in_valid;

      -- Stage 1: on, off, or as before
      if in_valid = '1' then
        if bus_0 >= brake_on then
          state.brake <= or brake_on;
        elsif bus_0 < brake_off then
          state.brake <= '0';
        end if;
      end if;

      if rst = '1' then
        out_valid   <= '0';
        state.brake <= '0';
      end if;
    end if;
  end process;

  brake_asked <= state.brake;

end architecture rtl;
