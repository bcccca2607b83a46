-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: compensation voltage for dead time and device drops, stator frame, paper 000 section V.B.
--   u_comp_alpha = v_comp*s_alpha;  u_comp_beta = v_comp*s_beta
-- One pipeline for both components: alpha, then beta a clock later.
-- Formats: v_comp V_LEG, the rest PU; products exact.
-- Latency: 5 (alpha, then beta).  Interval: 4.
-- Rounding: half up.  No saturation: |s| <= 4/3 and v_comp < 1/2.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity dead_time_compensation is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    v_comp       : in  signed(V_LEG_W - 1 downto 0);
    s_alpha      : in  signed(PU_W - 1 downto 0);
    s_beta       : in  signed(PU_W - 1 downto 0);
    out_valid    : out std_logic;
    u_comp_alpha : out signed(PU_W - 1 downto 0);
    u_comp_beta  : out signed(PU_W - 1 downto 0)
  );
end entity dead_time_compensation;

architecture rtl of dead_time_compensation is
  constant LATENCY  : positive := DEAD_TIME_COMPENSATION_LATENCY;
  constant RESULT_W : positive := V_LEG_W + PU_W + 2 - DEAD_TIME_COMPENSATION_DROP;  -- nothing to saturate

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid    : std_logic_vector(0 to LATENCY);
  signal s_0      : signed(PU_W - 1 downto 0);
  signal u_comp_3 : signed(RESULT_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The component that enters: alpha, then beta
  s_0 <= s_beta when valid(1) = '1' else s_alpha;

  -- Stages 1 to 3: u_comp = v_comp*s
  compensation : entity work.multiply_add
    generic map (DROP => DEAD_TIME_COMPENSATION_DROP)
    port map (clk => clk, a => v_comp, b => s_0, c => NOTHING, y => u_comp_3, limited => open);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 4, 5: u_comp_alpha, then u_comp_beta
      if valid(3) = '1' then
        u_comp_alpha <= resize(u_comp_3, PU_W);
      end if;
      if valid(4) = '1' then
        u_comp_beta <= resize(u_comp_3, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
