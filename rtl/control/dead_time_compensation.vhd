-- Purpose: compensation voltage for dead time and device drops, stator frame, paper 000 section V.B; alpha, then beta.
--   u_comp_alpha = v_comp*s_alpha;  u_comp_beta = v_comp*s_beta
-- Formats: v_comp V_LEG, the rest PU; products exact.
-- Latency: 4 (alpha, then beta).  Interval: 4.
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
  constant LATENCY : positive := DEAD_TIME_COMPENSATION_LATENCY;
  constant DROP    : positive := DEAD_TIME_COMPENSATION_DROP;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal s_1       : signed(PU_W - 1 downto 0);
  signal prod_2    : signed(V_LEG_W + PU_W - 1 downto 0);
  signal rounded_2 : signed(V_LEG_W + PU_W - DROP downto 0);
begin
  valid(0) <= in_valid;

  rounded_2 <= round_half_up(prod_2, DROP);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: prod = v_comp * s
      if valid(0) = '1' or valid(1) = '1' then
        s_1 <= s_beta when valid(1) = '1' else s_alpha;
      end if;
      if valid(1) = '1' or valid(2) = '1' then
        prod_2 <= v_comp * s_1;
      end if;

      -- Stage 3: u_comp = prod, narrowed; alpha at clock 3, beta at 4
      if valid(2) = '1' then
        u_comp_alpha <= resize(rounded_2, PU_W);
      end if;
      if valid(3) = '1' then
        u_comp_beta <= resize(rounded_2, PU_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
