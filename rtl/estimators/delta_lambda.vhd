-- Purpose: what the current regulators' integrals say about the flux, paper 001 eq. (15); d first, then q.
--   delta_lambda_d =  (u_int_q - r*i_q) * factor * 2**n_omega
--   delta_lambda_q = -(u_int_d - r*i_d) * factor * 2**n_omega
-- u_int is that of two samples before.  While the integrals mean something else (a limit, a current converter at its
-- end, voltage not known) delta_lambda fades by a sixteenth a sample; zero while the gates are off.
-- Formats: r U(0,24), u_int and the difference 28 fraction bits, factor S(0,17), out FLUX.
-- Latency: 8 (d, q follow each other).  Interval: 8.
-- Rounding: half up after r*i, the shift and the factor.  The shifted difference and the result saturate; the former
-- is told unless the factor is zero.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity delta_lambda is
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    in_valid        : in  std_logic;
    u_int_d         : in  signed(INTEGRAL_W - 1 downto 0);
    u_int_q         : in  signed(INTEGRAL_W - 1 downto 0);
    i_d             : in  signed(PU_W - 1 downto 0);
    i_q             : in  signed(PU_W - 1 downto 0);
    sat_d           : in  signed(1 downto 0);
    sat_q           : in  signed(1 downto 0);
    current_at_rail : in  unsigned(2 downto 0);
    voltage_known   : in  std_logic;
    run             : in  std_logic;
    factor          : in  signed(RECIPROCAL_W downto 0);
    n_omega         : in  unsigned(3 downto 0);
    r               : in  unsigned(RESISTANCE_W - 1 downto 0);
    out_valid       : out std_logic;
    delta_lambda_d  : out signed(FLUX_W - 1 downto 0);
    delta_lambda_q  : out signed(FLUX_W - 1 downto 0);
    delta_held      : out std_logic;
    delta_limited   : out std_logic
  );
end entity delta_lambda;

architecture rtl of delta_lambda is
  constant LATENCY : positive := DELTA_LAMBDA_LATENCY;
  constant REST_W  : positive := INTEGRAL_W + 1;
  constant FIT_W   : positive := FLUX_W + DELTA_LAMBDA_DROP_SHIFTED;
  constant PROD_W  : positive := FLUX_W + RECIPROCAL_W + 1;
  constant DROP    : positive := DELTA_LAMBDA_DROP_FACTOR;

  -- State, with delta_lambda_d and delta_lambda_q; 1 and 2: of how many samples before
  signal u_int_d_1 : signed(INTEGRAL_W - 1 downto 0);
  signal u_int_q_1 : signed(INTEGRAL_W - 1 downto 0);
  signal u_int_d_2 : signed(INTEGRAL_W - 1 downto 0);
  signal u_int_q_2 : signed(INTEGRAL_W - 1 downto 0);

  signal valid     : std_logic_vector(0 to LATENCY);
  signal held      : std_logic;
  signal limited   : std_logic;  -- in either axis
  signal i_0       : signed(PU_W - 1 downto 0);
  signal prod_1    : signed(PU_W + RESISTANCE_W downto 0);
  signal u_int     : signed(INTEGRAL_W - 1 downto 0);
  signal rest_1    : signed(REST_W downto 0);
  signal rest_2    : signed(REST_W - 1 downto 0);
  signal over_2    : std_logic;
  signal coarse_3  : signed(FIT_W - 1 downto 0);
  signal over_3    : std_logic;
  signal sign_3    : std_logic;
  signal shifted_4 : signed(FIT_W downto 0);
  signal rounded_4 : signed(FLUX_W + 1 downto 0);
  signal value_5   : signed(FLUX_W - 1 downto 0);
  signal prod_6    : signed(PROD_W - 1 downto 0);
  signal turned_6  : signed(PROD_W - 1 downto 0);
  signal half_6    : signed(PROD_W downto 0);
  signal sum_6     : signed(PROD_W downto 0);
  signal delta_6   : signed(FLUX_W - 1 downto 0);
