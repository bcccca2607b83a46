-- Purpose: U_dc as 2**n / m, so that the modulator multiplies where it would divide.
--   1/u_dc = m * 2**n * 2**-17, m in (2**16, 2**17), n in 0..5;  m_beta = m * sqrt(3)/2
-- Method: the mantissa's reciprocal, one quotient bit a clock, beside the data path.
-- Formats: u_dc U(1,16); m, m_beta U(0,17).  Latency: 23.  Interval: 23.
-- Rounding: quotient and m_beta half up; 2**17 is stored as 2**17 - 1.  Relative error of m <= 2**-17.
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
  constant BITS    : positive := U_DC_PROCESSING_QUOTIENT_BITS;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal low_1     : std_logic;
  signal floored_1 : unsigned(U_DC_W - 1 downto 0);
  signal mantissa  : unsigned(U_DC_W - 1 downto 0);
  signal shift     : natural range 0 to U_DC_PROCESSING_N_MAX;
  signal remainder : unsigned(U_DC_W - 1 downto 0);
  signal trial     : unsigned(U_DC_W downto 0);
  signal quotient  : unsigned(BITS - 1 downto 0);
  signal dividing  : std_logic;
  signal m_21      : unsigned(RECIPROCAL_W - 1 downto 0);
  signal prod_22   : signed(2 * RECIPROCAL_W + 1 downto 0);

  -- Left shifts that bring the leading one to the mantissa's top bit.
  function leading_zeros (x : unsigned) return natural is
  begin
    for k in 0 to U_DC_PROCESSING_N_MAX - 1 loop
      if x(x'high - k) = '1' then
        return k;
      end if;
    end loop;
    return U_DC_PROCESSING_N_MAX;
  end function;
begin
  valid(0) <= in_valid;
  dividing <= or valid(2 to BITS + 1);
  trial    <= remainder & '0';

  process (clk)
    variable rounded : unsigned(BITS downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: u_dc = max(u_dc, 1/32)
      if valid(0) = '1' then
        low_1     <= '0';
        floored_1 <= u_dc;
        if u_dc < U_DC_PROCESSING_U_DC_MIN then
          low_1     <= '1';
          floored_1 <= to_unsigned(U_DC_PROCESSING_U_DC_MIN, U_DC_W);
        end if;
      end if;

      -- Stage 2: mantissa = u_dc * 2**shift, in [1, 2)
      if valid(1) = '1' then
        shift     <= leading_zeros(floored_1);
        mantissa  <= shift_left(floored_1, leading_zeros(floored_1));
        remainder <= (U_DC_W - 1 => '1', others => '0');
      end if;

      -- Stages 3 to 20: one bit of quotient = 2**34 / mantissa
      if dividing = '1' then
        quotient  <= quotient(BITS - 2 downto 0) & '0';
        remainder <= trial(U_DC_W - 1 downto 0);
        if trial >= mantissa then
          quotient  <= quotient(BITS - 2 downto 0) & '1';
          remainder <= resize(trial - mantissa, U_DC_W);
        end if;
      end if;

      -- Stage 21: m = quotient, half up, 2**17 stored as 2**17 - 1
      if valid(20) = '1' then
        rounded := ('0' & quotient) + 1;
        m_21    <= rounded(RECIPROCAL_W downto 1);
        if rounded(BITS) = '1' then
          m_21 <= (others => '1');
        end if;
      end if;

      -- Stage 22: prod = m * sqrt(3)/2
      if valid(21) = '1' then
        prod_22 <= signed('0' & m_21) * U_DC_PROCESSING_SQRT3_2;
      end if;

      -- Stage 23: m_beta = prod, narrowed; it is below m, so it fits
      if valid(22) = '1' then
        m        <= m_21;
        m_beta   <= saturate_u(round_half_up(prod_22, U_DC_PROCESSING_DROP_BETA), RECIPROCAL_W);
        n        <= to_unsigned(shift, 3);
        u_dc_low <= low_1;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
