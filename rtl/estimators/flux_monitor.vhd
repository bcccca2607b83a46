-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: latches the conditions that disturb the flux estimate, until they are cleared.
--   flux_faults = now or (flux_faults and not clear_faults)
--   0  a current converter at its end            4  delta_lambda at its range
--   1  bus reading at its end or below 1/32      5  compensation at delta_max
--   2  current model at its range                6  estimate, or a rotation before it, at its range
--   3  merge at its range
-- Formats: bits.  Latency: 1.  Rounding: none.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity flux_monitor is
  port (
    clk                  : in  std_logic;
    rst                  : in  std_logic;
    in_valid             : in  std_logic;
    current_at_rail      : in  unsigned(2 downto 0);
    u_dc_at_rail         : in  std_logic;
    u_dc_low             : in  std_logic;
    model_limited        : in  std_logic;
    merge_limited        : in  std_logic;
    delta_limited        : in  std_logic;
    compensation_limited : in  std_logic;
    estimate_limited     : in  std_logic;
    clear_faults         : in  std_logic;
    out_valid            : out std_logic;
    flux_faults          : out unsigned(6 downto 0)
  );
end entity flux_monitor;

architecture rtl of flux_monitor is
  constant LATENCY : positive := FLUX_MONITOR_LATENCY;

  type state_t is record
    faults : unsigned(6 downto 0);
  end record state_t;

  signal state : state_t;

  signal valid : std_logic_vector(0 to LATENCY);
  signal now_0 : unsigned(6 downto 0);
begin
  valid(0) <= in_valid;

  now_0(0) <= or current_at_rail;
  now_0(1) <= u_dc_at_rail or u_dc_low;
  now_0(2) <= model_limited;
  now_0(3) <= merge_limited;
  now_0(4) <= delta_limited;
  now_0(5) <= compensation_limited;
  now_0(6) <= estimate_limited;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: faults = now or (faults and not clear_faults)
      if valid(0) = '1' then
        state.faults <= now_0;
        if clear_faults = '0' then
          state.faults <= now_0 or state.faults;
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        state.faults        <= (others => '0');
      end if;
    end if;
  end process;

  out_valid   <= valid(LATENCY);
  flux_faults <= state.faults;

end architecture rtl;
