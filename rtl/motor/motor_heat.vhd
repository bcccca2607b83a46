-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: temperatures of winding and magnets, and what they change: phase resistances and magnet flux.
--   T_w += h*(1 + f_w)*sum(i_a^2 + i_b^2 + i_c^2) + k_w*(T_a - T_w);  T_m += k_m*(T_w - T_m)
--   f = tcr*(T - t_ref);  hot_x = r_x + r_x*f_w;  hot_psi = psi_m - psi_m*f_m;  start: T_w = T_m = T_a
-- Once a window of 2**WINDOW_BITS steps.  One multiplier: in each step a product of those above, then three squares.
-- Formats: temperatures S(9,38), multiplied S(9,7), outside S(9,6); h U(-12,36), k U(-10,31), tcr U(-7,24), f S(1,16);
--   sum U(15,32), multiplied U(15,2), its other bits stay for the next window.
-- Latency: 6.  Interval: 6.
-- Rounding: all is cut; temperatures, f, resistances and flux saturate.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity motor_heat is
  generic (
    WINDOW_BITS : positive range 4 to 11 := 11
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    i_a          : in  signed(PU_W - 1 downto 0);
    i_b          : in  signed(PU_W - 1 downto 0);
    i_c          : in  signed(PU_W - 1 downto 0);
    start        : in  std_logic;
    r_a          : in  unsigned(23 downto 0);
    r_b          : in  unsigned(23 downto 0);
    r_c          : in  unsigned(23 downto 0);
    psi_m        : in  signed(FLUX_W - 1 downto 0);
    ambient      : in  signed(15 downto 0);
    t_ref        : in  signed(15 downto 0);
    heating      : in  unsigned(23 downto 0);
    k_winding    : in  unsigned(20 downto 0);
    k_magnet     : in  unsigned(20 downto 0);
    tcr_winding  : in  unsigned(16 downto 0);
    tcr_magnet   : in  unsigned(16 downto 0);
    out_valid    : out std_logic;
    hot_a        : out unsigned(23 downto 0);
    hot_b        : out unsigned(23 downto 0);
    hot_c        : out unsigned(23 downto 0);
    hot_psi      : out signed(FLUX_W - 1 downto 0);
    temp_winding : out signed(15 downto 0);
    temp_magnet  : out signed(15 downto 0)
  );
end entity motor_heat;

architecture rtl of motor_heat is
  constant LATENCY : positive := MOTOR_HEAT_LATENCY;
  constant R_W     : positive := 24;
  constant A_W     : positive := 25;
  constant B_W     : positive := 18;
  constant MORE_W  : positive := 26;
  constant T_W     : positive := 16 + MOTOR_HEAT_DROP_OUT;
  constant SUM_W   : positive := 17 + MOTOR_HEAT_DROP_SUM;

  signal valid   : std_logic_vector(0 to LATENCY);
  signal count   : unsigned(WINDOW_BITS - 1 downto 0);
  signal op_0    : natural range 0 to MOTOR_HEAT_PRODUCTS;
  signal warm_0  : unsigned(R_W - 1 downto 0);
  signal seen_w  : signed(B_W - 1 downto 0);
  signal seen_m  : signed(B_W - 1 downto 0);
  signal from_0  : signed(B_W - 1 downto 0);
  signal to_0    : signed(B_W - 1 downto 0);
  signal a_0     : signed(A_W - 1 downto 0);
  signal b_0     : signed(B_W - 1 downto 0);
  signal i_0     : signed(PU_W - 1 downto 0);
  signal a_1     : signed(A_W - 1 downto 0);
  signal b_1     : signed(B_W - 1 downto 0);
  signal prod_2  : signed(A_W + B_W - 1 downto 0);
  signal more_2  : signed(MORE_W downto 0);
  signal f_2     : signed(B_W - 1 downto 0);
  signal base_2  : signed(T_W - 1 downto 0);
  signal temp_2  : signed(T_W - 1 downto 0);
  -- State
  signal winding : signed(T_W - 1 downto 0);
  signal magnet  : signed(T_W - 1 downto 0);
  signal sum_3   : unsigned(SUM_W - 1 downto 0);
  signal f_3     : signed(B_W - 1 downto 0);
  signal more_a  : signed(MORE_W - 1 downto 0);
  signal more_b  : signed(MORE_W - 1 downto 0);
  signal more_c  : signed(MORE_W - 1 downto 0);
  signal more_h  : signed(MORE_W - 1 downto 0);
  signal less    : signed(MORE_W downto 0);

  function warmer (r : unsigned(R_W - 1 downto 0); more : signed(MORE_W - 1 downto 0)) return unsigned is
  begin
    return saturate_u(signed(resize(r, MORE_W + 1)) + more, R_W);
  end function;
