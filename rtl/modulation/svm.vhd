-- Purpose: symmetrical space-vector modulation, stator voltage to three duties, without a divider.
--   x = u_alpha/u_dc,  y = sqrt(3)/2*u_beta/u_dc,  by inverse and inverse_beta of u_dc_processing
--   legs a = x, b = -x/2 + y, c = -x/2 - y;  duty = 1/2 + leg + mid(a,b,c)/2
-- The middle leg is a if |3x| <= |2y|; otherwise b if x and y have the same sign, c if not.
-- Formats: products 33 fraction bits; x, y S(1,17); legs S(3,18), exact; duty U(1,16), 0 to 1.
-- Latency: 5.  Rounding: half up.  x and y need no limiter: voltage_limit allows less than one bus voltage, because
-- k_u_max is below 1.
-- The legs sum to zero, so |leg + mid/2| is at most half the distance of two legs: below 4, two bits more than a duty.

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
  signal x_2       : signed(SVM_SCALED_W - 1 downto 0);
  signal y_2       : signed(SVM_SCALED_W - 1 downto 0);
  signal alike_2   : std_logic;
  signal triple_2  : signed(LEG_W - 1 downto 0);
  signal double_2  : signed(LEG_W - 1 downto 0);  -- 2y, or not 2y if x and y have the same sign
  signal apart_2   : signed(LEG_W + 1 downto 0);
  signal leg_a_3   : signed(LEG_W - 1 downto 0);
  signal leg_b_3   : signed(LEG_W - 1 downto 0);
  signal minus_c_3 : signed(LEG_W - 1 downto 0);
  signal alike_3   : std_logic;
  signal a_mid_3   : std_logic;
  signal mid_3     : signed(LEG_W - 1 downto 0);
  signal carry_3   : signed(1 downto 0);
  signal leg_a_4   : signed(LEG_W - 1 downto 0);
  signal leg_b_4   : signed(LEG_W - 1 downto 0);
  signal minus_c_4 : signed(LEG_W - 1 downto 0);
  signal mid_4     : signed(LEG_W - 1 downto 0);

  -- 1/2 + sum/4, limited to 0..1; sum = leg + mid/2 includes half an LSB for the rounding.
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

  x_2 <= prod_x_2(SVM_DROP_SCALED + SVM_SCALED_W - 1 downto SVM_DROP_SCALED);
  y_2 <= prod_y_2(SVM_DROP_SCALED + SVM_SCALED_W - 1 downto SVM_DROP_SCALED);

  -- |3x| - |2y|, multiplied by the sign of x.  The bit above the sum's replaces the missing sign of 3x: it is 1 if
  -- |2y| is the larger
  alike_2  <= x_2(x_2'high) xnor y_2(y_2'high);
  triple_2 <= shift_left(resize(x_2, LEG_W), 1) + x_2;
  double_2 <= shift_left(resize(y_2, LEG_W), 1) xor (LEG_W - 1 downto 0 => alike_2);
  apart_2  <= signed('0' & triple_2 & alike_2) + (double_2 & alike_2);

  mid_3   <= leg_a_3 when a_mid_3 = '1' else
             leg_b_3 when alike_3 = '1' else
             not minus_c_3;
  carry_3 <= '0' & not (a_mid_3 or alike_3);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod_x = u_alpha*inverse,  prod_y = u_beta*inverse_beta
      if valid(0) = '1' then
        prod_x_1 <= u_alpha * signed('0' & inverse);
        prod_y_1 <= u_beta * signed('0' & inverse_beta);
      end if;

      -- Stage 2: x and y plus half an LSB, which rounds them
      if valid(1) = '1' then
        prod_x_2 <= prod_x_1 + half(SVM_DROP_SCALED, PROD_W);
        prod_y_2 <= prod_y_1 + half(SVM_DROP_SCALED, PROD_W);
      end if;

      -- Stage 3: legs with one more fraction bit, -c instead of c; selection of the middle leg
      if valid(2) = '1' then
        leg_a_3   <= shift_left(resize(x_2, LEG_W), 1);
        leg_b_3   <= shift_left(resize(y_2, LEG_W), 1) - x_2;
        minus_c_3 <= shift_left(resize(y_2, LEG_W), 1) + x_2;
        alike_3   <= alike_2;
        a_mid_3   <= apart_2(LEG_W + 1);
      end if;

      -- Stage 4: the middle leg, plus half an LSB of the duty for the rounding
      if valid(3) = '1' then
        leg_a_4   <= leg_a_3;
        leg_b_4   <= leg_b_3;
        minus_c_4 <= minus_c_3;
        mid_4     <= mid_3 + (to_signed(2 ** (SVM_DROP_DUTY - 1), LEG_W) or resize(carry_3, LEG_W));
      end if;

      -- Stage 5: duty = 1/2 + leg + mid/2, rounded and limited to 0..1
      if valid(4) = '1' then
        duty_a <= to_duty(leg_a_4 + mid_4(LEG_W - 1 downto 1));
        duty_b <= to_duty(leg_b_4 + mid_4(LEG_W - 1 downto 1));
        duty_c <= to_duty(mid_4(LEG_W - 1 downto 1) - minus_c_4);
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
