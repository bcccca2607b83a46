-- Purpose: sine and cosine of two angles, one after the other, from an interpolated quarter-wave table.
--   theta = quadrant + (address + 1/2)/4096 + delta;  sin = S + delta*C,  cos = C - delta*S
-- Formats: table U(0,18), delta S(-10,22) radians, interpolated value 22 fraction bits, TRIG out.
-- Latency: 13, 6 for each angle.  The first angle is theta_me, whose outputs are valid with out_soon; theta_out is read
-- after it, and its outputs have one more register because they drive distant logic.
-- Interval: 9 (one read port and one multiplier: C, S and C again are read, delta*C comes first).
-- Rounding: product floored to 22 fraction bits, output half up; 1.0 is reached and fits, no saturation.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity sincos is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    theta_me  : in  unsigned(TURN_W - 1 downto 0);
    theta_out : in  unsigned(TURN_W - 1 downto 0);
    out_soon  : out std_logic;
    out_valid : out std_logic;
    cos_theta : out signed(TRIG_W - 1 downto 0);
    sin_theta : out signed(TRIG_W - 1 downto 0);
    cos_out   : out signed(TRIG_W - 1 downto 0);
    sin_out   : out signed(TRIG_W - 1 downto 0)
  );
end entity sincos;

architecture rtl of sincos is
  constant LATENCY    : positive := SINCOS_LATENCY;
  constant DELTA_BITS : positive := TURN_W - 2 - SINCOS_ADDRESS_BITS;
  constant FINE_W     : positive := 24;  -- S(1,22)

  signal valid      : std_logic_vector(0 to LATENCY);
  signal beat       : std_logic_vector(0 to SINCOS_PASS - 1);  -- valid bits of both angles
  signal second     : std_logic;
  signal theta      : unsigned(TURN_W - 1 downto 0);
  signal address_0  : unsigned(SINCOS_ADDRESS_BITS - 1 downto 0);
  signal table_1    : unsigned(17 downto 0);
  signal low_1      : unsigned(DELTA_BITS - 1 downto 0);
  signal quadrant_1 : unsigned(1 downto 0);
  signal table_2    : unsigned(17 downto 0);
  signal delta_2    : signed(12 downto 0);
  signal prod_3     : signed(31 downto 0);
  signal base_3     : signed(FINE_W + SINCOS_DROP_PROD - 1 downto 0);
  signal quadrant_4 : unsigned(1 downto 0);
  signal sum_4      : signed(FINE_W + SINCOS_DROP_PROD - 1 downto 0);  -- sine at clock 4, cosine at 5
  signal fine_4     : signed(FINE_W - 1 downto 0);
  signal fine_s_5   : signed(FINE_W - 1 downto 0);
  signal sin_5      : signed(TRIG_W - 1 downto 0);
  signal cos_5      : signed(TRIG_W - 1 downto 0);
  signal sin_6      : signed(TRIG_W - 1 downto 0);
  signal cos_6      : signed(TRIG_W - 1 downto 0);

  -- A quarter turn swaps sine and cosine and inverts the sign of one, a half turn inverts both.  Rounded half up: the
  -- one missing in the complement comes from the bit below the LSB, together with the carry of the sum.
  function turned (own, other : signed; swap, minus : std_logic) return signed is
    constant ONE_MORE : unsigned(SINCOS_DROP_OUT downto 0) := (SINCOS_DROP_OUT => '1', 0 => minus, others => '0');
    variable v        : signed(FINE_W - 1 downto 0)        := own;
    variable sum      : signed(FINE_W downto 0);
  begin
    if swap = '1' then
      v := other;
    end if;
    v   := v xor (v'range => minus);
    sum := (v & '1') + signed(resize(ONE_MORE, sum'length));
    return sum(FINE_W downto SINCOS_DROP_OUT + 1);
  end function;
begin
  valid(0) <= in_valid;
  beat(0)  <= valid(0) or valid(SINCOS_PASS);

  theta     <= theta_out when second = '1' else theta_me;
  address_0 <= theta(TURN_W - 3 downto DELTA_BITS) xor (SINCOS_ADDRESS_BITS - 1 downto 0 => beat(1));

  -- The cosine needs -floor(delta*S) = ceil(-delta*S): delta is already negated, and the ones below the cut round up.
  base_3 <= signed(shift_left(resize(table_2, base_3'length), SINCOS_TABLE_SHIFT + SINCOS_DROP_PROD)) or
            signed(resize(unsigned'(SINCOS_DROP_PROD - 1 downto 0 => beat(4)), base_3'length));
  fine_4 <= sum_4(sum_4'high downto SINCOS_DROP_PROD);

  sin_5 <= turned(fine_s_5, fine_4, quadrant_4(0), quadrant_4(1));
  cos_5 <= turned(fine_4, fine_s_5, quadrant_4(0), quadrant_4(1) xor quadrant_4(0));

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY)        <= valid(0 to LATENCY - 1);
      beat(1 to SINCOS_PASS - 1) <= beat(0 to SINCOS_PASS - 2);

      -- The second angle is selected during the three clocks in which it is read
      second <= valid(SINCOS_PASS - 1) or valid(SINCOS_PASS) or valid(SINCOS_PASS + 1);

      -- Stages 1, 2, 3: theta = quadrant, address, low bits of delta;  c, s, c from both ends of the table
      if beat(0) = '1' then
        quadrant_1 <= theta(TURN_W - 1 downto TURN_W - 2);
        low_1      <= theta(DELTA_BITS - 1 downto 0);
      end if;

      if beat(0) = '1' or beat(1) = '1' or beat(2) = '1' then
        table_1 <= SINCOS_SINE(to_integer(not address_0));
      end if;

      -- Stages 2, 3, 4: a register for c, s, c, as a block RAM's output arrives late;  delta in radians, then -delta
      if beat(1) = '1' or beat(2) = '1' or beat(3) = '1' then
        table_2 <= table_1;
      end if;
      if beat(1) = '1' or beat(2) = '1' then
        delta_2 <= SINCOS_DELTA(to_integer(low_1));
        if beat(2) = '1' then
          delta_2 <= SINCOS_MINUS_DELTA(to_integer(low_1));
        end if;
      end if;

      -- Stages 3, 4: prod = delta*c, then -delta*s
      if beat(2) = '1' or beat(3) = '1' then
        prod_3 <= delta_2 * signed('0' & table_2);
      end if;

      -- Stages 4, 5: fine_s = s + delta*c, then fine_c = c - delta*s
      if beat(3) = '1' or beat(4) = '1' then
        sum_4 <= base_3 + prod_3;
      end if;
      if beat(3) = '1' then
        quadrant_4 <= quadrant_1;
      end if;
      if beat(4) = '1' then
        fine_s_5 <= fine_4;
      end if;

      -- Stages 6, 12: into the quadrant, narrowed;  stage 13: all outputs of the second angle together
      if valid(SINCOS_PASS - 1) = '1' then
        sin_theta <= sin_5;
        cos_theta <= cos_5;
      end if;
      sin_6 <= sin_5;
      cos_6 <= cos_5;
      if valid(LATENCY - 1) = '1' then
        sin_out <= sin_6;
        cos_out <= cos_6;
      end if;

      if rst = '1' then
        valid(1 to LATENCY)        <= (others => '0');
        beat(1 to SINCOS_PASS - 1) <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(SINCOS_PASS);
  out_valid <= valid(LATENCY);

end architecture rtl;
