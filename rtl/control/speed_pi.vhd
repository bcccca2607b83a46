-- Purpose: speed regulator, from speed error to i_q reference, limited, with conditional integration.
--   err = omega_ref - omega_me;  u = speed_kp*err + integral;  i_q_ref = limit(u, +-i_max)
--   integral += speed_ki*err unless u is beyond the limit and err pushes further
-- Torque mode (speed_mode = 0): i_q_ref is i_q_ext, limited, and the integral follows it.
-- run = 0: output and integral are zero.
-- One comparison with i_max serves the reference first, then the integral.  |v| = (v xor s) + s, s its sign.
-- Formats: err PU, proportional part 28 fraction bits, integral S(1,28), output PU.
-- Latency: 7; the integral is updated one clock later.  Interval: 7.
-- Rounding: half up; err saturates.  The proportional part needs no limit of its own, because i_q_ref is limited to
-- i_max anyway; nor does the increment, as speed_ki < 1; the integral is kept within +-i_max.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.fixed_pkg.all;
use work.fluxproof_pkg.all;

entity speed_pi is
  port (
    clk           : in  std_logic;
    rst           : in  std_logic;
    in_valid      : in  std_logic;
    omega_ref     : in  signed(PU_W - 1 downto 0);
    omega_me      : in  signed(PU_W - 1 downto 0);
    i_q_ext       : in  signed(PU_W - 1 downto 0);
    speed_mode    : in  std_logic;
    run           : in  std_logic;
    speed_kp      : in  unsigned(KP_W - 1 downto 0);
    speed_ki      : in  unsigned(KI_W - 1 downto 0);
    i_max         : in  signed(PU_W - 1 downto 0);
    out_valid     : out std_logic;
    i_q_ref       : out signed(PU_W - 1 downto 0);
    speed_limited : out std_logic
  );
end entity speed_pi;

architecture rtl of speed_pi is
  constant LATENCY : positive := SPEED_PI_LATENCY;
  constant SUM_W   : positive := PU_W + KP_W + 2;
  constant TOTAL_W : positive := SUM_W - SPEED_PI_DROP_P - PU_TO_INTEGRAL;

  -- State
  signal integral : signed(INTEGRAL_W - 1 downto 0);

  signal valid      : std_logic_vector(0 to LATENCY);
  signal diff_1     : signed(PU_W downto 0);
  signal kp_2       : unsigned(KP_W - 1 downto 0);
  signal ki_2       : unsigned(KI_W - 1 downto 0);
  signal err_2      : signed(PU_W - 1 downto 0);
  signal prod_p_3   : signed(PU_W + KP_W downto 0);
  signal prod_i_3   : signed(PU_W + KI_W downto 0);
  signal integral_3 : signed(INTEGRAL_W downto 0);
  signal rises_3    : std_logic;
  signal falls_3    : std_logic;
  signal sum_p_4    : signed(SUM_W - 1 downto 0);
  signal sum_i_4    : signed(PU_W + KI_W downto 0);
  signal total_4    : signed(TOTAL_W - 1 downto 0);
  signal moved_4    : signed(INTEGRAL_W downto 0);
  signal v_4        : signed(PU_W downto 0);
  signal far_4      : std_logic;
  signal v_5        : signed(PU_W downto 0);
  signal far_5      : std_logic;
  signal room_5     : signed(PU_W + 1 downto 0);
  signal v_6        : signed(PU_W downto 0);
  signal beyond_6   : std_logic;
  signal limited_6  : signed(PU_W - 1 downto 0);
  signal held_7     : std_logic;
  signal whole_7    : std_logic;
