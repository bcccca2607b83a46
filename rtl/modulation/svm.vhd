-- Purpose: symmetrical space-vector modulation, stator voltage to three duties, without a divider.
--   x = u_alpha/u_dc,  y = sqrt(3)/2*u_beta/u_dc,  by inverse and inverse_beta of u_dc_processing
--   legs a = x, b = -x/2 + y, c = -x/2 - y;  duty = 1/2 + leg + mid(a,b,c)/2
-- The middle leg is a while |3x| <= |2y|; else b where x and y have one sign, c where they have not: the near one.
-- Formats: products 33 fraction bits; x, y S(1,17); legs S(3,18), exact; duty U(1,16), 0 to 1.
-- Latency: 6.  Rounding: half up.  x, y saturate at two bus voltages, which the clamp of the duty swallows.
-- The legs sum to zero, so leg + mid/2 is at most half the distance of two legs: below 4, two bits above a duty's sign.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity svm is
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    in_valid     : in  std_logic;
    u_alpha      : in  signed(PU_W - 1 downto 0);
    u_beta       : in  signed(PU_W - 1 downto 0);
    inverse      : in  unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
    inverse_beta : in  unsigned(U_DC_PROCESSING_INVERSE_W - 1 downto 0);
    out_valid    : out std_logic;
    duty_a       : out unsigned(DUTY_W - 1 downto 0);
    duty_b       : out unsigned(DUTY_W - 1 downto 0);
    duty_c       : out unsigned(DUTY_W - 1 downto 0)
  );
end entity svm;

architecture rtl of svm is
  constant LATENCY : positive := SVM_LATENCY;
  constant PROD_W  : positive := PU_W + U_DC_PROCESSING_INVERSE_W + 1;
  constant LEG_W   : positive := SVM_SCALED_W + 2;

  signal valid     : std_logic_vector(0 to LATENCY);
  signal prod_x_1  : signed(PROD_W - 1 downto 0);
  signal prod_y_1  : signed(PROD_W - 1 downto 0);
  signal prod_x_2  : signed(PROD_W - 1 downto 0);
  signal prod_y_2  : signed(PROD_W - 1 downto 0);
  signal x_3       : signed(SVM_SCALED_W - 1 downto 0);
  signal y_3       : signed(SVM_SCALED_W - 1 downto 0);
  signal alike_3   : std_logic;
  signal triple_3  : signed(LEG_W - 1 downto 0);
  signal double_3  : signed(LEG_W - 1 downto 0);  -- 2y, or its complement where y has the sign of x
  signal apart_3   : signed(LEG_W + 1 downto 0);
  signal leg_a_4   : signed(LEG_W - 1 downto 0);
  signal leg_b_4   : signed(LEG_W - 1 downto 0);
  signal minus_c_4 : signed(LEG_W - 1 downto 0);
  signal alike_4   : std_logic;
  signal a_mid_4   : std_logic;
  signal mid_4     : signed(LEG_W - 1 downto 0);
  signal carry_4   : signed(1 downto 0);
  signal leg_a_5   : signed(LEG_W - 1 downto 0);
  signal leg_b_5   : signed(LEG_W - 1 downto 0);
  signal minus_c_5 : signed(LEG_W - 1 downto 0);
  signal mid_5     : signed(LEG_W - 1 downto 0);

  -- 1/2 + sum/4, sum being leg + mid/2 with the half LSB in it, clamped to 0..1.
  function to_duty (sum : signed) return unsigned is
    constant FLOORED : signed(sum'length - 3 downto 0) := sum(sum'high downto 2);
    variable duty    : unsigned(DUTY_W - 1 downto 0)   := (others => '0');
  begin
    if exceeds(FLOORED, DUTY_W - 1) = '1' then
      duty(DUTY_W - 1) := not FLOORED(FLOORED'high);
    else
      duty(DUTY_W - 2 downto 0) := not FLOORED(DUTY_W - 2) & unsigned(FLOORED(DUTY_W - 3 downto 0));
    end if;
    return duty;
  end function;
begin
  valid(0) <= in_valid;

  -- 3x less 2y, both taken as positive, with the sign of x; a bit above the sum's, where 3x lacks that sign: there
  -- 1 says that 2y is the larger
  alike_3  <= x_3(x_3'high) xnor y_3(y_3'high);
  triple_3 <= shift_left(resize(x_3, LEG_W), 1) + x_3;
  double_3 <= shift_left(resize(y_3, LEG_W), 1) xor (LEG_W - 1 downto 0 => alike_3);
  apart_3  <= signed('0' & triple_3 & alike_3) + (double_3 & alike_3);

  mid_4   <= leg_a_4 when a_mid_4 = '1' else
             leg_b_4 when alike_4 = '1' else
             not minus_c_4;
  carry_4 <= '0' & not (a_mid_4 or alike_4);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod_x = u_alpha*inverse,  prod_y = u_beta*inverse_beta
      if valid(0) = '1' then
        prod_x_1 <= u_alpha * signed('0' & inverse);
        prod_y_1 <= u_beta * signed('0' & inverse_beta);
      end if;

      -- Stage 2: half an LSB of x and y to round with
      if valid(1) = '1' then
        prod_x_2 <= prod_x_1 + half(SVM_DROP_SCALED, PROD_W);
        prod_y_2 <= prod_y_1 + half(SVM_DROP_SCALED, PROD_W);
      end if;

      -- Stage 3: x, y = prod, narrowed
      if valid(2) = '1' then
        x_3 <= saturate(shift_right(prod_x_2, SVM_DROP_SCALED), SVM_SCALED_W);
        y_3 <= saturate(shift_right(prod_y_2, SVM_DROP_SCALED), SVM_SCALED_W);
      end if;

      -- Stage 4: legs with one more fraction bit, c as its negative; which of them is in the middle
      if valid(3) = '1' then
        leg_a_4   <= shift_left(resize(x_3, LEG_W), 1);
        leg_b_4   <= shift_left(resize(y_3, LEG_W), 1) - x_3;
        minus_c_4 <= shift_left(resize(y_3, LEG_W), 1) + x_3;
        alike_4   <= alike_3;
        a_mid_4   <= apart_3(LEG_W + 1);
      end if;

      -- Stage 5: the middle leg, with half an LSB of the duty to round with
      if valid(4) = '1' then
        leg_a_5   <= leg_a_4;
        leg_b_5   <= leg_b_4;
        minus_c_5 <= minus_c_4;
        mid_5     <= mid_4 + (to_signed(2 ** (SVM_DROP_DUTY - 1), LEG_W) or resize(carry_4, LEG_W));
      end if;

      -- Stage 6: duty = 1/2 + leg + mid/2, narrowed and clamped to 0..1
      if valid(5) = '1' then
        duty_a <= to_duty(leg_a_5 + mid_5(LEG_W - 1 downto 1));
        duty_b <= to_duty(leg_b_5 + mid_5(LEG_W - 1 downto 1));
        duty_c <= to_duty(mid_5(LEG_W - 1 downto 1) - minus_c_5);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
