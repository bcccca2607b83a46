-- Purpose: error of the flux estimate, from the current regulators' integrals, paper 001 eq. (15); d first, then q.
--   delta_lambda_d =  (u_int_q - r*i_q) * factor * 2**n_omega
--   delta_lambda_q = -(u_int_d - r*i_d) * factor * 2**n_omega
-- u_int is that of two samples before.  While the integrals contain other voltages (voltage at its limit, a current
-- converter at its end, voltage not known) delta_lambda decays by a sixteenth per sample; zero while the gates are off.
-- Formats: r U(0,24), u_int and the difference 28 fraction bits, factor S(0,17), out FLUX.
-- Latency: 12 (d, then q).  Interval: 12.
-- Rounding: half up after r*i, the shift and the factor.  The shifted difference and the result saturate; saturation of
-- the difference is reported unless the factor is zero.

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
  constant DROP_R  : positive := DELTA_LAMBDA_DROP_R;
  constant DROP    : positive := DELTA_LAMBDA_DROP_FACTOR;

  -- State, with delta_lambda_d and delta_lambda_q; suffix 1: previous sample, 2: the one before
  signal u_int_d_1 : signed(INTEGRAL_W - 1 downto 0);
  signal u_int_q_1 : signed(INTEGRAL_W - 1 downto 0);
  signal u_int_d_2 : signed(INTEGRAL_W - 1 downto 0);
  signal u_int_q_2 : signed(INTEGRAL_W - 1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal free_1     : std_logic;                     -- the voltage is not at its limit
  signal measured_1 : std_logic;
  signal held_2     : std_logic;
  signal moving_1   : std_logic_vector(1 downto 0);  -- factor /= 0, one bit for each half of its bits
  signal limited    : std_logic;  -- of either axis
  signal i_1        : signed(PU_W - 1 downto 0);
  signal prod_2     : signed(PU_W + RESISTANCE_W downto 0);
  signal u_int_2    : signed(INTEGRAL_W - 1 downto 0);
  signal sum_3      : signed(REST_W + DROP_R downto 0);
  signal rest_3     : signed(REST_W - 1 downto 0);
  signal coarse_3   : signed(FIT_W - 1 downto 0);
  signal over_3     : std_logic_vector(2 downto 0);
  signal coarse_4   : signed(FIT_W - 1 downto 0);
  signal over_4     : std_logic_vector(2 downto 0);
  signal more_4     : std_logic;
  signal sign_4     : std_logic;
  signal fine_4     : signed(FIT_W - 1 downto 0);
  signal shifted_5  : signed(FIT_W downto 0);
  signal over_5     : std_logic;
  signal rounded_6  : signed(FLUX_W downto 0);
  signal past_6     : std_logic;
  signal rounded_5  : signed(FLUX_W + 1 downto 0);
  signal value_7    : signed(FLUX_W - 1 downto 0);
  signal prod_8     : signed(PROD_W - 1 downto 0);
  signal half_8     : signed(PROD_W downto 0);
  signal sum_9      : signed(PROD_W downto 0);
  signal old_9      : signed(FLUX_W - 1 downto 0);
  signal sum_10     : signed(PROD_W - DROP downto 0);
  signal past_10    : std_logic;
  signal faded_10   : signed(FLUX_W - 1 downto 0);
  signal delta_10   : signed(FLUX_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The axis of this clock: d, from the quantities of q, then q, from those of d.
  u_int_2 <= u_int_d_2 when valid(3) = '1' else u_int_q_2;
  old_9   <= delta_lambda_q when valid(10) = '1' else delta_lambda_d;

  -- sum is the complement of u_int - prod, because the adder behind the multiplier can only add.
  rest_3 <= not sum_3(REST_W - 1 + DROP_R downto DROP_R);

  -- Whether the shift loses a bit that differs from the sign: first by multiples of four, then by the remainder.
  process (all)
  begin
    more_4 <= '0';
    for k in 0 to 2 loop
      if n_omega(3 downto 2) > k and over_4(k) = '1' then
        more_4 <= '1';
      end if;
      if n_omega(1 downto 0) > k and coarse_4(FIT_W - 1 - k) /= sign_4 then
        more_4 <= '1';
      end if;
    end loop;
  end process;

  -- Shift by multiples of four, then by the remainder; outside the clocked process for fast simulation.
  coarse_3 <= shift_left(rest_3(FIT_W - 1 downto 0), to_integer(n_omega(3 downto 2) & "00"));
  fine_4   <= shift_left(coarse_4, to_integer(n_omega(1 downto 0)));

  process (all)
  begin
    for k in over_3'range loop
      over_3(k) <= or (rest_3(FIT_W - 1 - 4 * k downto FIT_W - 4 - 4 * k) xor rest_3(REST_W - 1));
    end loop;
  end process;

  rounded_5 <= round_half_up(shifted_5, DELTA_LAMBDA_DROP_SHIFTED);

  -- prod is rounded half up for d, -prod for q: not (prod - half - 1) = -prod + half.
  half_8   <= rounding_base("0", DROP, PROD_W + 1) xor valid(9);
  delta_10 <= faded_10 when held_2 = '1' else
              narrowed(sum_10, past_10, FLUX_W) xor valid(11);

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stages 1, 2: held = run while the integrals contain other voltages; in two stages, as the flags are distant
      free_1     <= not ((or sat_d) or (or sat_q));
      measured_1 <= voltage_known and not (or current_at_rail);
      held_2     <= run and not (free_1 and measured_1);

      -- Stage 1: whether the factor is not zero
      moving_1 <= (or factor(RECIPROCAL_W downto RECIPROCAL_W / 2)) & (or factor(RECIPROCAL_W / 2 - 1 downto 0));

      -- Stages 1, 2: prod = r*i
      if valid(0) = '1' or valid(1) = '1' then
        i_1 <= i_d when valid(1) = '1' else i_q;
      end if;
      if valid(1) = '1' or valid(2) = '1' then
        prod_2 <= i_1 * signed('0' & r);
      end if;

      -- Stage 3: rest = u_int - prod
      if valid(2) = '1' or valid(3) = '1' then
        sum_3 <= rounding_base(not u_int_2, DROP_R, REST_W + DROP_R + 1) + prod_2;
      end if;

      -- Stages 4, 5: shifted = rest * 2**n_omega, by multiples of four, then by the remainder
      coarse_4  <= coarse_3;
      over_4    <= over_3;
      sign_4    <= rest_3(REST_W - 1);
      shifted_5 <= sign_4 & fine_4;
      over_5    <= more_4;

      -- Stages 6, 7: value = shifted, narrowed; the sign is taken before the rounding, which may change it
      rounded_6 <= shifted_5(FIT_W) & rounded_5(FLUX_W - 1 downto 0);
      past_6    <= over_5 or exceeds(rounded_5, FLUX_W);
      if valid(6) = '1' or valid(7) = '1' then
        value_7 <= narrowed(rounded_6, past_6, FLUX_W);
        limited <= past_6 or (limited and valid(7));
      end if;

      -- Stages 8, 9: sum = value * factor, plus half an LSB for the rounding
      if valid(7) = '1' or valid(8) = '1' then
        prod_8 <= value_7 * factor;
      end if;
      if valid(8) = '1' or valid(9) = '1' then
        sum_9 <= half_8 + prod_8;
      end if;

      -- Stage 10: whether the sum fits, and the decayed delta_lambda for held samples
      if valid(9) = '1' or valid(10) = '1' then
        sum_10   <= sum_9(PROD_W downto DROP);
        past_10  <= exceeds(sum_9(PROD_W downto DROP), FLUX_W);
        faded_10 <= minus_rounded(old_9, old_9, DELTA_LAMBDA_FADE);
      end if;

      -- Stage 11: delta_lambda = sum for d, -sum for q, narrowed, or the decayed value; d at clock 11, q at 12
      if valid(10) = '1' then
        delta_lambda_d <= delta_10;
      end if;
      if valid(10) = '1' and run = '0' then
        delta_lambda_d <= (others => '0');
      end if;
      if valid(11) = '1' then
        delta_lambda_q <= delta_10;
        delta_held     <= held_2;
        delta_limited  <= limited and (or moving_1) and run and not held_2;
        u_int_d_1      <= u_int_d;
        u_int_q_1      <= u_int_q;
        u_int_d_2      <= u_int_d_1;
        u_int_q_2      <= u_int_q_1;
      end if;
      if valid(11) = '1' and run = '0' then
        delta_lambda_q <= (others => '0');
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
