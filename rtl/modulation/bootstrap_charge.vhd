-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: charges the bootstrap capacitors of the upper gate drivers before the drive switches.
--   charging = 1 (all lower switches on) until charge_samples sample times after the gates went on
--   charged  = 1 (the regulators run) one sample time later, as without this block;  charge_samples = 0: always
-- Once charged, a new setting waits until the gates have been off.
-- Formats: sample times.  Latency: 1 (every clock is a sample).  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fluxproof_pkg.all;

entity bootstrap_charge is
  port (
    clk            : in  std_logic;
    rst            : in  std_logic;
    gates_on       : in  std_logic;
    period         : in  std_logic;
    charge_samples : in  unsigned(BOOTSTRAP_CHARGE_CHARGE_W - 1 downto 0);
    charging       : out std_logic;
    charged        : out std_logic
  );
end entity bootstrap_charge;

architecture rtl of bootstrap_charge is
  type state_t is record
    count : unsigned(BOOTSTRAP_CHARGE_CHARGE_W - 1 downto 0);  -- sample times since the gates went on
    done  : std_logic;
  end record state_t;

  signal state : state_t;
begin

  process (clk)
    variable count : unsigned(BOOTSTRAP_CHARGE_CHARGE_W - 1 downto 0);
    variable done  : std_logic;
  begin
    if rising_edge(clk) then
      count := state.count;
      done  := state.done;
      if gates_on = '0' then
        count := (others => '0');
        done  := '0';
      elsif (period and not done) = '1' then
        if count >= charge_samples then
          done := '1';
        else
          count := count + 1;
        end if;
      end if;
      state.count <= count;
      state.done  <= done;

      charging <= '0';
      if count < charge_samples then
        charging <= not done;
      end if;
      charged <= done or (nor charge_samples);

      if rst = '1' then
        state.count <= (others => '0');
        state.done  <= '0';
        charging    <= '0';
        charged     <= '0';
      end if;
    end if;
  end process;

end architecture rtl;