begin
  valid(0) <= in_valid;

  total_4 <= sum_p_4(SUM_W - 1 downto SUM_W - TOTAL_W);
  moved_4 <= sum_i_4(SPEED_PI_DROP_I + INTEGRAL_W downto SPEED_PI_DROP_I);

  -- The value to be limited, in PU with one more bit: the current reference, then the integral.  far: the bits above
  -- show that the reference is beyond any limit, so that only its sign matters
  v_4   <= resize(i_q_ext, PU_W + 1) when speed_mode = '0' else
           moved_4(INTEGRAL_W downto PU_TO_INTEGRAL) when valid(5) = '1' else
           total_4(TOTAL_W - 1) & total_4(PU_W - 1 downto 0);
  far_4 <= exceeds(total_4, PU_W + 1) and speed_mode and not valid(5);

  -- room = i_max - |v|, minus one for a positive integral, whose bits below v count too.  If v is far beyond, it is
  -- replaced by a constant that makes room negative; while not running by zero
  process (all)
    variable minus : signed(PU_W downto 0);
    variable carry : std_logic;
  begin
    minus := v_5 xor (PU_W downto 0 => not v_5(v_5'high));
    carry := not v_5(v_5'high) and not valid(6);
    if far_5 = '1' then
      minus := (PU_W => '1', others => '0');
    end if;
    if run = '0' then
      minus := (others => '0');
    end if;
    room_5 <= (resize(i_max, PU_W + 1) & '1') + (minus & carry);
  end process;

  -- v within +-i_max
  process (all)
    variable within : signed(PU_W - 1 downto 0);
  begin
    within := v_6(PU_W - 1 downto 0);
    if beyond_6 = '1' then
      within := i_max xor (within'range => v_6(v_6'high));
    end if;
    limited_6 <= plus_carry(within, beyond_6 and v_6(v_6'high));
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      valid(1 to LATENCY) <= valid(0 to LATENCY - 1);

      -- Stage 1: diff = omega_ref - omega_me
      if valid(0) = '1' then
        diff_1 <= resize(omega_ref, PU_W + 1) - resize(omega_me, PU_W + 1);
      end if;

      -- Stage 2: err = diff, saturated;  local copies of the gains, whose registers are far away
      kp_2 <= speed_kp;
      ki_2 <= speed_ki;
      if valid(1) = '1' then
        err_2 <= saturate(diff_1, PU_W);
      end if;

      -- Stage 3: prod_p = speed_kp*err, prod_i = speed_ki*err;  the integral plus half an LSB of the output
      if valid(2) = '1' then
        prod_p_3   <= err_2 * signed('0' & kp_2);
        prod_i_3   <= err_2 * signed('0' & ki_2);
        integral_3 <= integral + half(PU_TO_INTEGRAL, INTEGRAL_W + 1);
        rises_3    <= '1' when err_2 > 0 else '0';
        falls_3    <= err_2(err_2'high);
      end if;

      -- Stage 4: total = proportional + integral;  moved = integral + increment;  each plus half an LSB to round
      if valid(3) = '1' then
        sum_p_4 <= resize(prod_p_3, SUM_W) + (integral_3 & half(SPEED_PI_DROP_P, SPEED_PI_DROP_P));
        sum_i_4 <= prod_i_3 + (integral & half(SPEED_PI_DROP_I, SPEED_PI_DROP_I));
      end if;

      -- Stages 5, 6: the current reference, then the integral
      if valid(4) = '1' or valid(5) = '1' then
        v_5   <= v_4;
        far_5 <= far_4;
      end if;

      -- Stages 6, 7: comparison of v with i_max
      if valid(5) = '1' or valid(6) = '1' then
        v_6      <= v_5 and (v_5'range => run);
        beyond_6 <= room_5(room_5'high);
      end if;

      -- Stage 7: i_q_ref = limit(total or i_q_ext)
      if valid(6) = '1' then
        i_q_ref       <= limited_6;
        speed_limited <= beyond_6;
        held_7        <= speed_mode and beyond_6 and ((rises_3 and not v_6(v_6'high)) or (falls_3 and v_6(v_6'high)));
        whole_7       <= not speed_mode or not run;
      end if;

      -- Stage 8: integral = moved, limited, unless held
      if valid(7) = '1' and held_7 = '0' then
        integral <= limited_6 & moved_4(PU_TO_INTEGRAL - 1 downto 0);
        if whole_7 = '1' or beyond_6 = '1' then
          integral(PU_TO_INTEGRAL - 1 downto 0) <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        valid(1 to LATENCY) <= (others => '0');
        integral            <= (others => '0');
      end if;
    end if;
  end process;

  out_valid <= valid(LATENCY);

end architecture rtl;
