-- Purpose: the winding's resistance, and the flux that it takes away in half a sample.
--   r = r_s;  rho = r_s*t_s/2
-- Both start from the one register, so they cannot contradict each other.
-- Formats: r_s, r, rho U(0,24); t_s U(-1,18); product exact.
-- Latency: 2.  Rounding: half up.  No overflow: rho < 1/4.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity winding_resistance is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    r_s       : in  unsigned(RESISTANCE_W - 1 downto 0);
    t_s       : in  unsigned(SAMPLE_TIME_W - 1 downto 0);
    out_valid : out std_logic;
    r         : out unsigned(RESISTANCE_W - 1 downto 0);
    rho       : out unsigned(RESISTANCE_W - 1 downto 0)
  );
end entity winding_resistance;

architecture rtl of winding_resistance is
  constant LATENCY : positive := WINDING_RESISTANCE_LATENCY;

  signal valid  : std_logic_vector(0 to LATENCY);
  signal prod_1 : signed(RESISTANCE_W + SAMPLE_TIME_W + 1 downto 0);
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod = r_s * t_s
      if valid(0) = '1' then
        prod_1 <= signed('0' & r_s) * signed('0' & t_s);
      end if;

      -- Stage 2: r = r_s,  rho = prod/2, narrowed
      if valid(1) = '1' then
        r   <= r_s;
        rho <= resize(unsigned(round_half_up(prod_1, WINDING_RESISTANCE_DROP)), RESISTANCE_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
