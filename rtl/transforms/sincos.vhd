-- Purpose: sine and cosine of an angle by one quarter-wave table, both outputs interpolated.
--   theta = quadrant + (address + 1/2)/4096 + delta;  sin = S + delta*C,  cos = C - delta*S
-- Formats: table U(0,18), delta S(-10,22) radians, interpolated value 22 fraction bits, TRIG out.
-- Latency: 6.  Interval: 2 (one multiplier makes both products).
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
    theta     : in  unsigned(TURN_W - 1 downto 0);
    out_valid : out std_logic;
    cos_theta : out signed(TRIG_W - 1 downto 0);
    sin_theta : out signed(TRIG_W - 1 downto 0)
  );
end entity sincos;

architecture rtl of sincos is
  constant LATENCY    : positive := SINCOS_LATENCY;
  constant DELTA_BITS : positive := TURN_W - 2 - SINCOS_ADDRESS_BITS;
  constant FINE_W     : positive := 24;  -- S(1,22)

  signal valid      : std_logic_vector(0 to LATENCY);
  signal address_1  : unsigned(SINCOS_ADDRESS_BITS - 1 downto 0);
  signal low_1      : unsigned(DELTA_BITS - 1 downto 0);
  signal quadrant_1 : unsigned(1 downto 0);
  signal s_2        : unsigned(17 downto 0);
  signal c_2        : unsigned(17 downto 0);
  signal delta_2    : signed(12 downto 0);
  signal quadrant_2 : unsigned(1 downto 0);
  signal factor_2   : unsigned(17 downto 0);
  signal prod_3     : signed(31 downto 0);
  signal step_3     : signed(FINE_W - 1 downto 0);
  signal s_3        : unsigned(17 downto 0);
  signal c_3        : unsigned(17 downto 0);
  signal quadrant_3 : unsigned(1 downto 0);
  signal fine_s_4   : signed(FINE_W - 1 downto 0);
  signal fine_s_5   : signed(FINE_W - 1 downto 0);
  signal fine_c_5   : signed(FINE_W - 1 downto 0);
  signal quadrant_5 : unsigned(1 downto 0);

  function extended (x : unsigned) return signed is
  begin
    return signed(shift_left(resize(x, FINE_W), SINCOS_TABLE_SHIFT));
  end function;

  -- A quarter turn swaps sine and cosine and turns the sign of one, a half turn those of both.
  function turned (own, other : signed; swap, minus : std_logic) return signed is
    variable v : signed(FINE_W - 1 downto 0) := own;
  begin
    if swap = '1' then
      v := other;
    end if;
    if minus = '1' then
      v := -v;
    end if;
    return resize(round_half_up(v, SINCOS_DROP_OUT), TRIG_W);
  end function;
begin
  valid(0) <= in_valid;

  factor_2 <= s_2 when valid(3) = '1' else c_2;
  step_3   <= resize(shift_right(prod_3, SINCOS_DROP_PROD), FINE_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: theta = quadrant, address, low bits of delta
      if valid(0) = '1' then
        quadrant_1 <= theta(TURN_W - 1 downto TURN_W - 2);
        address_1  <= theta(TURN_W - 3 downto DELTA_BITS);
        low_1      <= theta(DELTA_BITS - 1 downto 0);
      end if;

      -- Stage 2: s, c from both ends of the table, delta in radians
      if valid(1) = '1' then
        s_2        <= SINCOS_SINE(to_integer(address_1));
        c_2        <= SINCOS_SINE(to_integer(not address_1));
        delta_2    <= SINCOS_DELTA(to_integer(low_1));
        quadrant_2 <= quadrant_1;
      end if;

      -- Stage 3: prod = delta*c, a clock later delta*s
      if valid(2) = '1' or valid(3) = '1' then
        prod_3 <= delta_2 * signed('0' & factor_2);
      end if;
      if valid(2) = '1' then
        s_3        <= s_2;
        c_3        <= c_2;
        quadrant_3 <= quadrant_2;
      end if;

      -- Stage 4: fine_s = s + delta*c
      if valid(3) = '1' then
        fine_s_4 <= extended(s_3) + step_3;
      end if;

      -- Stage 5: fine_c = c - delta*s
      if valid(4) = '1' then
        fine_c_5   <= extended(c_3) - step_3;
        fine_s_5   <= fine_s_4;
        quadrant_5 <= quadrant_3;
      end if;

      -- Stage 6: into the quadrant, narrowed
      if valid(5) = '1' then
        sin_theta <= turned(fine_s_5, fine_c_5, quadrant_5(0), quadrant_5(1));
        cos_theta <= turned(fine_c_5, fine_s_5, quadrant_5(0), quadrant_5(1) xor quadrant_5(0));
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
