-- Purpose: the two narrowing operations of the core, twin of golden_model/fixed.py.
-- Rounding: half up (add half an output LSB, then floor).  Overflow: saturation.
-- A floor is written as a plain shift_right, a modulo as a slice, and both are named where they stand.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package fixed_pkg is

  -- x / 2**drop, halves towards plus infinity; one bit wider than x cut by drop, so it cannot overflow.
  function round_half_up (x : signed; drop : natural) return signed;

  -- Half an LSB of what stays when drop bits go: added to a product in the multiplier's own adder, it makes the
  -- cut a rounding half up.  A product of two signed numbers has room for it.
  function half (drop : positive; width : positive) return signed;

  -- x limited to the range of a signed number of width bits.
  function saturate (x : signed; width : positive) return signed;

  -- '1' where saturating x to width signed bits changes it.
  function exceeds (x : signed; width : positive) return std_logic;

  -- saturate in the clock after: x limited to width signed bits, past telling whether it exceeds them.
  function narrowed (x : signed; past : std_logic; width : positive) return signed;

  -- x limited to the range of an unsigned number of width bits.
  function saturate_u (x : signed; width : positive) return unsigned;

  -- The default narrowing: half up, then saturated to width signed bits.
  function round_sat (x : signed; drop : natural; width : positive) return signed;

  -- x limited to [lo, hi]; lo and hi must fit the width of x.
  function clamp (x : signed; lo : signed; hi : signed) return signed;

  -- a + 1 where carry = '1', which a must have room for: by the carry of one sum, from the bit below.
  function plus_carry (a : signed; carry : std_logic) return signed;

  -- a + round_half_up(v, drop) by one carry; as wide as a, which must have room for the sum.
  function plus_rounded (a : signed; v : signed; drop : positive) return signed;

  -- a - round_half_up(v, drop) by one carry; as wide as a, which must have room for the difference.
  function minus_rounded (a : signed; v : signed; drop : positive) return signed;

  -- a at the scale of a product that drops bits, with the half that rounds it, for the adder behind a multiplier:
  -- (rounding_base(a, drop, width) + v) / 2**drop = a + round_half_up(v, drop), floored by a slice.  With the
  -- complement of a the complement of a - round_half_up(v, drop) comes out: that adder only adds.
  function rounding_base (a : signed; drop : positive; width : positive) return signed;

  -- '1' where x > limit*2**shift or x < -limit*2**shift, by one comparison; the sign of x tells which.
  function beyond (x : signed; limit : unsigned; shift : positive) return std_logic;

end package fixed_pkg;

package body fixed_pkg is

  function round_half_up (x : signed; drop : natural) return signed is
    variable wide : signed(x'length downto 0) := resize(x, x'length + 1);
  begin
    if drop > 0 then
      wide := wide + shift_left(to_signed(1, x'length + 1), drop - 1);
    end if;
    return wide(x'length downto drop);
  end function;

  function half (drop : positive; width : positive) return signed is
  begin
    return shift_left(to_signed(1, width), drop - 1);
  end function;

  function saturate (x : signed; width : positive) return signed is
    alias v         : signed(x'length - 1 downto 0) is x;
    variable result : signed(width - 1 downto 0);
  begin
    if width >= x'length then
      return resize(x, width);
    end if;
    if exceeds(x, width) = '0' then
      return v(width - 1 downto 0);
    end if;
    result            := (others => not v(v'high));
    result(width - 1) := v(v'high);
    return result;
  end function;

  function exceeds (x : signed; width : positive) return std_logic is
    alias v : signed(x'length - 1 downto 0) is x;
  begin
    if width >= x'length then
      return '0';
    end if;
    -- In range when every bit above the result's sign repeats it.
    return or (v(v'high downto width) xor v(v'high - 1 downto width - 1));
  end function;

  function narrowed (x : signed; past : std_logic; width : positive) return signed is
    alias v         : signed(x'length - 1 downto 0) is x;
    variable result : signed(width - 1 downto 0) := v(width - 1 downto 0);
  begin
    if past = '1' then
      result            := (others => not v(v'high));
      result(width - 1) := v(v'high);
    end if;
    return result;
  end function;

  function saturate_u (x : signed; width : positive) return unsigned is
    alias v         : signed(x'length - 1 downto 0) is x;
    constant ZERO   : signed(x'length - 1 downto 0) := (others => '0');
    variable result : unsigned(width - 1 downto 0)  := (others => '0');
  begin
    if v(v'high) = '1' then
      return result;
    end if;
    if width >= x'length then
      return resize(unsigned(v), width);
    end if;
    if v(v'high downto width) = ZERO(v'high downto width) then
      return unsigned(v(width - 1 downto 0));
    end if;
    result := (others => '1');
    return result;
  end function;

  function round_sat (x : signed; drop : natural; width : positive) return signed is
  begin
    return saturate(round_half_up(x, drop), width);
  end function;

  function clamp (x : signed; lo : signed; hi : signed) return signed is
  begin
    if x < lo then
      return resize(lo, x'length);
    elsif x > hi then
      return resize(hi, x'length);
    end if;
    return x;
  end function;

  function plus_carry (a : signed; carry : std_logic) return signed is
    variable raised : signed(a'length downto 0);
  begin
    raised := (a & '1') + signed(resize(unsigned'(0 => carry), a'length + 1));
    return raised(a'length downto 1);
  end function;

  function plus_rounded (a : signed; v : signed; drop : positive) return signed is
    variable sum : signed(a'length downto 0);
  begin
    -- Bits below the half, which stands under a, cannot reach it.
    sum := (a & '1') + resize(v(v'high downto drop - 1), a'length + 1);
    return sum(a'length downto 1);
  end function;

  function minus_rounded (a : signed; v : signed; drop : positive) return signed is
    variable difference : signed(a'length downto 0);
  begin
    -- What is rounded up is subtracted, so the floor needs no half.
    difference := (a & '0') - resize(v(v'high downto drop - 1), a'length + 1);
    return difference(a'length downto 1);
  end function;

  function rounding_base (a : signed; drop : positive; width : positive) return signed is
    variable result : signed(width - 1 downto 0) := shift_left(resize(a, width), drop);
  begin
    result(drop - 1) := '1';
    return result;
  end function;

  function beyond (x : signed; limit : unsigned; shift : positive) return std_logic is
    constant PARTS : positive := (shift + 3) / 4;
    alias v        : signed(x'length - 1 downto 0) is x;
    variable size  : unsigned(x'length - 2 - shift downto 0);
    variable more  : unsigned(PARTS - 1 downto 0);
    variable room  : signed(maximum(size'length, limit'length) + PARTS downto 0);
  begin
    -- The complement of a negative x is one less than -x: so where it reaches the limit, -x is past it.
    size := unsigned(v(v'high - 1 downto shift) xor v(v'high));
    -- What is below the limit's LSB, in parts that the carry of the comparison joins.
    for k in more'range loop
      more(k) := or v(minimum(4 * k + 3, shift - 1) downto 4 * k);
    end loop;
    more(0) := more(0) or v(v'high);
    room    := signed(resize(limit & (PARTS - 1 downto 0 => '0'), room'length))
               - signed(resize(size & more, room'length));
    return room(room'high);
  end function;

end package body fixed_pkg;
