-- Purpose: symmetrical space-vector modulation, stator voltage to three duties, without a divider.
--   x = u_alpha/u_dc,  y = sqrt(3)/2*u_beta/u_dc,  by m, m_beta and n of u_dc_processing
--   legs a = x, b = -x/2 + y, c = -x/2 - y;  duty = 1/2 + leg + mid(a,b,c)/2
-- Formats: products 33 fraction bits, shifted by n; x, y S(1,17); legs S(3,18), exact; duty U(1,16), 0 to 1.
-- Latency: 5.  Rounding: half up.  x, y saturate at two bus voltages, which the clamp of the duty swallows.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity svm is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    u_alpha   : in  signed(PU_W - 1 downto 0);
    u_beta    : in  signed(PU_W - 1 downto 0);
    m         : in  unsigned(RECIPROCAL_W - 1 downto 0);
    m_beta    : in  unsigned(RECIPROCAL_W - 1 downto 0);
    n         : in  unsigned(2 downto 0);
    out_valid : out std_logic;
    duty_a    : out unsigned(DUTY_W - 1 downto 0);
    duty_b    : out unsigned(DUTY_W - 1 downto 0);
    duty_c    : out unsigned(DUTY_W - 1 downto 0)
  );
end entity svm;

architecture rtl of svm is
  constant LATENCY : positive := SVM_LATENCY;
  constant PROD_W  : positive := PU_W + RECIPROCAL_W + 1;
  constant LEG_W   : positive := SVM_SCALED_W + 3;
  constant SUM_W   : positive := LEG_W + 3;

  signal valid    : std_logic_vector(0 to LATENCY);
  signal prod_x_1 : signed(PROD_W - 1 downto 0);
  signal prod_y_1 : signed(PROD_W - 1 downto 0);
  signal n_1      : unsigned(2 downto 0);
  signal x_2      : signed(SVM_SCALED_W - 1 downto 0);
  signal y_2      : signed(SVM_SCALED_W - 1 downto 0);
  signal leg_a_3  : signed(LEG_W - 1 downto 0);
  signal leg_b_3  : signed(LEG_W - 1 downto 0);
  signal leg_c_3  : signed(LEG_W - 1 downto 0);
  signal a_ge_b_3 : std_logic;
  signal a_ge_c_3 : std_logic;
  signal b_ge_c_3 : std_logic;
  signal mid_3    : signed(LEG_W - 1 downto 0);
  signal sum_a_4  : signed(SUM_W - 1 downto 0);
  signal sum_b_4  : signed(SUM_W - 1 downto 0);
  signal sum_c_4  : signed(SUM_W - 1 downto 0);

  function scaled (prod : signed; exponent : unsigned) return signed is
  begin
    return round_sat(shift_left(resize(prod, PROD_W + 5), to_integer(exponent)), SVM_DROP_SCALED, SVM_SCALED_W);
  end function;

  function total (leg, mid : signed) return signed is
  begin
    return to_signed(SVM_HALF, SUM_W) + shift_left(resize(leg, SUM_W), 1) + mid;
  end function;

  function to_duty (sum : signed) return unsigned is
    constant ROUNDED : signed := round_half_up(sum, SVM_DROP_DUTY);
  begin
    return resize(unsigned(clamp(ROUNDED, to_signed(0, ROUNDED'length), to_signed(DUTY_ONE, ROUNDED'length))), DUTY_W);
  end function;
begin
  valid(0) <= in_valid;

  -- The middle leg is neither the largest nor the smallest of the three.
  mid_3 <= leg_a_3 when a_ge_b_3 /= a_ge_c_3 else
           leg_b_3 when a_ge_b_3 = b_ge_c_3 else
           leg_c_3;

  process (clk)
    variable x3, y2 : signed(SVM_SCALED_W + 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod_x = u_alpha*m,  prod_y = u_beta*m_beta
      if valid(0) = '1' then
        prod_x_1 <= u_alpha * signed('0' & m);
        prod_y_1 <= u_beta * signed('0' & m_beta);
        n_1      <= n;
      end if;

      -- Stage 2: x, y = prod * 2**n, narrowed
      if valid(1) = '1' then
        x_2 <= scaled(prod_x_1, n_1);
        y_2 <= scaled(prod_y_1, n_1);
      end if;

      -- Stage 3: legs with one more fraction bit, and their order: 3x against +-2y, y against 0
      if valid(2) = '1' then
        x3       := resize(x_2, SVM_SCALED_W + 2) + shift_left(resize(x_2, SVM_SCALED_W + 2), 1);
        y2       := shift_left(resize(y_2, SVM_SCALED_W + 2), 1);
        leg_a_3  <= shift_left(resize(x_2, LEG_W), 1);
        leg_b_3  <= resize(y2, LEG_W) - x_2;
        leg_c_3  <= -resize(y2, LEG_W) - x_2;
        a_ge_b_3 <= '1' when x3 >= y2 else '0';
        a_ge_c_3 <= '1' when x3 >= -y2 else '0';
        b_ge_c_3 <= not y_2(y_2'high);
      end if;

      -- Stage 4: sum = 1/2 + leg + mid/2
      if valid(3) = '1' then
        sum_a_4 <= total(leg_a_3, mid_3);
        sum_b_4 <= total(leg_b_3, mid_3);
        sum_c_4 <= total(leg_c_3, mid_3);
      end if;

      -- Stage 5: duty = sum, narrowed and clamped to 0..1
      if valid(4) = '1' then
        duty_a <= to_duty(sum_a_4);
        duty_b <= to_duty(sum_b_4);
        duty_c <= to_duty(sum_c_4);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
