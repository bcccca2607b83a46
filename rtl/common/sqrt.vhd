-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: square root by table and chord, never above the true root.
--   x = mantissa * 4**-shift, mantissa in [1/4, 1);  root = (BASE + SLOPE*rest) * 2**-shift
-- Formats: x U(0,32); mantissa cut to 20 bits, 8 of address and 12 of rest; base, slope U(0,18); root U(0,16).
-- Base and slope share one word of a block RAM.  The table contains both doubled as well, for an even shift, so that
-- the shift behind it is always odd.
-- Latency: 5.  Rounding: every step floors, so the result errs downwards only; no saturation is reachable.

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
  signal small_0    : std_logic;
  signal small_1    : std_logic;
  signal byte_1     : std_logic;
  signal upper_1    : unsigned(1 downto 0);
  signal lower_1    : unsigned(1 downto 0);
  signal pairs_1    : unsigned(1 downto 0);
  signal x_1        : unsigned(31 downto 0);
  signal mantissa_1 : unsigned(19 downto 0);
  signal address_1  : unsigned(8 downto 0);
  signal chord_2    : unsigned(SQRT_BASE_BITS + SQRT_SLOPE_BITS - 1 downto 0);
  signal rest_2     : unsigned(SQRT_REST_BITS - 1 downto 0);
  signal shift_2    : unsigned(2 downto 0);
  signal base_3     : unsigned(SQRT_BASE_BITS - 1 downto 0);
  signal slope_3    : unsigned(SQRT_SLOPE_BITS - 1 downto 0);
  signal rest_3     : unsigned(SQRT_REST_BITS - 1 downto 0);
  signal shift_3    : unsigned(2 downto 0);
  signal prod_4     : signed(SQRT_SLOPE_BITS + SQRT_REST_BITS + 1 downto 0);
  signal base_4     : unsigned(SQRT_BASE_BITS - 1 downto 0);
  signal shift_4    : unsigned(2 downto 0);
  signal fine_4     : signed(SQRT_BASE_BITS + SQRT_REST_BITS downto 0);
  signal root_5     : unsigned(U_MAX_W - 1 downto 0);
  signal shift_5    : std_logic;

  -- The number of leading pairs of zeros of a byte, 3 if the byte is zero.
  function zero_pairs (byte : unsigned) return unsigned is
    alias b : unsigned(7 downto 0) is byte;
  begin
    return (nor b(7 downto 4)) & ((nor b(7 downto 6)) and ((or b(5 downto 4)) or (nor b(3 downto 2))));
  end function;
begin
  valid(0) <= in_valid;
  small_0  <= nor x(31 downto 16);
  pairs_1  <= lower_1 when byte_1 = '1' else upper_1;

  mantissa_1 <= resize(shift_right(shift_left(x_1, to_integer(byte_1 & pairs_1 & '0')), SQRT_DROP_X), 20);
  address_1  <= pairs_1(0) & mantissa_1(19 downto SQRT_REST_BITS);

  fine_4 <= prod_4 + shift_left(signed(resize(base_4, fine_4'length)), SQRT_REST_BITS);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: shift by 16 if the upper half is zero;  then whether the first byte is zero, and the leading zero
      -- pairs of this byte and of the next
      if valid(0) = '1' then
        x_1     <= x;
        small_1 <= small_0;
        byte_1  <= nor x(31 downto 24);
        upper_1 <= zero_pairs(x(31 downto 24));
        lower_1 <= zero_pairs(x(23 downto 16));
        if small_0 = '1' then
          x_1     <= shift_left(x, 16);
          byte_1  <= nor x(15 downto 8);
          upper_1 <= zero_pairs(x(15 downto 8));
          lower_1 <= zero_pairs(x(7 downto 0));
        end if;
      end if;

      -- Stage 2: mantissa = x * 4**shift, cut to 20 bits;  base, slope from the table
      if valid(1) = '1' then
        chord_2 <= SQRT_CHORD(to_integer(address_1));
        rest_2  <= mantissa_1(SQRT_REST_BITS - 1 downto 0);
        shift_2 <= small_1 & byte_1 & pairs_1(1);
      end if;

      -- Stage 3: a register for base and slope, because a block RAM's output arrives late in its clock
      if valid(2) = '1' then
        base_3  <= chord_2(chord_2'high downto SQRT_SLOPE_BITS);
        slope_3 <= chord_2(SQRT_SLOPE_BITS - 1 downto 0);
        rest_3  <= rest_2;
        shift_3 <= shift_2;
      end if;

      -- Stage 4: prod = slope * rest
      if valid(3) = '1' then
        prod_4  <= signed('0' & slope_3) * signed('0' & rest_3);
        base_4  <= base_3;
        shift_4 <= shift_3;
      end if;

      -- Stage 5: root = fine * 2**-shift, floored, with fine = base + prod; here the shift by multiples of four bits
      if valid(4) = '1' then
        root_5  <= resize(shift_right(unsigned(fine_4(fine_4'high - 1 downto SQRT_REST_BITS + SQRT_DROP_OUT + 1)),
                                      to_integer(shift_4(2 downto 1) & "00")), U_MAX_W);
        shift_5 <= shift_4(0);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  -- The rest of the shift, after the register
  root      <= shift_right(root_5, 2) when shift_5 = '1' else root_5;
  out_valid <= valid(LATENCY);

end architecture rtl;
