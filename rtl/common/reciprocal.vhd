-- Purpose: 1/x as m * 2**n, the division that no data path contains.
--   1/x = m * 2**n * 2**-17, m in (2**16, 2**17), n in 0..N_MAX
-- Method: x is brought to [1, 2) by n shifts; its reciprocal is made one quotient bit a clock.
-- Formats: x U(1,16); m U(0,17).  Latency: 21.  Interval: 21.
-- Rounding: quotient half up; 2**17 is stored as 2**17 - 1.  Relative error of m <= 2**-17.
-- Below 2**-N_MAX x is taken for 2**-N_MAX and low is raised.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity reciprocal is
  generic (
    N_MAX : positive range 1 to 15 := 5
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    x         : in  unsigned(U_DC_W - 1 downto 0);
    out_valid : out std_logic;
    m         : out unsigned(RECIPROCAL_W - 1 downto 0);
    n         : out unsigned(3 downto 0);
    low       : out std_logic
  );
end entity reciprocal;

architecture rtl of reciprocal is
  constant LATENCY : positive                      := RECIPROCAL_LATENCY;
  constant BITS    : positive                      := RECIPROCAL_QUOTIENT_BITS;
  constant LEAST   : unsigned(U_DC_W - 1 downto 0) := shift_left(to_unsigned(1, U_DC_W), U_DC_W - 1 - N_MAX);

  signal valid     : std_logic_vector(0 to LATENCY);
  signal low_1     : std_logic;
  signal floored_1 : unsigned(U_DC_W - 1 downto 0);
  signal mantissa  : unsigned(U_DC_W - 1 downto 0);
  signal shift     : natural range 0 to N_MAX;
  signal remainder : unsigned(U_DC_W - 1 downto 0);
  signal trial     : unsigned(U_DC_W downto 0);
  signal rest      : unsigned(U_DC_W downto 0);
  signal quotient  : unsigned(BITS - 1 downto 0);
  signal dividing  : std_logic;

  -- Left shifts that bring the leading one to the mantissa's top bit.
  function leading_zeros (v : unsigned) return natural is
  begin
    for k in 0 to N_MAX - 1 loop
      if v(v'high - k) = '1' then
        return k;
      end if;
    end loop;
    return N_MAX;
  end function;
begin
  valid(0) <= in_valid;
  dividing <= or valid(2 to BITS + 1);
  trial    <= remainder & '0';
  rest     <= trial - mantissa;

  process (clk)
    variable rounded : unsigned(BITS downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: x = max(x, 2**-N_MAX)
      if valid(0) = '1' then
        low_1     <= '0';
        floored_1 <= x;
        if x < LEAST then
          low_1     <= '1';
          floored_1 <= LEAST;
        end if;
      end if;

      -- Stage 2: mantissa = x * 2**shift, in [1, 2)
      if valid(1) = '1' then
        shift     <= leading_zeros(floored_1);
        mantissa  <= shift_left(floored_1, leading_zeros(floored_1));
        remainder <= (U_DC_W - 1 => '1', others => '0');
      end if;

      -- Stages 3 to 20: one bit of quotient = 2**34 / mantissa
      if dividing = '1' then
        quotient  <= quotient(BITS - 2 downto 0) & not rest(U_DC_W);
        remainder <= trial(U_DC_W - 1 downto 0);
        if rest(U_DC_W) = '0' then
          remainder <= rest(U_DC_W - 1 downto 0);
        end if;
      end if;

      -- Stage 21: m = quotient, half up, 2**17 stored as 2**17 - 1
      if valid(20) = '1' then
        rounded := ('0' & quotient) + 1;
        m       <= rounded(RECIPROCAL_W downto 1);
        n       <= to_unsigned(shift, 4);
        low     <= low_1;
        if rounded(BITS) = '1' then
          m <= (others => '1');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
