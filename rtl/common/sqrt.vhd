-- Purpose: square root by table and chord, never above the true root.
--   x = mantissa * 4**-shift, mantissa in [1/4, 1);  root = (BASE + SLOPE*rest) * 2**-shift
-- Formats: x U(0,32); mantissa cut to 20 bits, 8 of address and 12 of rest; tables U(0,18); root U(0,16).
-- Latency: 6.  Rounding: every step floors, so the result errs downwards only; no saturation is reachable.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity sqrt is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    x         : in  unsigned(31 downto 0);
    out_valid : out std_logic;
    root      : out unsigned(U_MAX_W - 1 downto 0)
  );
end entity sqrt;

architecture rtl of sqrt is
  constant LATENCY : positive := SQRT_LATENCY;

  signal valid      : std_logic_vector(0 to LATENCY);
  signal x_1        : unsigned(31 downto 0);
  signal shift_1    : unsigned(3 downto 0);
  signal mantissa_2 : unsigned(19 downto 0);
  signal shift_2    : unsigned(3 downto 0);
  signal base_3     : unsigned(17 downto 0);
  signal slope_3    : unsigned(9 downto 0);
  signal rest_3     : unsigned(11 downto 0);
  signal shift_3    : unsigned(3 downto 0);
  signal prod_4     : unsigned(21 downto 0);
  signal base_4     : unsigned(17 downto 0);
  signal shift_4    : unsigned(3 downto 0);
  signal fine_5     : unsigned(17 downto 0);
  signal shift_5    : unsigned(3 downto 0);

  -- Pairs of leading zeros.
  function leading_pairs (v : unsigned(31 downto 0)) return natural is
  begin
    for k in 0 to 14 loop
      if v(31 - 2 * k) = '1' or v(30 - 2 * k) = '1' then
        return k;
      end if;
    end loop;
    return 15;
  end function;
begin
  valid(0) <= in_valid;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: shift = pairs of leading zeros
      if valid(0) = '1' then
        x_1     <= x;
        shift_1 <= to_unsigned(leading_pairs(x), 4);
      end if;

      -- Stage 2: mantissa = x * 4**shift, cut to 20 bits
      if valid(1) = '1' then
        mantissa_2 <= resize(shift_right(shift_left(x_1, to_integer(shift_1 & '0')), SQRT_DROP_X), 20);
        shift_2    <= shift_1;
      end if;

      -- Stage 3: base, slope from the table
      if valid(2) = '1' then
        base_3  <= SQRT_BASE(to_integer(mantissa_2(19 downto SQRT_REST_BITS)));
        slope_3 <= SQRT_SLOPE(to_integer(mantissa_2(19 downto SQRT_REST_BITS)));
        rest_3  <= mantissa_2(SQRT_REST_BITS - 1 downto 0);
        shift_3 <= shift_2;
      end if;

      -- Stage 4: prod = slope * rest
      if valid(3) = '1' then
        prod_4  <= slope_3 * rest_3;
        base_4  <= base_3;
        shift_4 <= shift_3;
      end if;

      -- Stage 5: fine = base + prod, floored
      if valid(4) = '1' then
        fine_5  <= base_4 + prod_4(21 downto SQRT_REST_BITS);
        shift_5 <= shift_4;
      end if;

      -- Stage 6: root = fine * 2**-shift, floored
      if valid(5) = '1' then
        root <= resize(shift_right(shift_right(fine_5, to_integer(shift_5)), SQRT_DROP_OUT), U_MAX_W);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
