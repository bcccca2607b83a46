-- Purpose: U_dc as 2**n / m, so that the modulator multiplies where it would divide.
--   1/u_dc = m * 2**n * 2**-17, see reciprocal;  m_beta = m * sqrt(3)/2
-- Formats: u_dc U(1,16); m, m_beta U(0,17).  Latency: 23.  Interval: 23.
-- Rounding: m as reciprocal makes it, m_beta half up.
-- Below 1/32 per unit the bus is taken for 1/32 and u_dc_low is raised.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity u_dc_processing is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    u_dc      : in  unsigned(U_DC_W - 1 downto 0);
    out_valid : out std_logic;
    m         : out unsigned(RECIPROCAL_W - 1 downto 0);
    m_beta    : out unsigned(RECIPROCAL_W - 1 downto 0);
    n         : out unsigned(2 downto 0);
    u_dc_low  : out std_logic
  );
end entity u_dc_processing;

architecture rtl of u_dc_processing is
  constant LATENCY : positive := U_DC_PROCESSING_LATENCY;

  signal valid   : std_logic_vector(0 to LATENCY);
  signal m_21    : unsigned(RECIPROCAL_W - 1 downto 0);
  signal n_21    : unsigned(3 downto 0);
  signal low_21  : std_logic;
  signal prod_22 : signed(2 * RECIPROCAL_W + 1 downto 0);
begin
  valid(0) <= in_valid;

  -- Stages 1 to 21: m, n, low
  inverse : entity work.reciprocal
    generic map (
      N_MAX => U_DC_PROCESSING_N_MAX
    )
    port map (
      clk       => clk,
      rst       => rst,
      in_valid  => in_valid,
      x         => u_dc,
      out_valid => open,
      m         => m_21,
      n         => n_21,
      low       => low_21
    );

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 22: prod = m * sqrt(3)/2
      if valid(21) = '1' then
        prod_22 <= signed('0' & m_21) * U_DC_PROCESSING_SQRT3_2;
      end if;

      -- Stage 23: m_beta = prod, narrowed; it is below m, so it fits
      if valid(22) = '1' then
        m        <= m_21;
        m_beta   <= saturate_u(round_half_up(prod_22, U_DC_PROCESSING_DROP_BETA), RECIPROCAL_W);
        n        <= n_21(2 downto 0);
        u_dc_low <= low_21;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
