-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: U_dc as 2**n / m, so that the modulator multiplies instead of dividing.
--   inverse = 1/u_dc = m * 2**n * 2**-17, see reciprocal
--   inverse_beta = m_beta * 2**n * 2**-17,  m_beta = m * sqrt(3)/2
-- One pipeline for both shifts by n: m, then m_beta a clock later.
-- Formats: u_dc U(1,16); m, m_beta U(0,17); inverse, inverse_beta U(5,17).  Latency: 26.  Interval: 26.
-- Rounding: m as in reciprocal, m_beta half up; the shift by n loses nothing.
-- A bus voltage below 1/32 per unit is replaced by 1/32 and u_dc_low is 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity u_dc_processing is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    u_dc         : in  unsigned(U_DC_W - 1 downto 0);
    out_valid    : out std_logic;
    inverse      : out unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
    inverse_beta : out unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
    u_dc_low     : out std_logic
  );
end entity u_dc_processing;

architecture rtl of u_dc_processing is
  constant LATENCY   : positive := U_DC_PROCESSING_LATENCY;
  constant INVERSE_W : positive := U_DC_PROCESSING_INVERSE_W;

  constant SQRT3_2 : signed(RECIPROCAL_W downto 0) := resize(U_DC_PROCESSING_SQRT3_2, RECIPROCAL_W + 1);
  constant BETA_W  : positive                      := RECIPROCAL_W + 2;  -- nothing to saturate
  constant PART_W  : positive                      := RECIPROCAL_W + 3;

  constant NOTHING : signed(0 downto 0) := "0";

  signal valid       : std_logic_vector(0 to LATENCY);
  signal m_21        : unsigned(RECIPROCAL_W - 1 downto 0);
  signal n_21        : unsigned(3 downto 0);
  signal low_21      : std_logic;
  signal factor_21   : signed(RECIPROCAL_W downto 0);
  signal m_beta_24   : signed(BETA_W - 1 downto 0);
  signal mantissa_23 : unsigned(RECIPROCAL_W - 1 downto 0);
  signal part_24     : unsigned(PART_W - 1 downto 0);
  signal whole_24    : unsigned(INVERSE_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- Stages 1 to 21: m, n, low
  mantissa : entity work.reciprocal
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

  factor_21 <= signed('0' & m_21);

  -- Stages 22 to 24: m_beta = m * sqrt(3)/2;  it is below m, so it fits
  beta_part : entity work.multiply_add
    generic map (DROP => U_DC_PROCESSING_DROP_BETA)
    port map (clk => clk, a => factor_21, b => SQRT3_2, c => NOTHING, y => m_beta_24, limited => open);

  -- The mantissa that enters: m, then m_beta;  m, n and low stay until the next sample
  mantissa_23 <= unsigned(m_beta_24(RECIPROCAL_W - 1 downto 0)) when valid(24) = '1' else m_21;

  -- n is at most 5
  whole_24 <= shift_left(resize(part_24, INVERSE_W), 4) when n_21(2) = '1' else resize(part_24, INVERSE_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 24, 25: part = mantissa * 2**(n mod 4)
      part_24 <= shift_left(resize(mantissa_23, PART_W), to_integer(n_21(1 downto 0)));

      -- Stages 25, 26: inverse, then inverse_beta = part * 2**(n - n mod 4)
      if valid(24) = '1' then
        inverse <= whole_24;
      end if;
      if valid(25) = '1' then
        inverse_beta <= whole_24;
        u_dc_low     <= low_21;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