begin
  valid(0) <= in_valid;
  held     <= run when sat_d /= 0 or sat_q /= 0 or current_at_rail /= 0 or voltage_known = '0' else '0';

  -- The axis of the beat: d, made of the quantities of q, then q, made of those of d.
  i_0   <= i_d when valid(1) = '1' else i_q;
  u_int <= u_int_d_2 when valid(2) = '1' else u_int_q_2;

  -- u_int - prod by one carry: what is rounded up is subtracted, so the floor needs no half.
  rest_1 <= (resize(u_int, REST_W) & '0') - resize(shift_right(prod_1, DELTA_LAMBDA_DROP_R - 1), REST_W + 1);

  -- Whether a bit unlike the sign is shifted into the sign or past it.
  process (all)
  begin
    over_2 <= '0';
    for k in 0 to SPEED_RECIPROCAL_N_MAX - 1 loop
      if n_omega > k and rest_2(FIT_W - 1 - k) /= rest_2(REST_W - 1) then
        over_2 <= '1';
      end if;
    end loop;
  end process;

  rounded_4 <= round_half_up(shifted_4, DELTA_LAMBDA_DROP_SHIFTED);

  -- Half up of prod for d, of -prod for q, by one carry: the one that the complement lacks comes with the half.
  half_6   <= to_signed(2 ** (DROP - 1) + 1, PROD_W + 1) when valid(7) = '1' else
              to_signed(2 ** (DROP - 1), PROD_W + 1);
  turned_6 <= not prod_6 when valid(7) = '1' else prod_6;
  sum_6    <= half_6 + turned_6;
  delta_6  <= saturate(sum_6(PROD_W downto DROP), FLUX_W);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: prod = r*i
      if valid(0) = '1' then
        limited <= '0';
      end if;
      if valid(0) = '1' or valid(1) = '1' then
        prod_1 <= i_0 * signed('0' & r);
      end if;

      -- Stage 2: rest = u_int - prod
      if valid(1) = '1' or valid(2) = '1' then
        rest_2 <= rest_1(REST_W downto 1);
      end if;

      -- Stages 3, 4: shifted = rest * 2**n_omega, by fours, then the remainder
      if valid(2) = '1' or valid(3) = '1' then
        coarse_3 <= shift_left(rest_2(FIT_W - 1 downto 0), to_integer(n_omega(3 downto 2) & "00"));
        over_3   <= over_2;
        sign_3   <= rest_2(REST_W - 1);
      end if;
      if valid(3) = '1' or valid(4) = '1' then
        shifted_4        <= '0' & shift_left(coarse_3, to_integer(n_omega(1 downto 0)));
        shifted_4(FIT_W) <= sign_3;
        if over_3 = '1' then
          -- Two bits, so that rounding cannot bring a negative one back.
          shifted_4(FIT_W - 1 downto FIT_W - 2) <= (others => not sign_3);
        end if;
      end if;

      -- Stage 5: value = shifted, narrowed
      if valid(4) = '1' or valid(5) = '1' then
        value_5 <= saturate(rounded_4, FLUX_W);
        if exceeds(rounded_4, FLUX_W) = '1' then
          limited <= '1';
        end if;
      end if;

      -- Stage 6: prod = value * factor
      if valid(5) = '1' or valid(6) = '1' then
        prod_6 <= value_5 * factor;
      end if;

      -- Stage 7: delta_lambda = prod for d, -prod for q, narrowed, or what is left of it; d at clock 7, q at 8
      if valid(6) = '1' then
        if run = '0' then
          delta_lambda_d <= (others => '0');
        elsif held = '1' then
          delta_lambda_d <= minus_rounded(delta_lambda_d, delta_lambda_d, DELTA_LAMBDA_FADE);
        else
          delta_lambda_d <= delta_6;
        end if;
      end if;
      if valid(7) = '1' then
        if run = '0' then
          delta_lambda_q <= (others => '0');
        elsif held = '1' then
          delta_lambda_q <= minus_rounded(delta_lambda_q, delta_lambda_q, DELTA_LAMBDA_FADE);
        else
          delta_lambda_q <= delta_6;
        end if;
        delta_held    <= held;
        delta_limited <= '0';
        if run = '1' and held = '0' and factor /= 0 then
          delta_limited <= limited;
        end if;
        u_int_d_1 <= u_int_d;
        u_int_q_1 <= u_int_q;
        u_int_d_2 <= u_int_d_1;
        u_int_q_2 <= u_int_q_1;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        u_int_d_1           <= (others => '0');
        u_int_q_1           <= (others => '0');
        u_int_d_2           <= (others => '0');
        u_int_q_2           <= (others => '0');
        delta_lambda_d      <= (others => '0');
        delta_lambda_q      <= (others => '0');
        delta_held          <= '0';
        delta_limited       <= '0';
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
