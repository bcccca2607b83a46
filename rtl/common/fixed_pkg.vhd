-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: the two narrowing operations of the core, twin of golden_model/fixed.py.
-- Rounding: half up (add half an output LSB, then floor).  Overflow: saturation.
-- A block that floors uses shift_right or a slice, a block that computes modulo a slice; its comments say so.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package fixed_pkg is

  -- x / 2**drop, rounded half up.  The result is one bit wider than the bits kept, so it cannot overflow.
  function round_half_up (x : signed; drop : natural) return signed;

  -- -x / 2**drop, rounded half up, with the one sum that a multiplier's adder can take.
  function minus_half_up (x : signed; drop : positive) return signed;

  -- x / 2**drop or, if minus = '1', -x / 2**drop, rounded half up, with one carry chain.
  function turned_half_up (x : signed; minus : std_logic; drop : positive) return signed;

  -- Half an LSB of the result when drop bits are cut.  Added to a product in the adder of the multiplier, it turns
  -- the cut into a rounding half up.  A product of two signed numbers has headroom for it.
  function half (drop : positive; width : positive) return signed;

  -- x limited to the range of a signed number of width bits.
  function saturate (x : signed; width : positive) return signed;

  -- '1' if saturating x to width signed bits changes it.
  function exceeds (x : signed; width : positive) return std_logic;

  -- saturate in two clocks: x limited to width signed bits; past = '1' means that x exceeds them.
  function narrowed (x : signed; past : std_logic; width : positive) return signed;

  -- x limited to the range of an unsigned number of width bits.
  function saturate_u (x : signed; width : positive) return unsigned;

  -- The default narrowing: half up, then saturated to width signed bits.
  function round_sat (x : signed; drop : natural; width : positive) return signed;

  -- x limited to [lo, hi]; lo and hi must fit the width of x.
  function clamp (x : signed; lo : signed; hi : signed) return signed;

  -- |x|, which is unsigned and so needs no bit more than x.
  function magnitude (x : signed) return unsigned;

  -- -x if negative = '1', else x, with one sum; the result must fit the width of x.
  function negated (x : signed; negative : std_logic) return signed;

  -- a + 1 if carry = '1', with one sum whose carry comes from the bit below; the result must fit the width of a.
  function plus_carry (a : signed; carry : std_logic) return signed;

  -- a - b, one bit wider than the wider of both.  It is written as a sum with a carry, because yosys would map a plain
  -- difference before a multiplier to the DSP48's pre-adder and lose the signs of the operands.
  function difference (a : signed; b : signed) return signed;

  -- a if first = '1', else b.  Written without a multiplexer for an operand register of a DSP48: where some bits of a or b
  -- are constant, yosys would give these bits a reset of their own and leave the register outside of the DSP48.
  function chosen (a : signed; b : signed; first : std_logic) return signed;

  -- a + round_half_up(v, drop) with one carry chain; the sum must fit the width of a.
  function plus_rounded (a : signed; v : signed; drop : positive) return signed;

  -- a at the scale of a product that is cut by drop bits, plus the half that rounds it, for the adder of a multiplier:
  -- (rounding_base(a, drop, width) + v) / 2**drop = a + round_half_up(v, drop); a slice floors it.
  -- With not a instead of a the result is not (a - round_half_up(v, drop)), because that adder can only add.
  function rounding_base (a : signed; drop : positive; width : positive) return signed;

  -- '1' if x > limit*2**shift or x < -limit*2**shift, with one comparison; the sign of x selects the side.
  function beyond (x : signed; limit : unsigned; shift : natural) return std_logic;

  -- x limited to +-limit*2**shift, with one comparison; the result must fit the width of x.
  function within (x : signed; limit : unsigned; shift : natural) return signed;

  -- x limited to [0, limit*2**shift], with one comparison.
  function within_u (x : signed; limit : unsigned; shift : natural) return unsigned;

  -- x where it is not negative, else -1 - x: exact in the same width.
  function size (x : signed) return signed;

  -- 1 where the size of x is the smaller one.
  function smaller_is (x : signed; y : signed) return std_logic;

  -- About the length of a vector: the larger size and half the smaller one; less: that of x is the smaller one.
  function length (x : signed; y : signed; less : std_logic) return signed;

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

  function minus_half_up (x : signed; drop : positive) return signed is
    variable sum : signed(x'length downto 0);
  begin
    -- half - x = not (x - half - 1), and the cut of a complement is the complement of the cut.
    sum := resize(x, x'length + 1) + not half(drop, x'length + 1);
    return not sum(x'length downto drop);
  end function;

  function turned_half_up (x : signed; minus : std_logic; drop : positive) return signed is
    variable one_more : signed(x'length + 1 downto 0) := half(drop + 1, x'length + 2);
    variable sum      : signed(x'length + 1 downto 0) := resize((x xor minus) & '1', x'length + 2);
  begin
    -- -x = not x + 1: the one comes from the bit below the LSB, together with half an LSB of the result.
    one_more(0) := minus;
    sum         := sum + one_more;
    return sum(x'length + 1 downto drop + 1);
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
    -- In range if all bits above the sign of the result are equal to it.
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

  function magnitude (x : signed) return unsigned is
    variable wide : signed(x'length downto 0) := abs(resize(x, x'length + 1));
  begin
    return unsigned(wide(x'length - 1 downto 0));
  end function;

  function negated (x : signed; negative : std_logic) return signed is
  begin
    return plus_carry(x xor negative, negative);
  end function;

  function plus_carry (a : signed; carry : std_logic) return signed is
    variable raised : signed(a'length downto 0);
  begin
    raised := (a & '1') + signed(resize(unsigned'(0 => carry), a'length + 1));
    return raised(a'length downto 1);
  end function;

  function difference (a : signed; b : signed) return signed is
    constant WIDTH : positive := maximum(a'length, b'length) + 1;
    variable sum   : signed(WIDTH downto 0);
  begin
    -- -b = not b + 1: the one is the carry of both bits below the LSB.
    sum := (resize(a, WIDTH) & '1') + ((not resize(b, WIDTH)) & '1');
    return sum(WIDTH downto 1);
  end function;

  function chosen (a : signed; b : signed; first : std_logic) return signed is
  begin
    return (a and first) or (b and not first);
  end function;

  function plus_rounded (a : signed; v : signed; drop : positive) return signed is
    variable sum : signed(a'length downto 0);
  begin
    -- The lowest bit of the sum is half an LSB of a; bits of v below it cannot affect the result.
    sum := (a & '1') + resize(v(v'high downto drop - 1), a'length + 1);
    return sum(a'length downto 1);
  end function;

  function rounding_base (a : signed; drop : positive; width : positive) return signed is
    variable result : signed(width - 1 downto 0) := shift_left(resize(a, width), drop);
  begin
    result(drop - 1) := '1';
    return result;
  end function;

  function beyond (x : signed; limit : unsigned; shift : natural) return std_logic is
    constant PARTS : positive := maximum(1, (shift + 3) / 4);
    alias v        : signed(x'length - 1 downto 0) is x;
    variable above : unsigned(x'length - 2 - shift downto 0);
    variable more  : unsigned(PARTS - 1 downto 0);
    variable room  : signed(maximum(above'length, limit'length) + PARTS downto 0);
  begin
    -- The complement of a negative x is -x - 1: if it reaches the limit, -x is above the limit.
    above := unsigned(v(v'high - 1 downto shift) xor v(v'high));
    -- The bits below the LSB of the limit, ORed in groups of four; the comparison's carry chain combines the groups.
    more := (others => '0');
    if shift > 0 then
      for k in more'range loop
        more(k) := or v(minimum(4 * k + 3, shift - 1) downto 4 * k);
      end loop;
    end if;
    more(0) := more(0) or v(v'high);
    room    := signed(resize(limit & (PARTS - 1 downto 0 => '0'), room'length))
               - signed(resize(above & more, room'length));
    return room(room'high);
  end function;

  function within (x : signed; limit : unsigned; shift : natural) return signed is
    constant TOP : signed(x'length - 1 downto 0) := shift_left(signed(resize(limit, x'length)), shift);
  begin
    if beyond(x, limit, shift) = '0' then
      return x;
    elsif x < 0 then
      return -TOP;
    end if;
    return TOP;
  end function;

  function within_u (x : signed; limit : unsigned; shift : natural) return unsigned is
    constant WIDTH : positive := limit'length + shift;
  begin
    if x < 0 then
      return to_unsigned(0, WIDTH);
    elsif beyond(x, limit, shift) = '1' then
      return shift_left(resize(limit, WIDTH), shift);
    end if;
    return resize(unsigned(x), WIDTH);
  end function;

  function size (x : signed) return signed is
  begin
    return x xor (x'range => x(x'high));
  end function;

  function smaller_is (x : signed; y : signed) return std_logic is
  begin
    if size(x) < size(y) then
      return '1';
    end if;
    return '0';
  end function;

  function length (x : signed; y : signed; less : std_logic) return signed is
    variable larger  : signed(x'length - 1 downto 0) := size(x);
    variable smaller : signed(x'length - 1 downto 0) := size(y);
  begin
    if less = '1' then
      larger  := size(y);
      smaller := size(x);
    end if;
    return resize(larger, x'length + 1) + shift_right(resize(smaller, x'length + 1), 1);
  end function;

end package body fixed_pkg;
