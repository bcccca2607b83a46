-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: winding resistance from its temperature, paper 000 eq. (12), and the resistive flux drop of half a sample.
--   r = r_s + tcr*(temp_winding - t_0);  rho = r*t_s/2;  minus_rho = -rho
-- Without a valid reading (temp_valid = 0, or outside t_min to t_max) r = r_s and temp_lost is 1.
-- Formats: temperatures S(9,6), tcr U(-6,30), t_s U(-1,18), r_s, r U(0,24), rho U(-2,24); products exact.
-- Latency: 8.  Interval: 8.
-- Rounding: each product half up.  r saturates, rho cannot: it is below 1/4.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity winding_resistance is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    temp_winding : in  signed(15 downto 0);
    temp_valid   : in  std_logic;
    r_s          : in  unsigned(RESISTANCE_W - 1 downto 0);
    tcr          : in  unsigned(23 downto 0);
    t_0          : in  signed(15 downto 0);
    t_min        : in  signed(15 downto 0);
    t_max        : in  signed(15 downto 0);
    t_s          : in  unsigned(SAMPLE_TIME_W - 1 downto 0);
    out_valid    : out std_logic;
    r            : out unsigned(RESISTANCE_W - 1 downto 0);
    rho          : out unsigned(RHO_W - 1 downto 0);
    minus_rho    : out signed(MINUS_RHO_W - 1 downto 0);
    temp_lost    : out std_logic
  );
end entity winding_resistance;

architecture rtl of winding_resistance is
  constant LATENCY : positive := WINDING_RESISTANCE_LATENCY;

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid    : std_logic_vector(0 to LATENCY);
  signal by_tcr   : signed(tcr'length downto 0);
  signal by_t_s   : signed(SAMPLE_TIME_W downto 0);
  signal wide_r_s : signed(RESISTANCE_W downto 0);
  signal lost_0   : std_logic;
  signal warmer_1 : signed(16 downto 0);
  signal moved_4  : signed(RESISTANCE_W + 6 downto 0);
  signal r_4      : unsigned(RESISTANCE_W - 1 downto 0);
  signal by_r_4   : signed(RESISTANCE_W downto 0);
  signal rho_7    : signed(RHO_W + 2 downto 0);

  -- a < b with one carry chain: a comparison with a constant setting would otherwise become a tree of LUTs.
  function below (a : signed; b : signed) return std_logic is
    variable room : signed(a'length downto 0);
  begin
    room := resize(a, a'length + 1) - resize(b, a'length + 1);
    return room(room'high);
  end function;
begin
  valid(0) <= in_valid;
  by_tcr   <= signed('0' & tcr);
  by_t_s   <= signed('0' & t_s);
  wide_r_s <= signed('0' & r_s);
  by_r_4   <= signed('0' & r_4);

  lost_0 <= (not temp_valid) or below(temp_winding, t_min) or below(t_max, temp_winding);

  -- Stages 2 to 4: moved = r_s + tcr*warmer
  heating : entity work.multiply_add
    generic map (DROP => WINDING_RESISTANCE_DROP_TCR)
    port map (clk => clk, a => by_tcr, b => warmer_1, c => wide_r_s, y => moved_4, limited => open);

  r_4 <= saturate_u(moved_4, RESISTANCE_W);

  -- Stages 5 to 7: rho = r*t_s/2
  half_sample : entity work.multiply_add
    generic map (DROP => WINDING_RESISTANCE_DROP_RHO)
    port map (clk => clk, a => by_r_4, b => by_t_s, c => NOTHING, y => rho_7, limited => open);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: warmer = temp_winding - t_0, zero without a valid reading
      warmer_1 <= resize(temp_winding, 17) - t_0;
      if lost_0 = '1' then
        warmer_1 <= (others => '0');
      end if;

      -- Stage 5: r = moved, limited
      if valid(4) = '1' then
        r <= r_4;
      end if;

      -- Stage 8: rho, below 1/4, and its negative
      if valid(7) = '1' then
        rho       <= unsigned(rho_7(RHO_W - 1 downto 0));
        minus_rho <= resize(-rho_7, MINUS_RHO_W);
        temp_lost <= lost_0;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
