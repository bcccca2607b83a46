-- Purpose: current regulators of both axes, d first, through one pair of multipliers.
--   err = i_ref - i;  u_pi = kp*err + int
--   int += ki*err unless the voltage was at its limit and err pushes further
-- sat_d, sat_q (-1, 0, +1): the limits that were active in the previous sample.  run = 0: all zero.
-- Formats: err PU, proportional part 28 fraction bits, integral S(1,28), output PU.
-- Latency: 8 (d, then q: i_q and i_q_ref are needed a clock after i_d, u_pi_d is valid with out_soon).
-- Interval: 3.
-- Rounding: half up.  err, integral and output saturate at 2 per unit, twice the limiter's voltage.  The
-- proportional part needs no limit of its own, because the output saturates anyway; nor does the increment, as
-- ki < 1.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity current_pi is
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    in_valid  : in  std_logic;
    i_d       : in  signed(PU_W - 1 downto 0);
    i_q       : in  signed(PU_W - 1 downto 0);
    i_d_ref   : in  signed(PU_W - 1 downto 0);
    i_q_ref   : in  signed(PU_W - 1 downto 0);
    sat_d     : in  signed(1 downto 0);
    sat_q     : in  signed(1 downto 0);
    run       : in  std_logic;
    kp_d      : in  unsigned(KP_W - 1 downto 0);
    ki_d      : in  unsigned(KI_W - 1 downto 0);
    kp_q      : in  unsigned(KP_W - 1 downto 0);
    ki_q      : in  unsigned(KI_W - 1 downto 0);
    out_soon  : out std_logic;
    out_valid : out std_logic;
    u_pi_d    : out signed(PU_W - 1 downto 0);
    u_pi_q    : out signed(PU_W - 1 downto 0);
    u_int_d   : out signed(INTEGRAL_W - 1 downto 0);
    u_int_q   : out signed(INTEGRAL_W - 1 downto 0)
  );
end entity current_pi;

architecture rtl of current_pi is
  constant LATENCY : positive := CURRENT_PI_LATENCY;
  constant SUM_W   : positive := PU_W + KP_W + 2;

  -- State: the two integrals share this register alternately; while the d axis is processed, integral_5 is that of q
  signal integral_3 : signed(INTEGRAL_W - 1 downto 0);
  signal integral_5 : signed(INTEGRAL_W - 1 downto 0);

  signal valid    : std_logic_vector(0 to LATENCY);
  signal i_0      : signed(PU_W - 1 downto 0);
  signal i_ref_0  : signed(PU_W - 1 downto 0);
  signal diff_1   : signed(PU_W downto 0);
  signal ki_1     : unsigned(KI_W - 1 downto 0);
  signal sat_1    : signed(1 downto 0);
  signal run_1    : std_logic;
  signal hold_1   : std_logic;
  signal err_2    : signed(PU_W - 1 downto 0);
  signal ki_2     : unsigned(KI_W - 1 downto 0);
  signal hold_2   : std_logic;
  signal run_2    : std_logic;
  signal err_3    : signed(PU_W - 1 downto 0);
  signal prod_i_3 : signed(PU_W + KI_W downto 0);
  signal hold_3   : std_logic;
  signal run_3    : std_logic;
  signal err_4    : signed(PU_W - 1 downto 0);
  signal kp_4     : unsigned(KP_W - 1 downto 0);
  signal sum_i_4  : signed(PU_W + KI_W downto 0);
  signal hold_4   : std_logic;
  signal old_4    : signed(INTEGRAL_W - 1 downto 0);
  signal prod_p_5 : signed(PU_W + KP_W downto 0);
  signal half_5   : signed(INTEGRAL_W downto 0);
  signal sum_p_6  : signed(SUM_W - 1 downto 0);
  signal u_pi_6   : signed(PU_W - 1 downto 0);
