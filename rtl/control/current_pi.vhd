-- Purpose: current regulators of both axes, d first, through one pair of multipliers.
--   err = i_ref - i;  u_pi = kp*err + int
--   int += ki*err unless the voltage was at its limit and err pushes further
-- sat_d, sat_q (-1, 0, +1): the limit that held the axis in the sample before.  run = 0: all zero.
-- Formats: err PU, proportional part S(3,28), integral S(1,28), output PU.
-- Latency: 6 (d, q follow each other).  Interval: 2.
-- Rounding: half up.  err, integral and output saturate at 2 per unit, twice what the limiter grants; the
-- proportional part at 8, far beyond the output's limit.

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
    out_valid : out std_logic;
    u_pi_d    : out signed(PU_W - 1 downto 0);
    u_pi_q    : out signed(PU_W - 1 downto 0);
    u_int_d   : out signed(INTEGRAL_W - 1 downto 0);
    u_int_q   : out signed(INTEGRAL_W - 1 downto 0)
  );
end entity current_pi;

architecture rtl of current_pi is
  constant LATENCY : positive := CURRENT_PI_LATENCY;
  constant P_W     : positive := CURRENT_PI_PROPORTIONAL_W;

  -- State
  signal integral_d : signed(INTEGRAL_W - 1 downto 0);
  signal integral_q : signed(INTEGRAL_W - 1 downto 0);

  signal valid          : std_logic_vector(0 to LATENCY);
  signal i_0            : signed(PU_W - 1 downto 0);
  signal i_ref_0        : signed(PU_W - 1 downto 0);
  signal sat_0          : signed(1 downto 0);
  signal kp_1           : unsigned(KP_W - 1 downto 0);
  signal ki_1           : unsigned(KI_W - 1 downto 0);
  signal err_1          : signed(PU_W - 1 downto 0);
  signal sat_1          : signed(1 downto 0);
  signal run_1          : std_logic;
  signal prod_p_2       : signed(PU_W + KP_W downto 0);
  signal prod_i_2       : signed(PU_W + KI_W downto 0);
  signal hold_2         : std_logic;
  signal run_2          : std_logic;
  signal proportional_3 : signed(P_W - 1 downto 0);
  signal increment_3    : signed(INTEGRAL_W - 1 downto 0);
  signal run_3          : std_logic;
  signal integral_3     : signed(INTEGRAL_W - 1 downto 0);
  signal proportional_4 : signed(P_W - 1 downto 0);
  signal integral_4     : signed(INTEGRAL_W - 1 downto 0);
  signal sum_4          : signed(P_W downto 0);
begin
  valid(0) <= in_valid;

  -- The axis of the beat: d while in_valid, then q.
  i_0     <= i_q when valid(1) = '1' else i_d;
  i_ref_0 <= i_q_ref when valid(1) = '1' else i_d_ref;
  sat_0   <= sat_q when valid(1) = '1' else sat_d;
  kp_1    <= kp_q when valid(2) = '1' else kp_d;
  ki_1    <= ki_q when valid(2) = '1' else ki_d;

  -- The next integral of the axis at stage 4: held in its range, zero while not running.
  process (all)
    variable old : signed(INTEGRAL_W - 1 downto 0);
  begin
    old := integral_d;
    if valid(4) = '1' then
      old := integral_q;
    end if;
    integral_3 <= saturate(resize(old, INTEGRAL_W + 1) + increment_3, INTEGRAL_W);
    if run_3 = '0' then
      integral_3 <= (others => '0');
    end if;
  end process;

  sum_4 <= resize(proportional_4, P_W + 1) + integral_4;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: err = i_ref - i
      if valid(0) = '1' or valid(1) = '1' then
        err_1 <= saturate(resize(i_ref_0, PU_W + 1) - resize(i_0, PU_W + 1), PU_W);
        sat_1 <= sat_0;
        run_1 <= run;
      end if;

      -- Stage 2: prod_p = kp*err, prod_i = ki*err
      if valid(1) = '1' or valid(2) = '1' then
        prod_p_2 <= err_1 * signed('0' & kp_1);
        prod_i_2 <= err_1 * signed('0' & ki_1);
        run_2    <= run_1;
        hold_2   <= '0';
        if (sat_1 > 0 and err_1 > 0) or (sat_1 < 0 and err_1 < 0) then
          hold_2 <= '1';
        end if;
      end if;

      -- Stage 3: proportional, increment = products, narrowed
      if valid(2) = '1' or valid(3) = '1' then
        proportional_3 <= round_sat(prod_p_2, CURRENT_PI_DROP_P, P_W);
        increment_3    <= round_sat(prod_i_2, CURRENT_PI_DROP_I, INTEGRAL_W);
        run_3          <= run_2;
        if hold_2 = '1' then
          increment_3 <= (others => '0');
        end if;
      end if;

      -- Stage 4: int = int + increment
      if valid(3) = '1' then
        integral_d <= integral_3;
      end if;
      if valid(4) = '1' then
        integral_q <= integral_3;
      end if;
      if valid(3) = '1' or valid(4) = '1' then
        integral_4     <= integral_3;
        proportional_4 <= proportional_3;
        if run_3 = '0' then
          proportional_4 <= (others => '0');
        end if;
      end if;

      -- Stage 5: u_pi = proportional + int, narrowed; d at clock 5, q at 6
      if valid(4) = '1' then
        u_pi_d  <= round_sat(sum_4, PU_TO_INTEGRAL, PU_W);
        u_int_d <= integral_4;
      end if;
      if valid(5) = '1' then
        u_pi_q  <= round_sat(sum_4, PU_TO_INTEGRAL, PU_W);
        u_int_q <= integral_4;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        integral_d          <= (others => '0');
        integral_q          <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