begin
  valid(0) <= in_valid;

  hot_a        <= warmer(r_a, more_a);
  hot_b        <= warmer(r_b, more_b);
  hot_c        <= warmer(r_c, more_c);
  hot_psi      <= saturate(resize(psi_m, MORE_W + 2) - less, FLUX_W);
  temp_winding <= winding(T_W - 1 downto MOTOR_HEAT_DROP_OUT);
  temp_magnet  <= magnet(T_W - 1 downto MOTOR_HEAT_DROP_OUT);

  -- The product of this step, of the first ten of a window
  op_0   <= to_integer(count) when count < MOTOR_HEAT_PRODUCTS else MOTOR_HEAT_PRODUCTS;
  warm_0 <= warmer(heating, more_h);
  seen_w <= resize(winding(T_W - 1 downto MOTOR_HEAT_DROP_SEEN), B_W);
  seen_m <= resize(magnet(T_W - 1 downto MOTOR_HEAT_DROP_SEEN), B_W);
  from_0 <= seen_m when op_0 = 8 else
            shift_left(resize(ambient, B_W), 1) when op_0 = 1 else seen_w;
  to_0   <= seen_w when op_0 = 1 else seen_m when op_0 = 2 else shift_left(resize(t_ref, B_W), 1);

  with op_0 select a_0 <=
    signed('0' & warm_0) when 0,
    signed(resize(k_winding, A_W)) when 1,
    signed(resize(k_magnet, A_W)) when 2,
    signed(resize(tcr_winding, A_W)) when 3,
    signed('0' & r_a) when 4,
    signed('0' & r_b) when 5,
    signed('0' & r_c) when 6,
    signed('0' & heating) when 7,
    signed(resize(tcr_magnet, A_W)) when 8,
    psi_m when others;
  with op_0 select b_0 <=
    signed('0' & sum_3(SUM_W - 1 downto MOTOR_HEAT_DROP_SUM)) when 0,
    from_0 - to_0 when 1 | 2 | 3 | 8,
    f_3 when others;
  i_0 <= i_a when valid(1) = '1' else i_b when valid(2) = '1' else i_c;

  -- What it gives
  more_2 <= prod_2(prod_2'high downto MOTOR_HEAT_DROP_HOT);
  f_2    <= saturate(shift_right(prod_2, MOTOR_HEAT_DROP_F), B_W);
  base_2 <= magnet when op_0 = 2 else winding;
  temp_2 <= saturate(resize(base_2, T_W + 1) + prod_2, T_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: the factors of the product, then those of the squares
      a_1 <= resize(i_0, A_W);
      b_1 <= i_0;
      if valid(0) = '1' then
        a_1 <= a_0;
        b_1 <= b_0;
      end if;

      -- Stage 2: prod = a*b
      prod_2 <= a_1 * b_1;

      -- Stage 3: what the product of this step changes
      if valid(2) = '1' then
        case op_0 is
          when 0 =>
            winding                                     <= temp_2;
            sum_3(SUM_W - 1 downto MOTOR_HEAT_DROP_SUM) <= (others => '0');
          when 1 =>
            winding <= temp_2;
          when 2 =>
            magnet <= temp_2;
          when 3 | 8 =>
            f_3 <= f_2;
          when 4 =>
            more_a <= resize(more_2, MORE_W);
          when 5 =>
            more_b <= resize(more_2, MORE_W);
          when 6 =>
            more_c <= resize(more_2, MORE_W);
          when 7 =>
            more_h <= resize(more_2, MORE_W);
          when 9 =>
            less <= more_2;
          when others =>
            null;
        end case;
      end if;

      -- Stages 4 to 6: the squares
      if (or valid(3 to 5)) = '1' then
        sum_3 <= sum_3 + resize(unsigned(prod_2(2 * PU_W - 1 downto 0)), SUM_W);
      end if;
      if valid(5) = '1' then
        count <= count + 1;
        if start = '1' then
          winding <= shift_left(resize(ambient, T_W), MOTOR_HEAT_DROP_OUT);
          magnet  <= shift_left(resize(ambient, T_W), MOTOR_HEAT_DROP_OUT);
          sum_3   <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        count               <= (others => '0');
        winding             <= (others => '0');
        magnet              <= (others => '0');
        sum_3               <= (others => '0');
        f_3                 <= (others => '0');
        more_a              <= (others => '0');
        more_b              <= (others => '0');
        more_c              <= (others => '0');
        more_h              <= (others => '0');
        less                <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