begin
  valid(0) <= in_valid;

  -- The axis of this clock: d while in_valid, then q.
  i_0     <= i_q when valid(1) = '1' else i_d;
  i_ref_0 <= i_q_ref when valid(1) = '1' else i_d_ref;

  hold_1 <= not run_1 or (sat_1(1) and diff_1(diff_1'high)) or (sat_1(0) and not sat_1(1) and not diff_1(diff_1'high));

  u_pi_6 <= saturate(shift_right(sum_p_6, CURRENT_PI_DROP_P + PU_TO_INTEGRAL), PU_W);

  process (clk)
    variable integral : signed(INTEGRAL_W - 1 downto 0);
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: diff = i_ref - i
      if valid(0) = '1' or valid(1) = '1' then
        diff_1 <= resize(i_ref_0, PU_W + 1) - resize(i_0, PU_W + 1);
        ki_1   <= ki_d;
        sat_1  <= sat_d;
        run_1  <= run;
        if valid(1) = '1' then
          ki_1  <= ki_q;
          sat_1 <= sat_q;
        end if;
      end if;

      -- Stage 2: err = diff, saturated
      if valid(1) = '1' or valid(2) = '1' then
        err_2  <= saturate(diff_1, PU_W);
        ki_2   <= ki_1;
        hold_2 <= hold_1;
        run_2  <= run_1;
      end if;

      -- Stage 3: prod_i = ki*err
      if valid(2) = '1' or valid(3) = '1' then
        prod_i_3 <= err_2 * signed('0' & ki_2);
        hold_3   <= hold_2;
        err_3    <= err_2;
        run_3    <= run_2;
      end if;

      -- Stage 4: int + prod_i plus half an LSB for the rounding;  kp, or zero while not running
      if valid(3) = '1' or valid(4) = '1' then
        sum_i_4 <= prod_i_3 + (integral_3 & half(CURRENT_PI_DROP_I, CURRENT_PI_DROP_I));
        hold_4  <= hold_3;
        old_4   <= integral_3;
        err_4   <= err_3;
        kp_4    <= kp_d;
        if valid(4) = '1' then
          kp_4 <= kp_q;
        end if;
        if run_3 = '0' then
          kp_4 <= (others => '0');
        end if;
      end if;

      -- Stage 5: int, narrowed, or the old one while held;  prod_p = kp*err;  int plus half an LSB of the output
      if valid(4) = '1' or valid(5) = '1' then
        integral := old_4;
        if hold_4 = '0' then
          integral := saturate(shift_right(sum_i_4, CURRENT_PI_DROP_I), INTEGRAL_W);
        end if;
        integral_5 <= integral;
        half_5     <= integral + half(PU_TO_INTEGRAL, INTEGRAL_W + 1);
        prod_p_5   <= err_4 * signed('0' & kp_4);
      end if;

      -- The integral register switches to q after the d axis has been read, and back for the next sample; both start
      -- from zero while not running
      if valid(3) = '1' or valid(5) = '1' then
        integral_3 <= integral_5;
      end if;
      if (valid(2) = '1' and run_2 = '0') or (valid(3) = '1' and run_3 = '0') then
        integral_3 <= (others => '0');
      end if;

      -- Stage 6: proportional + int
      if valid(5) = '1' or valid(6) = '1' then
        sum_p_6 <= resize(prod_p_5, SUM_W) + (half_5 & half(CURRENT_PI_DROP_P, CURRENT_PI_DROP_P));
      end if;
      if valid(5) = '1' then
        u_int_d <= integral_5;
      end if;
      if valid(6) = '1' then
        u_int_q <= integral_5;
      end if;

      -- Stage 7: u_pi, narrowed; d at clock 7, q at 8
      if valid(6) = '1' then
        u_pi_d <= u_pi_6;
      end if;
      if valid(7) = '1' then
        u_pi_q <= u_pi_6;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        integral_3          <= (others => '0');
        integral_5          <= (others => '0');
      end if;
    end if;
  end process;

  out_soon  <= valid(LATENCY - 1);
  out_valid <= valid(LATENCY);

end architecture rtl;
