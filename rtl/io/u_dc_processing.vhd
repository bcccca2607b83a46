-- Purpose: U_dc as 2**n / m, so that the modulator multiplies instead of dividing.
--   inverse = 1/u_dc = m * 2**n * 2**-17, see reciprocal
--   inverse_beta = m_beta * 2**n * 2**-17,  m_beta = m * sqrt(3)/2
-- Formats: u_dc U(1,16); m, m_beta U(0,17); inverse, inverse_beta U(5,17).  Latency: 27.  Interval: 27.
-- Rounding: m as in reciprocal, m_beta half up; the shift by n, two bits per clock, loses nothing.
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

  signal valid   : std_logic_vector(0 to LATENCY);
  signal m_21    : unsigned(RECIPROCAL_W - 1 downto 0);
  signal n_21    : unsigned(3 downto 0);
  signal low_21  : std_logic;
  signal prod_22 : signed(2 * RECIPROCAL_W + 1 downto 0);
  signal prod_23 : signed(2 * RECIPROCAL_W + 1 downto 0);
  signal by_two  : std_logic;
  signal by_one  : std_logic;
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

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 22: prod = m * sqrt(3)/2
      if valid(21) = '1' then
        prod_22 <= signed('0' & m_21) * U_DC_PROCESSING_SQRT3_2;
      end if;

      -- Stage 23: prod plus half an LSB of m_beta for the rounding
      if valid(22) = '1' then
        prod_23 <= prod_22 + half(U_DC_PROCESSING_DROP_BETA, prod_22'length);
      end if;

      -- Stage 24: m, m_beta = prod, narrowed; m_beta is below m, so it fits.  Stages 25 to 27: inverse = m * 2**n
      if valid(23) = '1' then
        inverse      <= resize(m_21, INVERSE_W);
        inverse_beta <= resize(unsigned(shift_right(prod_23, U_DC_PROCESSING_DROP_BETA)), INVERSE_W);
        u_dc_low     <= low_21;
      elsif by_two = '1' then
        inverse      <= shift_left(inverse, 2);
        inverse_beta <= shift_left(inverse_beta, 2);
      elsif by_one = '1' then
        inverse      <= shift_left(inverse, 1);
        inverse_beta <= shift_left(inverse_beta, 1);
      end if;

      -- Shift by n, at most 5: twice by two, once by one; each selection is registered a clock before its use
      by_two <= (valid(23) and n_21(2)) or (valid(24) and (n_21(2) or n_21(1)));
      by_one <= valid(25) and n_21(0);

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
